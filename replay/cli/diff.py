"""``replay diff``: two run folders beside each other."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from replay.cli.console import People, answer
from replay.cli.options import ANY_PATH, reporting
from replay.outputs.tables import Table, table
from replay.outputs.words import counted

if TYPE_CHECKING:
    from replay.studies.diff.runs import DetectorDiff, RunDiff

MOST_ROWS = 20
"""Contacts listed of each detector; JSON holds them all."""

TRUTH: Final[Mapping[str, str]] = {
    "matched": ", confirmed by the oracle",
    "piece": ", part of one of the oracle's",
    "excused": ", undecided beside the oracle",
    "invented": ", false",
}
"""How ``status`` of an episode is said, where the run was audited."""


@click.command()
@click.argument("run_a", type=ANY_PATH, metavar="RUN_A")
@click.argument("run_b", type=ANY_PATH, metavar="RUN_B")
@click.option("--different-sessions", is_flag=True, help="Compare runs of two recordings; else they are refused.")
@reporting
def command(run_a: Path, run_b: Path, different_sessions: bool, as_json: bool, people: People) -> int:
    """Say which contacts RUN_B gained, lost or shifted beside RUN_A, what it took, and what was set differently.

    \b
    replay diff runs/before runs/after
    """
    from replay.cli.terminal import terminal
    from replay.studies.diff.runs import diff_runs

    found = diff_runs(run_a, run_b, different_sessions=different_sessions)
    plain = asdict(found) | {"changed": found.changed}
    answer(as_json, plain, lambda: terminal(*_shown(found, run_a, run_b)))
    if "machine" in {name.partition(".")[0] for name in found.settings}:
        people.say("note: the runs are of different machines; their times do not compare")
    return 0


def _shown(found: "RunDiff", run_a: Path, run_b: Path) -> Iterator[str | Table]:
    yield f"{run_b} beside {run_a}: " + ("contacts changed" if found.changed else "no contact changed")
    for name, pair in found.settings.items():
        values = " -> ".join("not set" if value is None else str(value) for value in pair)
        yield f" set differently: {name.replace('.settings.', ': ')} {values}"
    for side, labels in ((run_a, found.only_a), (run_b, found.only_b)):
        if labels:
            yield f" only in {side}: {', '.join(labels)}"
    yield _table(found)
    for label, one in found.detectors.items():
        lines = list(_lines(one))
        yield from (f" {label}: {line}" for line in lines[:MOST_ROWS])
        if len(lines) > MOST_ROWS:
            yield f" {label}: … and {len(lines) - MOST_ROWS} more with --format json"


def _table(found: "RunDiff") -> Table:
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
    from replay.pipeline.gates import figure

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


def _lines(one: "DetectorDiff") -> Iterator[str]:
    """A line per contact that was gained, lost or shifted, the largest shifts first."""
    for word, rows in (("gained", one.gained), ("lost", one.lost)):
        for row in rows:
            yield f"{word:<7} {_where(row)}, {counted(row['frames'], 'frame')}{TRUTH.get(str(row.get('status')), '')}"
    for shift in sorted(one.shifted, key=lambda each: -max(abs(each.start), abs(each.end))):
        moved = (f"{word} {_moved(by)}" for word, by in (("begins", shift.start), ("ends", shift.end)))
        yield f"shifted {_where(shift.before)}: {', '.join(moved)}"


def _where(row: Mapping[str, Any]) -> str:
    return f"{row['body_a']} - {row['body_b']} at {row['start']:.3f} s"


def _moved(seconds: float) -> str:
    return "as before" if not round(seconds * 1e4) else f"{1e3 * seconds:+.1f} ms"
