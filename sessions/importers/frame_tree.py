"""Frames that hang from each other, composed to poses in their root, as tf2 of ROS does.

Stamps are those of the frames of a chain that move. Where two of them have clocks of their own, each is interpolated
at the stamps of the other, never across a gap. Source: Foote, "tf: The transform library", TePRA 2013.
"""

from array import array
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum, auto
from typing import Final

import numpy as np

from sessions.errors import ImportFileError
from sessions.geometry.rotations import quaternion_product, rotated_vectors, slerp
from sessions.importers.importing import INVERTED, PoseTable, is_rotation
from sessions.importers.ledger import Ledger, Numbers, Stamps, increasing_rows

MOST_NAMED: Final = 5
NO_STAMP: Final = -(1 << 63)
"""Stands for the stamp of a transform that bears none; no recording is that early."""
STATIC: Final = "_static"
"""The end of the topic whose transforms stay until they are sent again."""
NO_TIME: Final = "with a stamp of 0 among others that have one"
OUTSIDE: Final = "before or after all transforms of a frame that it hangs from"
MOST_AT_A_PULSE: Final = 3
"""Samples a second from which they are not those of a clock that pulses on the second, which is off by little."""
SEVERAL_FRACTIONS: Final = 5
"""Different parts of a second, of which chance puts none into its first thousandth."""
LARGEST_GAP_NS: Final = 200_000_000
"""A frame silent for longer than this, and elsewhere after it, is not interpolated: its pose there is lost."""


@dataclass
class _Link:
    """The transforms from a frame to its parent, as they come in; ``topic`` without ``STATIC``."""

    parent: str
    topic: str
    static: bool
    stamps: "array[int]" = field(default_factory=lambda: array("q"))
    log_times: "array[int]" = field(default_factory=lambda: array("q"))
    numbers: "array[float]" = field(default_factory=lambda: array("d"))

    def table(self, name: str, ledger: Ledger) -> tuple[Stamps, Numbers, int]:
        """Stamps that increase (n,), x y z qx qy qz qw (n, 7), and how many transforms have no stamp of their own.

        Transforms are taken in the order in which they were logged, unless their stamps increase in that of the file.
        A stamp of 0 is none where all are 0, as ROS has it; without a stamp the time of logging counts. Where some are
        0, the clock of the others is not that of the logging, and those of 0 are dropped.
        """
        stamps = np.frombuffer(self.stamps, dtype=np.int64)
        logged = np.frombuffer(self.log_times, dtype=np.int64)
        rows = np.frombuffer(self.numbers, dtype=np.float64).reshape(-1, 7)
        unstamped = stamps == NO_STAMP
        if not (stamps > 0).any():
            unstamped = np.ones(len(stamps), dtype=np.bool_)
        stamps = np.where(unstamped, logged, stamps)
        zero = (stamps == 0) & ~unstamped
        if zero.sum() > 1:  # a simulation may begin at 0, once
            ledger.book("transforms", name, read=int(zero.sum()), kept=0, dropped={NO_TIME: int(zero.sum())})
            stamps, logged, rows = stamps[~zero], logged[~zero], rows[~zero]
        if (logged[1:] < logged[:-1]).any() and (stamps[1:] < stamps[:-1]).any():
            order = np.argsort(logged, kind="stable")
            stamps, rows = stamps[order], rows[order]
        _refuse_coarse_nanoseconds(name, stamps[stamps > 0], ledger)
        keep = increasing_rows(name, stamps, (rows,), ledger, kind="transforms")
        return stamps[keep], rows[keep], int(unstamped.sum())


