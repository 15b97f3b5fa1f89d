"""The differences of two runs, in numbers and words."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Final

from replay import words
from replay.document.tables import Table, columns_of
from replay.words import plural

if TYPE_CHECKING:
    from replay.document.contact import ContactRecord
    from replay.studies.diff.runs import CountBoundsPair, DetectorDiff, Fractions, RunDiff, Shift

TRUTH_CLAUSES: Final[Mapping[str, str]] = {
    "matched": ", confirmed by the reference",
    "piece": ", part of one of the reference's",
    "excused": ", undecided beside the reference",
    "invented": ", false",
}
"""How ``status`` of an episode is said, where the run was audited."""


def change_lines(detector: "DetectorDiff") -> Iterator[str]:
    """Every contact that is not the same in both runs: gained, then lost, each by time, then the largest shifts."""
    for change_kind, contacts in (("gained", detector.gained), ("lost", detector.lost)):
        for contact in sorted(contacts, key=lambda contact: contact.start):
            frames_text = plural(contact.frames, "frame")
            yield (
                f"{change_kind:<7} {_contact_text(contact)}, {frames_text}{TRUTH_CLAUSES.get(str(contact.status), '')}"
            )

    def order(shifted_contact: "Shift") -> tuple[float, float]:
        return -max(abs(shifted_contact.start), abs(shifted_contact.end)), min(
            shifted_contact.before.start, shifted_contact.after.start
        )

    for shift in sorted(detector.shifted, key=order):
        yield f"shifted {_contact_text(shift.before)}: begins {_shift_text(shift.start)}, ends {_shift_text(shift.end)}"


def settings_lines(diff: "RunDiff") -> Iterator[str]:
    """A line per setting that differs."""
    for name, values_of_runs in diff.settings.items():
        values_text = " -> ".join("not set" if value is None else str(value) for value in values_of_runs)
        yield f"set differently: {name.replace('.settings.', ': ')} {values_text}"


def _ratio_text(ratio: float | None) -> str:
    return "" if ratio is None else f"x {words.decimal(ratio, 2)}"


def _fractions_text(fractions: "Fractions") -> str:
    """``2.6 -> 0.7 %``; of one that was not audited nothing."""
    if set(fractions) == {None}:
        return ""
    text_before, text_after = ("?" if fraction is None else words.percentage(100 * fraction) for fraction in fractions)
    return f"{text_before} %" if text_before == text_after else f"{text_before} -> {text_after} %"


def _ranges_text(ranges: "CountBoundsPair") -> str:
    """``0-2 -> 0``; of one that was not audited nothing."""
    if set(ranges) == {None}:
        return ""
    text_before, text_after = ("?" if counts is None else words.count_range(counts) for counts in ranges)
    return text_before if text_before == text_after else f"{text_before} -> {text_after}"


DIGEST_LABELS: Final = {None: "no digest", True: "the same", False: "differ"}

DIFFERENCE_COLUMNS: Final = columns_of(
    "studies/diff/differences.toml",
    {
        "count": len,
        "range_change": _ranges_text,
        "change": _fractions_text,
        "times": _ratio_text,
        "verdicts": DIGEST_LABELS.get,
    },
)["differences"]
"""Columns of pairs of a label and what its detector changed."""


def diff_table(diff: "RunDiff") -> Table:
    """A row per detector that both runs have."""
    title = "contacts, and the share of false contact"
    note = "time, p99: second run / first run. With the same verdicts a difference is noise of the machine."
    return Table.of(DIFFERENCE_COLUMNS, diff.detectors.items(), title, [note])


def _contact_text(contact: "ContactRecord") -> str:
    return f"{contact.body_a} - {contact.body_b} at {words.timestamp(contact.start)} s"


def _shift_text(seconds: float) -> str:
    return "as before" if not round(seconds * 1e4) else f"{words.decimal(1e3 * seconds, 1, signed=True)} ms"
