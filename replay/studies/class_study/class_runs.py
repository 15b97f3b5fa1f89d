"""All sessions of a folder of runs as rows that know their student: what the tables of the class page count."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from replay.outputs.results.data_set import read, run_folders
from replay.studies.class_study.collecting import read_students
from replay.studies.class_study.joining import Metrics, check_pseudonyms
from replay.studies.class_study.refusals import StudyRefusedError

Row = Mapping[str, Any]

NEEDED: Final = frozenset((
    "run", "detector", "number", "body_a", "body_b", "held", "start", "end", "missed_by", "flag", "kind", "cause",
    "cut_length", "touch", "source", "name", "task", "stage",
))  # fmt: skip
"""Columns of the data set that the page needs."""


@dataclass(frozen=True)
class ClassRuns:
    """The sessions of a class, each once.

    ``metrics`` are run -> detector -> row. ``tables`` are rows by table of the data set: what a hand holds is left out,
    and of ``episodes`` all but the trusted detector's. Every row has ``student``, ``""`` where nobody states one.
    ``repeated`` counts runs of a session that is there already, and ``unmeasured`` those without metrics.
    """

    top: Path
    metrics: dict[str, dict[str, Row]]
    tables: dict[str, list[Row]]
    repeated: int
    unmeasured: int

    @property
    def students(self) -> list[str]:
        """All pseudonyms, sorted."""
        return sorted({self.of(run, "student") for run in self.metrics} - {""})

    def of(self, run: str, name: str) -> str:
        """What all rows of a run say: its ``student``, ``oracle`` (the trusted detector) or ``vr_type``; or ``""``."""
        return str(next(iter(self.metrics[run].values()))[name] or "")

    @property
    def audited(self) -> list[str]:
        """Detectors that are compared with a trusted one, in order of appearance."""
        rows = ((run, label) for run, found in self.metrics.items() if self.of(run, "oracle") for label in found)
        return list(dict.fromkeys(label for run, label in rows if label != self.of(run, "oracle")))

    def as_metrics(self) -> Metrics:
        """The rows of metrics for an analysis; refused as ``ids`` where one has no pseudonym."""
        rows = [row for found in self.metrics.values() for row in found.values()]
        check_pseudonyms([row["student"] for row in rows], "metrics")
        names = dict.fromkeys(name for row in rows for name in row if name not in ("oracle", "vr_type", "run"))
        return Metrics({name: [row.get(name) for row in rows] for name in names})


def read_class(folder: Path, students: Path | None = None) -> ClassRuns:
    """Read the runs at or below a folder; of several runs of one session the first by path counts.

    ``students`` is a CSV as ``collect`` takes it. Raises ``RunFolderError`` as ``replay.read`` does, and
    ``StudyRefusedError`` ``ids``: one session of two students.
    """
    tables = read(folder)
    named = read_students(students) if students is not None else {}
    every: dict[str, dict[str, Row]] = {}
    first: dict[str, tuple[str, str]] = {}
    for row in tables["metrics"].to_pylist():
        session = row["session"] or row["run"]
        student = named.get(session, row["student"] or "")
        if first.setdefault(session, (row["run"], student))[1] != student:
            raise StudyRefusedError("ids", f"{folder}: session {session} belongs to two students")
        every.setdefault(row["run"], {})[row["detector"]] = row | {"student": student}
    kept = {run: every[run] for run, _ in first.values()}
    made = ClassRuns(folder, kept, {}, len(every) - len(kept), len(run_folders(folder)) - len(every))
    rows = {name: list(_rows(made, table)) for name, table in tables.items() if name != "metrics"}
    rows["episodes"] = [row for row in rows["episodes"] if row["detector"] == made.of(row["run"], "oracle")]
    return replace(made, tables=rows)


def _rows(made: ClassRuns, table: Any) -> Iterable[Row]:
    for row in table.select([name for name in table.column_names if name in NEEDED]).to_pylist():
        if row["run"] in made.metrics and not row.get("held"):
            yield row | {"student": made.of(row["run"], "student")}


def missed_by(contact: Row, label: str) -> bool:
    """Whether a detector never finds a contact; ``""``: whether any does not."""
    return bool(contact["missed_by"]) if not label else label in (contact["missed_by"] or "").split(",")


def grouped(rows: Iterable[Row], *names: str) -> dict[tuple[Any, ...], list[Row]]:
    """Values of some columns -> their rows, those of most rows first."""
    found: dict[tuple[Any, ...], list[Row]] = {}
    for row in rows:
        found.setdefault(tuple(row[name] for name in names), []).append(row)
    return dict(sorted(found.items(), key=lambda item: (-len(item[1]), [str(one) for one in item[0]])))
