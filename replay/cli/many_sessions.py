"""Several sessions, a run folder each: what ``run`` does with them and says of them."""

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from replay.advice.open_guesses import open_guesses_line
from replay.cli.console import EXIT_DATA_LOSS, EXIT_OK, People, print_as_json, progress_counter, show
from replay.cli.run_report import lost_poses
from replay.document.audit import DetectorAudit
from replay.document.coding import plain_of
from replay.words import count_range
from sessions.temporary_folders import temporary_folder

if TYPE_CHECKING:
    from replay.document.gates import Gates
    from replay.document.tables import Table
    from replay.running.batch import Batch, SessionOfBatch

SESSION_ROWS: Final = 20

RARE_COUNTS: Final = ("undecided", "frames left out", "poses left out")
"""Columns that are there only where there is something to count; *undecided* adds up over the detectors."""


def run_many(
    files: Sequence[Path],
    out: Path | None,
    people: People,
    limits: "Gates",
    *,
    as_json: bool,
    as_markdown: bool,
    table_format: str,
    settings: Mapping[str, Any],
    **batch_options: Any,
) -> int:
    """Run sessions as ``run_batch`` does, ``batch_options`` it is asked; print figures over all of them; the exit code.

    ``table_format`` is the form of the tables over all sessions, in the folder ``out``.

    Without ``out`` the run folders are made where nobody looks, and are gone afterwards.
    """
    from replay.cli.run_tables import audit_table
    from replay.cli.terminal import stacked
    from replay.running.batch import run_batch
    from replay.show.results.data_set import read
    from replay.show.results.spreadsheets import PARQUET, write_tables

    def died(session_name: str, worker: str) -> None:
        people.say(f"the worker {worker} ended while it replayed {session_name}, which is run again")

    with ExitStack() as kept:
        folder = out
        if folder is None:
            folder = kept.enter_context(temporary_folder())
            settings = {**settings, "picture": False}
        report_done = progress_counter(people, len(files))
        batch = run_batch(files, folder, settings=settings, on_done=report_done, on_died=died, **batch_options)
        if table_format != PARQUET and batch.runs:
            people.say(*write_tables(read(folder), folder, table_format))
    broken_limits = limits.broken_limits(batch.audit, [(name, run.times) for name, run in batch.runs.items()])
    lost_data = bool(batch.failed) or any(run.dropped_frames or lost_poses(run.flagged) for run in batch.runs.values())
    sessions = [session_table(batch)] if batch.runs else []
    where_text = "were replayed; with --out DIR each gets a run folder" if out is None else f"are in {out}"
    lines = [f"{len(batch.done)} of {len(files)} sessions {where_text}"]
    lines += [f"failed: {name}: {why}" for name, why in batch.failed.items()]
    lines += open_guesses_line([name for name, run in batch.runs.items() if run.open_questions], len(batch.done))
    lines.append(f"digest: {batch.digest or 'none, because sessions failed'}")
    if as_markdown:
        from replay.cli.run_markdown import markdown_page

        print(markdown_page(f"{len(files)} sessions", broken_limits, lines, sessions))
    elif as_json:
        json_value = {name: getattr(batch, name) for name in ("done", "kept", "failed", "digest")}
        open_questions = {name: run.open_questions for name, run in batch.runs.items() if run.open_questions}
        json_value |= {"audit": plain_of(batch.audit), "open_questions": open_questions, "broken": broken_limits}
        print_as_json({"out": None if out is None else str(out), **json_value})
    else:
        figure_tables = [audit_table(batch.audit)] if batch.audit else []
        show(stacked(*figure_tables, *sessions))
        show(["", *lines])
    return people.gate(broken_limits, EXIT_DATA_LOSS if lost_data else EXIT_OK)


def session_table(batch: "Batch") -> "Table":
    """A row per session that is done, the one with the most missed contacts first; sums over all in the last row.

    Contacts missed are smallest to largest over the sampling offsets, as the run of each session says them.
    """
    from replay.document.tables import IN_RED, WARNING, table

    label_of_column = {f"missed by {label}": label for label in batch.audit}
    counts_of_session = {name: _session_counts(run, label_of_column) for name, run in batch.runs.items()}
    sorted_sessions = sorted(
        counts_of_session,
        key=lambda name: (-sum(counts_of_session[name][column].mean for column in label_of_column), name),
    )
    total_counts = {
        column: sum((row[column] for row in counts_of_session.values()), start=NOTHING_COUNTED)
        for column in next(iter(counts_of_session.values()))
    }
    columns = [column for column in total_counts if total_counts[column].largest or column not in RARE_COUNTS]
    rows = [
        (name, *(counts_of_session[name][column].cell for column in columns)) for name in sorted_sessions[:SESSION_ROWS]
    ]
    return table(
        "sessions, the most missed contacts first" if label_of_column else "sessions",
        ["session", *columns],
        [*rows, ("all", *(total_counts[column].cell for column in columns))],
        marks=dict.fromkeys(label_of_column, IN_RED) | dict.fromkeys(RARE_COUNTS, WARNING),
        notes=[f"… and {len(sorted_sessions) - SESSION_ROWS} more"] if len(sorted_sessions) > SESSION_ROWS else [],
    )


@dataclass(frozen=True)
class Count:
    """A count of a session: over its sampling offsets where it depends on them."""

    smallest: int
    largest: int
    mean: float

    @classmethod
    def without_offsets(cls, count: int) -> "Count":
        """A count that depends on no offset."""
        return cls(count, count, float(count))

    def __add__(self, other: "Count") -> "Count":
        return Count(self.smallest + other.smallest, self.largest + other.largest, self.mean + other.mean)

    @property
    def cell(self) -> int | str:
        """Text or number of a cell: the number, or ``0-1``."""
        return self.smallest if self.smallest == self.largest else count_range((self.smallest, self.largest))


NOTHING_COUNTED: Final = Count.without_offsets(0)


def _session_counts(run: "SessionOfBatch", label_of_column: Mapping[str, str]) -> dict[str, Count]:
    """Counts of a run for its row; the contacts are the oracle's, the same beside every detector."""
    audit = run.audit
    counts = {"frames": Count.without_offsets(run.frames)}
    if label_of_column:
        counts["contacts"] = Count.without_offsets(max((detector.contacts for detector in audit.values()), default=0))
    for name, label in label_of_column.items():
        counts[name] = _never_reported(audit[label]) if label in audit else NOTHING_COUNTED
    undecided_contacts = sum(detector.contacts_undecided for detector in audit.values())
    rare_counts = zip(RARE_COUNTS, (undecided_contacts, run.dropped_frames, lost_poses(run.flagged)), strict=True)
    return counts | {name: Count.without_offsets(count) for name, count in rare_counts}


def _never_reported(audit: DetectorAudit) -> Count:
    missed_over_offsets = audit.counts_over_offsets.contacts_missed
    return Count(missed_over_offsets.smallest, missed_over_offsets.largest, missed_over_offsets.mean)