def _refuse_coarse_nanoseconds(name: str, stamps: Stamps, ledger: Ledger) -> None:
    """Refuse stamps whose nanoseconds are microseconds or milliseconds: each second passes in a thousandth of it."""
    _, samples = np.unique(stamps // 1_000_000_000, return_counts=True)
    fractions = np.unique(stamps % 1_000_000_000)
    if (samples >= MOST_AT_A_PULSE).sum() < 2 or len(fractions) < SEVERAL_FRACTIONS:
        return
    if int(fractions[-1]) < 1_000_000:
        raise ImportFileError(
            f"{ledger.source}: frame {name!r}: the nanoseconds of its {len(stamps):,} stamps are all below 1,000,000: "
            "they seem to be microseconds or milliseconds; write nanoseconds"
        )


class TransformKind(Enum):
    """When a transform holds, and what it moves."""

    MOVING = auto()
    """It holds at its stamp."""
    STATIC = auto()
    """It holds at all times."""
    ODOMETRY = auto()
    """It holds at its stamp, where no other transform places the frame."""


class FrameTree:
    """Transforms from child frames to their parents, as they come in; ``tables`` are the poses in the root.

    ``inverse_rotations``: the rotation of each transform comes in as its inverse.
    """

    def __init__(self, ledger: Ledger, *, inverse_rotations: bool = False) -> None:
        self._ledger = ledger
        self._inverse_rotations = inverse_rotations
        self._links: dict[str, _Link] = {}
        self._odometry: dict[str, dict[str, _Link]] = {}
        """Topic -> frame -> its poses, which count where no transform places the frame."""
        self._tables: dict[str, tuple[Stamps, Numbers]] = {}
        self._interpolated = False
        self.roots = tuple[str, ...]()
        """The frames that the poses are in, once there are tables."""

    def add(
        self,
        parent: str,
        child: str,
        stamp_ns: int | None,
        log_ns: int,
        numbers: Sequence[float],
        *,
        topic: str,
        kind: TransformKind = TransformKind.MOVING,
    ) -> None:
        """Take in a transform: a place and a quaternion xyzw; ``stamp_ns`` is ``None`` where it bears no stamp.

        Raises ``ImportFileError``: a frame without a name, with two parents or on two topics, or a stamp beyond int64.
        """
        parent, child = parent.strip("/"), child.strip("/")
        if not child:
            raise self._error("a transform has no child frame; record it again or choose by --topic")
        base = topic.removesuffix(STATIC)
        static = kind is TransformKind.STATIC
        links = self._odometry.setdefault(topic, {}) if kind is TransformKind.ODOMETRY else self._links
        link = links.setdefault(child, _Link(parent, base, static))
        if link.parent != parent:
            cure = "record its poses in one of them" if link.topic == base else "choose by --topic"
            raise self._error(f"frame {child!r} hangs from {link.parent!r} and from {parent!r}; {cure}")
        if link.topic != base:
            raise self._two_topics_error(child, link.topic, base)
        link.static &= static
        try:
            link.stamps.append(NO_STAMP if stamp_ns is None else stamp_ns)
            link.log_times.append(log_ns)
        except OverflowError:
            raise self._error(f"frame {child!r} has a stamp of {stamp_ns} ns; no recording is that late") from None
        if self._inverse_rotations:
            numbers = [*numbers[:3], *(-component for component in numbers[3:6]), numbers[6]]
        link.numbers.extend(numbers)

    def tables(self, *, join: bool = False) -> tuple[dict[str, PoseTable], list[str], list[str]]:
        """Every frame's poses in the root, what was done for them, and what was assumed.

        ``join``: several roots are taken for one world; otherwise they are an error.
        """
        unstamped = 0
        repeating = self._take_odometry()
        for name, link in self._links.items():
            stamps, rows, count = link.table(name, self._ledger)
            self._tables[name] = stamps, rows
            unstamped += count
        for name, link in repeating:
            self._book_repeating_odometry(name, link)
        chains = {name: self._chain(name) for name in self._links}
        root_of = {name: self._links[chain[-1]].parent for name, chain in chains.items()}
        roots = sorted({*root_of.values()} - {""})
        if len(roots) > 1:  # Of those, a tree that stands still tells nothing about what moves.
            moved = {root_of[name] for name, chain in chains.items() if any(map(self._moves, chain))}
            roots = sorted(moved - {""}) or roots
        if len(roots) > 1 and not join:
            raise self._error(
                f"frames hang from {len(roots)} roots ({_named(roots[:MOST_NAMED])}) and no transform joins them; "
                "choose one by --topic; several --topic are taken to share one world"
            )
        self.roots = tuple(roots)
        assumed = [f"frames {_named(roots)} taken for one world"] if len(roots) > 1 else []
        if roots and (unframed := [name for name, root in root_of.items() if not root]):
            assumed.append(
                f"poses of {_named(unframed[:MOST_NAMED])}, which name no frame, taken to be in {roots[0]!r}"
            )
        still = [name for name, root in root_of.items() if roots and root not in ("", *roots)]
        chains = {name: chain for name, chain in chains.items() if name not in still}
        moving = [self._tables[name][0] for name in self._links if self._moves(name)]
        everywhen = np.unique(np.concatenate(moving)) if moving else None
        tables = {name: self._composed_poses(chain, everywhen) for name, chain in chains.items()}
        empty = [name for name, table in tables.items() if not len(table.times_ns)]
        notes = [f"poses in the root frame {root!r}" for root in roots]
        left_out = {}
        if still:
            left_out[f"that stand still and that no transform joins to it: {_named(still)}"] = len(still)
        if empty:
            left_out[f"that never have stamps together with those above: {_named(empty)}"] = len(empty)
            tables = {name: table for name, table in tables.items() if name not in empty}
        self._ledger.book("names", read=len(self._links), kept=len(tables), dropped=left_out)
        if self._inverse_rotations:
            notes.append(INVERTED)
        if unstamped:
            notes.append(f"{unstamped} poses without a stamp have the time they were logged at")
        if self._interpolated:
            notes.append(f"frames of other stamps interpolated, not across {LARGEST_GAP_NS / 1e9:g} s")
        return tables, notes, assumed

    def _take_odometry(self) -> list[tuple[str, _Link]]:
        """Take odometry for the transforms of frames that have none; the odometry of all other frames."""
        repeating = []
        taken = dict[str, _Link]()
        for links in self._odometry.values():
            for name, link in links.items():
                if name in self._links:
                    repeating.append((name, link))
                elif name in taken:
                    raise self._two_topics_error(name, taken[name].topic, link.topic)
                else:
                    taken[name] = link
        self._links |= taken
        return repeating

    def _book_repeating_odometry(self, name: str, link: _Link) -> None:
        """Book the odometry of a frame that transforms place: merged where it has the same numbers, else dropped.

        Programs stamp the transform of an odometry with its own time or with a later one.
        """
        rows = np.frombuffer(link.numbers, dtype=np.float64).reshape(-1, 7)
        known = {row.tobytes() for row in self._tables[name][1]}
        is_same_frame = link.parent == self._links[name].parent
        merged = sum(row.tobytes() in known for row in rows) if is_same_frame else 0
        topic = self._links[name].topic
        other = f"of {name!r}, which {topic} places too, elsewhere or at other times; choose one by --topic"
        self._ledger.book(
            "transforms",
            link.topic,
            read=len(rows),
            kept=0,
            dropped={other: len(rows) - merged},
            merged={f"that repeat those of {name!r} on {topic}": merged},
        )

    def _moves(self, name: str) -> bool:
        return not self._links[name].static and len(self._tables[name][0]) > 1

    def _chain(self, name: str) -> list[str]:
        """The frame and those above it, the one below the root last."""
        chain = [name]
        while (parent := self._links[chain[-1]].parent) in self._links:
            if parent in chain:
                is_same_topic = len({self._links[frame].topic for frame in chain}) == 1
                cure = "correct the names of its frames" if is_same_topic else "choose by --topic"
                raise self._error(f"frame {name!r} hangs from itself by {parent!r}; {cure}")
            chain.append(parent)
        return chain

    def _composed_poses(self, chain: list[str], everywhen: Stamps | None) -> PoseTable:
        moving = [self._tables[name][0] for name in chain if self._moves(name)]
        if moving:
            stamps = np.unique(np.concatenate(moving))
            first, last = max(times[0] for times in moving), min(times[-1] for times in moving)
            inside = (stamps >= first) & (stamps <= last)
            outside = len(stamps) - int(inside.sum())
            self._ledger.book("samples", chain[0], read=outside, kept=0, dropped={OUTSIDE: outside})
            stamps = stamps[inside]
        else:
            stamps = self._tables[chain[0]][0] if everywhen is None else everywhen
        pose = self._at(chain[0], stamps)
        for name in chain[1:]:
            above = self._at(name, stamps)
            position = above[:, :3] + rotated_vectors(above[:, 3:], pose[:, :3])
            pose = np.concatenate([position, quaternion_product(above[:, 3:], pose[:, 3:])], axis=1)
        return PoseTable(stamps, pose[:, :3], pose[:, 3:])

    def _at(self, name: str, stamps: Stamps) -> Numbers:
        """Rows of a link at these stamps (n, 7): its own, held where it is static, else interpolated."""
        times, rows = self._tables[name]
        if not self._moves(name):
            return rows[np.maximum(np.searchsorted(times, stamps, side="right") - 1, 0)]
        after = np.searchsorted(times, stamps)  # stamps lie between the first and the last of a frame that moves
        rows_after: Numbers = rows[after]
        between = np.flatnonzero(times[after] != stamps)
        upper = after[between]
        self._interpolated |= len(between) > 0
        step = times[upper] - times[upper - 1]
        fraction = (stamps[between] - times[upper - 1]) / step
        start, end = rows[upper - 1], rows[upper]
        rows_after[between, :3] = start[:, :3] + fraction[:, None] * (end[:, :3] - start[:, :3])
        with np.errstate(invalid="ignore", divide="ignore"):
            rows_after[between, 3:] = slerp(start[:, 3:], end[:, 3:], fraction)
            has_moved = (start != end).any(axis=1)
            lost = (has_moved & (step > LARGEST_GAP_NS)) | ~(is_rotation(start[:, 3:]) & is_rotation(end[:, 3:]))
        rows_after[between[lost]] = np.nan
        return rows_after

    def _two_topics_error(self, name: str, first: str, second: str) -> ImportFileError:
        return self._error(f"frame {name!r} comes on the topics {first!r} and {second!r}; choose one by --topic")

    def _error(self, message: str) -> ImportFileError:
        return ImportFileError(f"{self._ledger.source}: {message}")


def _named(frames: list[str]) -> str:
    return ", ".join(map(repr, frames))
