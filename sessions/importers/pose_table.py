"""Poses as their source has them, and their one way into the canonical frame: axes, lengths, clock.

Gaze and numbers beside them go the same way; what is dropped is counted.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sessions.errors import ImportFileError
from sessions.geometry.rotations import rotated
from sessions.importers.finish import Imported, counted, increasing, usable_track
from sessions.meshes.conventions import Convention
from sessions.model.track import GazeTrack, ScalarTrack, Track

LARGEST_SECONDS: Final = 9.0e9  # Just below what int64 nanoseconds hold


class PoseTable(NamedTuple):
    """The rows of one body: (n,) nanoseconds, (n, 3) and (n, 4) in axes and units of the source, (n,) or ``None``."""

    times_ns: NDArray[np.int64]
    positions: NDArray[np.float64]
    quaternions_xyzw: NDArray[np.float64]
    valid: NDArray[np.bool_] | None = None


@dataclass(frozen=True)
class SourceFrame:
    """What the numbers of a source mean; ``clock`` is a sentence for a reader, ``assumed`` what no file said."""

    axes: Convention
    units: str
    metres: float
    clock: str
    clock_unit: str = "s"
    assumed: tuple[str, ...] = ()


def imported(tables: Mapping[str, PoseTable], frame: SourceFrame, notes: Sequence[str] = ()) -> Imported:
    """The tables in the canonical frame and metres, with every conversion in the metadata."""
    axes = frame.axes
    done = [
        f"axes {axes.name} ({axes.words}) to right-handed, +Y up, -Z forward",
        f"lengths in {frame.units} to m",
        *([f"clock in {frame.clock_unit} to ns"] if frame.clock_unit != "ns" else []),
        *notes,
    ]
    tracks: dict[str, Track] = {}
    for name, table in tables.items():
        tracks[name], dropped, flagged = usable_track(*in_frame(table, frame))
        done += counted(name, dropped, flagged)
    facts = {
        "source_units": frame.units,
        "source_convention": axes.name,
        "handedness": axes.handedness,
        "clock": frame.clock,
    }
    if frame.assumed:
        facts["assumed"] = "; ".join(frame.assumed)
    return Imported(tracks, tuple(done), facts)


def in_frame(table: PoseTable, frame: SourceFrame) -> tuple[NDArray[Any], ...]:
    """Stamps, positions, quaternions and validity of a table, in the canonical frame and metres."""
    valid = np.ones(len(table.times_ns), dtype=np.bool_) if table.valid is None else table.valid
    place, turn = frame.axes.points(table.positions) * frame.metres, frame.axes.quaternions(table.quaternions_xyzw)
    return table.times_ns, place, turn, valid


def stamps_of(seconds: NDArray[np.float64], where: str) -> NDArray[np.int64]:
    """Seconds as int64 nanoseconds, (n,); ImportFileError where one is missing or beyond int64."""
    wrong = np.flatnonzero(~(np.abs(seconds) < LARGEST_SECONDS))
    if len(wrong):
        raise ImportFileError(f"{where}: row {int(wrong[0]) + 1} has no time in seconds; remove it or repair the file")
    return np.rint(seconds * 1e9).astype(np.int64)


Numbers = NDArray[np.float64]
Stamps = NDArray[np.int64]
Rows = NDArray[np.bool_]
NEAR_NS: Final = 50_000_000


@dataclass
class BesidePoses:
    """Collects them; a name that is there already gets a number."""

    gaze: dict[str, GazeTrack] = field(default_factory=dict)
    scalars: dict[str, ScalarTrack] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def scalar(self, name: str, times_ns: Stamps, values: Numbers, unit: str = "") -> None:
        """A number over time, (n,) and (n,); rows whose stamp does not increase are dropped."""
        keep = increasing(times_ns)
        self.notes += counted(f"scalar {name}", int((~keep).sum()), 0)
        self.scalars[_free(name, self.scalars)] = ScalarTrack(times_ns[keep], values[keep], unit)

    def looked(
        self, participant: str, times_ns: Stamps, origins: Numbers, directions: Numbers, valid: NDArray[np.bool_]
    ) -> None:
        """Where somebody looked, (n, 3) in the canonical frame; directions get length 1, what is no ray is lost."""
        keep = increasing(times_ns)
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            unit = directions / np.sqrt((directions**2).sum(axis=1, keepdims=True))
        track = GazeTrack(times_ns[keep], origins[keep], unit[keep], valid[keep])
        flagged = int((track.valid & ~track.usable).sum())
        self.notes += counted(f"gaze of {participant}", int((~keep).sum()), 0)
        self.notes += [f"gaze of {participant}: {flagged} samples flagged as lost that hold no ray"] * (flagged > 0)
        lost = GazeTrack(track.times_ns, track.origins, track.directions, track.usable)
        self.gaze[_free(participant, self.gaze)] = lost

    def put_into(self, samples: Imported, *, stated: bool = True) -> Imported:
        """What was read, with these beside it; ``stated``: the source says in which frame its gaze is."""
        done, facts = (*samples.conversions, *self.notes), dict(samples.facts)
        if self.gaze and not stated:
            facts["assumed"] = "; ".join([*filter(None, [facts.get("assumed")]), "gaze in the frame of the poses"])
        return replace(samples, conversions=done, facts=facts, gaze=self.gaze, scalars=self.scalars)


def carried(track: Track, times_ns: Stamps, origins: Numbers, directions: Numbers) -> tuple[Numbers, Numbers, Rows]:
    """Rays of a body's frame, (n, 3) each, in the world, and where the body has a pose within 50 ms, (n,)."""
    middles = track.times_ns[:-1] + np.diff(track.times_ns) // 2
    rows = np.searchsorted(middles, times_ns)
    turn, near = track.quaternions_xyzw[rows], np.abs(track.times_ns[rows] - times_ns) <= NEAR_NS
    return track.positions[rows] + rotated(turn, origins), rotated(turn, directions), near & track.valid[rows]


def _free(name: str, taken: dict[str, Any]) -> str:
    if name not in taken:
        return name
    return next(new for number in range(2, len(taken) + 3) if (new := f"{name} {number}") not in taken)
