"""What two runs differ in, in numbers and words: the same in terminal and picture."""

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
    "matched": ", confirmed by the oracle",
    "piece": ", part of one of the oracle's",
    "excused": ", undecided beside the oracle",
    "invented": ", false",
}
"""How ``status`` of an episode is said, where the run was audited."""


@dataclass(frozen=True)
class Change:
    """One contact that a detector gained, lost or shifted.

    ``number`` counts from 1 in order of time, over all kinds, within a detector; ``start`` and ``end`` are seconds of
    it in both runs; ``moved`` is by how many seconds an end of it moved.
    """

    number: int
    kind: str
    start: float
    end: float
    body_a: str
    body_b: str
    moved: float
    words: str


def changes(one: "DetectorDiff") -> tuple[Change, ...]:
    """Every contact of a detector that is not the same in both runs, in order of time."""
    found: list[tuple[str, Mapping[str, Any], float, float, float, str]] = []
    for kind, rows in ((GAINED, one.gained), (LOST, one.lost)):
        for row in rows:
            words = f"{counted(row['frames'], 'frame')}{TRUTH.get(str(row.get('status')), '')}"
            found.append((kind, row, row["start"], row["end"], 0.0, f"{_where(row)}, {words}"))
    for shift in one.shifted:
        moved = ", ".join(f"{word} {_moved(by)}" for word, by in (("begins", shift.start), ("ends", shift.end)))
        ends = (*(run[name] for run in (shift.before, shift.after) for name in ("start", "end")),)
        by = max(abs(shift.start), abs(shift.end))
        found.append((SHIFTED, shift.before, min(ends), max(ends), by, f"{_where(shift.before)}: {moved}"))
    found.sort(key=lambda each: (each[2], each[3], each[0]))
    return tuple(
        Change(number, kind, start, end, row["body_a"], row["body_b"], by, f"{kind:<7} {words}")
        for number, (kind, row, start, end, by, words) in enumerate(found, 1)
    )


def most_first(found: tuple[Change, ...]) -> list[Change]:
    """What was gained, then what was lost, each in order of time, then the largest shifts."""
    return sorted(found, key=lambda one: (KINDS.index(one.kind), -one.moved, one.number))


def headline(found: "RunDiff") -> str:
    """What changed most, fit for a title."""
    if not found.changed:
        return "No contact changed"
    label, one = max(found.detectors.items(), key=lambda item: len(changes(item[1])))
    counts = ((GAINED, one.gained), (LOST, one.lost), (SHIFTED, one.shifted))
    told = [f"{counted(len(rows), 'contact')} {kind}" for kind, rows in counts if rows]
    return f"{label}: {', '.join(told)}; {one.same} the same"


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
