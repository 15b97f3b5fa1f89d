"""What two runs differ in, in numbers and words."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from replay.outputs.tables import Table, table
from replay.outputs.words import counted
from replay.pipeline.gates import figure

if TYPE_CHECKING:
    from replay.studies.diff.runs import DetectorDiff, RunDiff

GAINED, LOST, SHIFTED = KINDS = ("gained", "lost", "shifted")

TRUTH: Final[Mapping[str, str]] = {
    "matched": ", confirmed by the reference",
    "piece": ", part of one of the reference's",
    "excused": ", undecided beside the reference",
    "invented": ", false",
}
"""How ``status`` of an episode is said, where the run was audited."""


@dataclass(frozen=True)
class Change:
    """One contact that a detector gained, lost or shifted.

    ``start`` is the second of its first beginning in either run; ``moved`` is by how many seconds an end of it moved.
    """

    kind: str
    start: float
    moved: float
    words: str


def changes(detector: "DetectorDiff") -> list[Change]:
    """Every contact that is not the same in both runs: gained, then lost, each by time, then the largest shifts."""
    listed: list[Change] = []
    for kind, rows in ((GAINED, detector.gained), (LOST, detector.lost)):
        for row in rows:
            frames = counted(row["frames"], "frame")
            words = f"{kind:<7} {_where(row)}, {frames}{TRUTH.get(str(row.get('status')), '')}"
            listed.append(Change(kind, row["start"], 0.0, words))
    for shift in detector.shifted:
        moved = f"begins {_moved(shift.start)}, ends {_moved(shift.end)}"
        start = min(shift.before["start"], shift.after["start"])
        largest = max(abs(shift.start), abs(shift.end))
        listed.append(Change(SHIFTED, start, largest, f"{SHIFTED:<7} {_where(shift.before)}: {moved}"))
    return sorted(listed, key=lambda change: (KINDS.index(change.kind), -change.moved, change.start))


def settings_words(found: "RunDiff") -> Iterator[str]:
    """A line per setting that differs."""
    for name, pair in found.settings.items():
        values = " -> ".join("not set" if value is None else str(value) for value in pair)
        yield f"set differently: {name.replace('.settings.', ': ')} {values}"


def diff_table(found: "RunDiff") -> Table:
    """A row per detector that both runs have."""
    verdicts = {None: "no digest", True: "the same", False: "differ"}
    rows = []
    for label, one in found.detectors.items():
        counts = (one.same, len(one.gained), len(one.lost), len(one.shifted))
        ratios = ("" if ratio is None else f"x {ratio:.2f}" for ratio in (one.time_ratio, one.p99_ratio))
        shares = (_change(one.missed), _change(one.invented))
        rows.append((label, *map(str, counts), *shares, *ratios, verdicts[one.same_verdicts]))
    head = ("detector", "same", "gained", "lost", "shifted", "missed", "false", "time", "p99", "verdicts")
    title = "contacts, and shares of pair-frames"
    return table(title, head, rows, words=("detector", "verdicts"), whole=head, notes=[_caption(found)])


def _change(shares: tuple[float | None, float | None]) -> str:
    """``2.6 -> 0.7 %``; of one that was not audited nothing."""
    if shares == (None, None):
        return ""
    before, after = ("?" if one is None else figure(100 * one) for one in shares)
    return f"{before} %" if before == after else f"{before} -> {after} %"


def _caption(found: "RunDiff") -> str:
    """What times are, and how much of them is the machine's."""
    own, note = found.machines_own, "time, p99: of the second run, as a multiple of the first's"
    if own is None:
        return note
    low, high = (f"x {one:.2f}" for one in own)
    spread = low if low == high else f"{low} to {high}"
    return f"{note}; what gave the same verdicts with the same settings took {spread}: so much is the machine's"


def _where(row: Mapping[str, Any]) -> str:
    return f"{row['body_a']} - {row['body_b']} at {row['start']:.3f} s"


def _moved(seconds: float) -> str:
    return "as before" if not round(seconds * 1e4) else f"{1e3 * seconds:+.1f} ms"
