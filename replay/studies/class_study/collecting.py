"""Metrics of many runs as one table: every row has a pseudonym, and no session is in it twice."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import pyarrow as pa
import pyarrow.parquet as pq

from replay.errors import OutputError, RunFolderError, StudyError
from replay.metrics.row import METRICS as METRIC_COLUMNS
from replay.outputs.results.parquet import UNREADABLE, read_table
from replay.outputs.results.reading import checked_table
from replay.outputs.results.run_folder import METRICS
from replay.studies.class_study.joining import check_pseudonyms, read_rows
from replay.studies.class_study.refusals import StudyRefusedError
from sessions.whole_files import check_free, whole_file

KEY: Final = ("session", "detector", "settings")
ORDER: Final = [("student", "ascending"), ("session", "ascending"), ("detector", "ascending")]


def collect(runs: Sequence[Path], students: Path | None = None) -> pa.Table:
    """Join the metrics of run folders, or of folders of run folders.

    ``students`` is a CSV with the columns ``session`` (its digest, as metrics have it) and ``student``, for recordings
    that carry no pseudonym. Raises ``RunFolderError``: a folder holds no metrics; ``StudyRefusedError`` ``ids``: a row
    without a pseudonym, or one session of two students; ``StudyError``: the file of students cannot be read.
    """
    files = [file for run in runs for file in metric_files(run)]
    if not files:
        raise RunFolderError("no runs to collect; make them with `replay run`")
    needed = frozenset((*KEY, "student"))
    parts = [checked_table(file, read_table(file), METRIC_COLUMNS, needed) for file in files]
    try:
        table = pa.concat_tables(parts, promote_options="default")
    except UNREADABLE as error:
        raise RunFolderError(f"the metrics are not of one kind ({error}); run the sessions again") from error
    if students is not None:
        named = read_students(students)
        own = zip(table["session"].to_pylist(), table["student"].to_pylist(), strict=True)
        column = pa.array([named.get(session, student) for session, student in own], pa.string())
        table = table.set_column(table.column_names.index("student"), "student", column)
    check_pseudonyms([student or "" for student in table["student"].to_pylist()], "metrics")
    return _without_repeats(table).sort_by(ORDER)


def metric_files(run: Path) -> list[Path]:
    """The table of a run folder, or those of the run folders in it by name; ``RunFolderError`` where there is none."""
    if (run / METRICS).is_file():
        return [run / METRICS]
    found = sorted(file for file in run.glob(f"*/{METRICS}") if not file.parent.name.startswith("."))
    if not found:
        raise RunFolderError(f"{run} holds no {METRICS} and no run folders that do; run its sessions again")
    return found


def write_table(table: pa.Table, out: Path, *, force: bool = False) -> Path:
    """Write a table under its name when it is whole; ``OutputError``: the file exists or cannot be written."""
    check_free(out, OutputError, force=force)
    with whole_file(out, OutputError, overwrite=force, parents=True) as file:
        pq.write_table(table, file, compression="zstd")
    return out


def read_students(path: Path) -> dict[str, str]:
    """Session digest -> pseudonym; refused as ``ids``: one session of two students."""
    rows = read_rows(path)
    if not rows or not {"session", "student"} <= set(rows[0]):
        raise StudyError(f"{path.name} needs the columns session and student")
    named: dict[str, str] = {}
    for row in rows:
        session, student = (row["session"] or "").strip(), (row["student"] or "").strip()
        if named.setdefault(session, student) != student:
            raise StudyRefusedError("ids", f"{path.name}: session {session} belongs to two students")
    return named


def _without_repeats(table: pa.Table) -> pa.Table:
    """One row per session, detector and settings; a run that was collected twice counts once."""
    first: dict[tuple[str, ...], int] = {}
    students = table["student"].to_pylist()
    for row, key in enumerate(zip(*(table[name].to_pylist() for name in KEY), strict=True)):
        if students[first.setdefault(key, row)] != students[row]:
            raise StudyRefusedError("ids", f"metrics: session {key[0]} belongs to two students")
    return table.take(pa.array(first.values(), pa.int64()))
