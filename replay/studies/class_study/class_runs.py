"""All sessions of a folder of runs as rows that know their student: what the tables of the class page count."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import compress
from pathlib import Path
from typing import Any, Final

from replay.errors import StudyError
from replay.outputs.results.data_set import ADDED, find_runs, joined
from replay.studies.class_study.joining import Metrics, check_pseudonyms, read_rows
from replay.studies.class_study.refusals import StudyRefusedError

Row = Mapping[str, Any]

HEADS: Final = ("run", "detector", "body_a", "body_b", "held")

NEEDED: Final[dict[str, tuple[str, ...]]] = {
    "episodes": (*HEADS, "missed_by", "task", "stage"),
    "misses": (*HEADS, "number", "kind", "cause", "cut_length", "touch", "start"),
    "false_contacts": ("run", "detector", "held", "kind", "cause"),
}
"""Table -> the columns of it that the page needs: of 4,000 sessions all of them would not fit into 300 MB."""


class Record(Mapping[str, Any]):
    """A row of a table that is kept by columns; it takes a tenth of the memory of a dictionary."""

    __slots__ = ("_columns", "_place")

    def __init__(self, columns: Mapping[str, list[Any]], place: int) -> None:
        self._columns, self._place = columns, place

    def __getitem__(self, name: str) -> Any:
        return self._columns[name][self._place]

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)


@dataclass(frozen=True)
class ClassRuns:
    """The sessions of a class, each once.

    ``metrics`` are run -> detector -> row. ``tables`` are rows by table of the data set: what a hand holds is left
    out, and of ``episodes`` all but the trusted detector's. Every row has ``student``, ``""`` where nobody states one,
    and ``vr_type``. ``repeated`` counts runs of a session that is there already, and ``unmeasured`` those without
    metrics.
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
        names = dict.fromkeys(name for row in rows for name in row if name not in ADDED)
        return Metrics({name: [row.get(name) for row in rows] for name in names})


def read_class(folder: Path, students: Path | None = None) -> ClassRuns:
    """Read the runs at or below a folder; of several runs of one session the first by path counts.

    ``students`` is a CSV as ``read_students`` takes it. Raises ``RunFolderError`` as ``replay.read`` does, and
    ``StudyRefusedError`` ``ids``: one session of two students.
    """
    found = find_runs(folder)
    named = read_students(students) if students is not None else {}
    every: dict[str, dict[str, Row]] = {}
    first: dict[str, tuple[str, str]] = {}
    metrics = joined(found, "metrics")
    columns = {name: _values(metrics, name) for name in metrics.column_names}
    sessions = [session or run for session, run in zip(columns["session"], columns["run"], strict=True)]
    own = zip(sessions, columns["student"], strict=True)
    columns["student"] = [named.get(session, student or "") for session, student in own]
    for row in (Record(columns, place) for place in range(len(metrics))):
        session = row["session"] or row["run"]
        if first.setdefault(session, (row["run"], row["student"]))[1] != row["student"]:
            raise StudyRefusedError("ids", f"{folder}: session {session} belongs to two students")
        every.setdefault(row["run"], {})[row["detector"]] = row
    kept = {run: every[run] for run, _ in first.values()}
    made = ClassRuns(folder, kept, {}, len(every) - len(kept), len(found.runs) - len(every))
    return replace(made, tables={name: _rows(made, name, found.pieces(name, NEEDED[name])) for name in NEEDED})


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


def _rows(made: ClassRuns, name: str, pieces: Iterable[Any]) -> list[Row]:
    """The rows of a table, read some hundred runs at a time; every one knows its student."""
    about = {run: (made.of(run, "student"), made.of(run, "vr_type"), made.of(run, "oracle")) for run in made.metrics}
    rows: list[Row] = []
    for piece in pieces:
        columns = {column: _values(piece, column) for column in NEEDED[name]}
        held = columns.pop("held")
        counted = [run in about and not is_held for run, is_held in zip(columns["run"], held, strict=True)]
        if name == "episodes":
            labels = zip(columns["run"], columns["detector"], strict=True)
            counted = [there and label == about[run][2] for there, (run, label) in zip(counted, labels, strict=True)]
        columns = {column: list(compress(values, counted)) for column, values in columns.items()}
        columns["student"] = [about[run][0] for run in columns["run"]]
        columns["vr_type"] = [about[run][1] for run in columns["run"]]
        rows += [Record(columns, place) for place in range(len(columns["run"]))]
    return rows


def _values(piece: Any, column: str) -> list[Any]:
    """The values of a column; equal words are one object."""
    if column not in piece.column_names:
        return [None] * len(piece)
    values = piece[column].combine_chunks()
    if values.type != "string":
        return values.to_pylist()
    coded = values.dictionary_encode()
    words = [*coded.dictionary.to_pylist(), None]  # -1, no word, is the last
    return [words[code] for code in coded.indices.fill_null(-1).to_pylist()]


def missed_by(contact: Row, label: str) -> bool:
    """Whether a detector never finds a contact; ``""``: whether any does not."""
    return bool(contact["missed_by"]) if not label else label in (contact["missed_by"] or "").split(",")


def grouped(rows: Iterable[Row], *names: str) -> dict[tuple[Any, ...], list[Row]]:
    """Values of some columns -> their rows, those of most rows first."""
    found: dict[tuple[Any, ...], list[Row]] = {}
    for row in rows:
        found.setdefault(tuple(row[name] for name in names), []).append(row)
    return dict(sorted(found.items(), key=lambda item: (-len(item[1]), [str(value) for value in item[0]])))
