"""All sessions of a folder of runs, and the rows that the tables of the class page count, each with its session."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import pyarrow as pa
import pyarrow.compute as pc

from replay.document.columns import checked_column_names
from replay.errors import StudyError
from replay.show.results.data_set import ADDED_COLUMNS, DATA_SET, RunSet, find_runs, joined_table
from replay.show.results.parquet import COLUMN_TYPES, read_table
from replay.show.results.run_folder import SUMMARY_FILE, read_run_folder, table_file
from replay.studies.class_study.joining import check_pseudonyms, read_rows
from replay.studies.class_study.refusals import StudyRefusedError

if TYPE_CHECKING:
    from pandas import DataFrame

Row = Mapping[str, Any]

EPISODE_HEADS: Final = ("run", "detector", "body_a", "body_b", "held")

COUNTED_COLUMNS: Final[dict[str, tuple[str, ...]]] = {
    "episodes": checked_column_names("episodes", *EPISODE_HEADS, "missed_by", "task", "stage", "start", "end"),
    "misses": checked_column_names(
        "misses", *EPISODE_HEADS, "number", "episode", "kind", "cause", "cut_length", "touch", "start"
    ),
    "false_contacts": checked_column_names("false", "run", "detector", "held", "kind", "cause"),
}
"""Table -> the columns of it that the page counts: of 4,000 sessions all of them would not fit into 300 MB."""

OPEN_GUESSES: Final = "open_questions"
"""The key of a summary with the guesses of an import that change its contacts."""

SESSION_COLUMNS: Final = checked_column_names("metrics", "run", "session", "student", "oracle", "vr_type", "scene")
"""What metrics say of a session, the same in every row of it."""

DETECTOR_COLUMNS: Final = checked_column_names("metrics", "detector", "contacts_per_min", "valid_minutes", "settings")
"""What metrics say of a detector of a session."""

TITLE_COLUMNS: Final = checked_column_names("ranking", "detector", "what")
"""A detector and what it is, in words."""


@dataclass(frozen=True)
class ClassRuns:
    """The sessions of a class, each once.

    ``metrics`` are run -> detector -> row, ``every_metric`` all columns of them. ``tables`` are those of the data set:
    what a hand holds is left out, and of ``episodes`` all but the trusted detector's; every row has ``place``, the
    number of its run in ``metrics``, and ``vr_type``. ``student`` is ``""`` where nobody states one. ``repeated``
    counts runs of a session that is there already, and ``unmeasured`` those without metrics. ``titles`` are what the
    detectors of the first run are, in words.
    """

    top: Path
    metrics: dict[str, dict[str, Row]]
    every_metric: pa.Table
    tables: dict[str, pa.Table]
    repeated: int
    unmeasured: int
    titles: Mapping[str, str] = field(default_factory=dict)

    @property
    def students(self) -> list[str]:
        """All pseudonyms, sorted."""
        return sorted({self.shared_value(run, "student") for run in self.metrics} - {""})

    def shared_value(self, run: str, name: str) -> str:
        """Return a value that all rows of a run share (``SESSION_COLUMNS``), such as its ``oracle``; or ``""``."""
        return str(next(iter(self.metrics[run].values()))[name] or "")

    @property
    def audited_detectors(self) -> list[str]:
        """Detectors that are compared with a trusted one, in order of appearance."""
        rows = (
            (run, label)
            for run, rows_of_run in self.metrics.items()
            if self.shared_value(run, "oracle")
            for label in rows_of_run
        )
        return list(dict.fromkeys(label for run, label in rows if label != self.shared_value(run, "oracle")))

    def as_metrics(self) -> "DataFrame":
        """The rows of metrics for an analysis; refused as ``ids`` where one has no pseudonym."""
        metrics = self.every_metric.drop_columns(ADDED_COLUMNS).to_pandas()
        check_pseudonyms(metrics["student"].tolist(), "metrics")
        return metrics


def read_class(folder: Path, students: Path | None = None) -> ClassRuns:
    """Read the runs at or below a folder; of several runs of one session the first by path counts.

    ``students`` is a CSV as ``read_students`` takes it. Raises ``RunFolderError`` as ``replay.read`` does, and
    ``StudyRefusedError`` ``ids``: one session of two students.
    """
    run_set = find_runs(folder)
    student_by_session = read_students(students) if students is not None else {}
    table = joined_table(run_set, "metrics")
    rows = table.select([*SESSION_COLUMNS, *DETECTOR_COLUMNS]).to_pylist()
    first: dict[str, tuple[str, str]] = {}
    for row in rows:
        session = row["session"] or row["run"]
        row["student"] = student_by_session.get(session, row["student"] or "")
        if first.setdefault(session, (row["run"], row["student"]))[1] != row["student"]:
            raise StudyRefusedError("ids", f"{folder}: session {session} belongs to two students")
    metrics: dict[str, dict[str, Row]] = {run: {} for run, _ in first.values()}
    for row in rows:
        if row["run"] in metrics:
            metrics[row["run"]][row["detector"]] = row
    student_column = pa.array([row["student"] for row in rows], pa.string())
    table = table.set_column(table.column_names.index("student"), "student", student_column)
    measured_runs = {row["run"] for row in rows}
    return ClassRuns(
        folder,
        metrics,
        table.filter(pc.is_in(table["run"], pa.array(metrics, pa.string()))),
        {name: _counted_rows(run_set, name, metrics) for name in COUNTED_COLUMNS},
        repeated=len(measured_runs) - len(metrics),
        unmeasured=len(run_set.runs) - len(measured_runs),
        titles=_titles(table_file(folder / next(iter(metrics)), "ranking")) if metrics else {},
    )


def _titles(ranking: Path) -> dict[str, str]:
    """Label of a detector -> what it is, in words, from the ranking of a run; empty: the run has none."""
    if not ranking.is_file():
        return {}
    rows = read_table(ranking, TITLE_COLUMNS).to_pylist()
    return {str(label): str(title) for label, title in (row.values() for row in rows) if label and title}


def runs_with_open_guesses(runs: ClassRuns) -> list[str]:
    """Returns the runs in whose recording a guess of the import changes the contacts and nobody decided it."""
    return [run for run in runs.metrics if _has_open_guesses(runs.top / run / SUMMARY_FILE)]


def _has_open_guesses(summary: Path) -> bool:
    """Few summaries name the key, so that few of a large class are parsed."""
    data = summary.read_bytes() if summary.is_file() else b""
    return OPEN_GUESSES.encode() in data and bool(read_run_folder(summary.parent).document.open_questions)


def read_students(path: Path) -> dict[str, str]:
    """Session digest -> pseudonym; refused as ``ids``: one session of two students."""
    rows = read_rows(path)
    if not rows or not {"session", "student"} <= set(rows[0]):
        raise StudyError(f"{path.name} needs the columns session and student")
    student_by_session: dict[str, str] = {}
    for row in rows:
        session, student = (row["session"] or "").strip(), (row["student"] or "").strip()
        if student_by_session.setdefault(session, student) != student:
            raise StudyRefusedError("ids", f"{path.name}: session {session} belongs to two students")
    return student_by_session


def _counted_rows(run_set: RunSet, name: str, metrics: Mapping[str, Mapping[str, Row]]) -> pa.Table:
    """The rows of a table that count, read some hundred runs at a time."""
    sessions = [next(iter(rows.values())) for rows in metrics.values()]
    keys = "run", "oracle", "vr_type"
    runs, oracles, types = (pa.array([row[key] for row in sessions], pa.string()) for key in keys)
    names, declared_columns = COUNTED_COLUMNS[name], DATA_SET[name][1]
    no_rows = pa.schema([(column, COLUMN_TYPES[declared_columns[column].dtype]) for column in names]).empty_table()
    tables = []
    for piece in (no_rows, *run_set.pieces(name, names)):
        # A column that a run has not is null in its rows.
        rows = pa.concat_tables([no_rows, piece], promote_options="default").select(names)
        index = pc.index_in(rows["run"], runs)
        is_counted = pc.and_(pc.is_valid(index), pc.invert(pc.fill_null(rows["held"], False)))
        if name == "episodes":
            is_counted = pc.and_(is_counted, pc.equal(rows["detector"], oracles.take(index)))
        rows = rows.append_column("place", index).append_column("vr_type", types.take(index))
        tables.append(rows.filter(is_counted).drop_columns(["run", "held"]))
    return pa.concat_tables(tables)
