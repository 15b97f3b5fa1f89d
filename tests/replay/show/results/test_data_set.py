"""Many runs as one data set: every row says whose it is, and the guide's questions give what a recount gives."""

import io
import re
import threading
from collections import Counter
from dataclasses import replace
from statistics import mean
from typing import ClassVar

import duckdb
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from support.small_worlds import STEP_NS, unit_cubes_on_x

from replay import read
from replay.document.metrics.row import metric_rows
from replay.engine import compute
from replay.errors import RunFolderError
from replay.guide.pages import page
from replay.prepare.flags import Flags
from replay.show.results.parquet import SCHEMA, read_table
from replay.show.results.run_folder import write_run_folder
from sessions import Event, Interval

NOTES = re.search(r"## Notes of your own.*?```csv\n(.*?)```.*?```sql\n(.*?)^```$", page("many-sessions"), re.M | re.S)
QUESTIONS = re.findall(r"^\d+\. ([^\n]+\?)\n\n```sql\n(.*?)^```$", page("many-sessions"), re.MULTILINE | re.DOTALL)

STUDENTS = {"one": "S1", "two": "S1", "three": "S2", "four": ""}
POSITIONS = {
    "one": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3],
    "two": [3, 0.9, 3, 3, 0.7, 0.7, 3, 0.9, 0.9, 1.2, 1.2, 2],
    "three": [0.9, 0.9, 0.9, 3, 3, 0.8, 3, 3, 3, 3, 0.9, 4],
    "four": [3, 3, 1.3, 1.3, 3, 3, 0.9, 0.8, 0.9, 0.8, 3, 5],
}
SPANS = (("task", "stir", 1, 7), ("task", "pour", 5, 9), ("stage", "first", 0, 4), ("stage", "second", 4, 8))
"""Kind, name, first and last frame: the second task begins before the first ends; the last frames have neither."""
BUTTONS = {"one": (1, 6), "two": (6, 11), "three": (5,), "four": (3,)}


def session_named(name):
    """One of four made-up sessions."""
    events = [Event(frame * STEP_NS, "press", "trigger", "b") for frame in BUTTONS[name]]
    spans = [Interval(first * STEP_NS, last * STEP_NS, kind, word) for kind, word, first, last in SPANS]
    positions = {"a": [0] * 12, "b": POSITIONS[name], "c": [9] * 3 + [3.9 if name == "three" else 9] + [9] * 8}
    facts = {"pseudonym": STUDENTS[name]} if STUDENTS[name] else {}
    return unit_cubes_on_x(positions, events=events, intervals=[] if name == "four" else spans, facts=facts)


def run_of(name):
    """A run over the session of this name."""
    # These cubes step metres in 10 ms: each such frame would be flagged as a teleport.
    result = compute(session_named(name), detectors="slow=discrete[rate_hz=20],sphere", oracle="exact")
    return replace(result, flags=Flags(np.zeros_like(result.flags.bodies)))


@pytest.fixture(scope="module")
def result_by_name():
    """Results of runs by name of their session."""
    return {name: run_of(name) for name in POSITIONS}


@pytest.fixture(scope="module")
def data_set_folder(result_by_name, tmp_path_factory):
    """Run folders by student and name."""
    top = tmp_path_factory.mktemp("runs")
    for name, result in result_by_name.items():
        write_run_folder(result, top / f"student={STUDENTS[name]}" / name)
    return top


@pytest.fixture(scope="module")
def tables(data_set_folder):
    return read(data_set_folder)


def action(name, kind, frame):
    """The span at a frame, from what was planted: none in the session ``four``."""
    existing = [(first, word) for item, word, first, last in SPANS if item == kind and first <= frame <= last]
    return max(existing)[1] if existing and name != "four" else None


def faults(results, kind):
    """Name, detector and fault, over all runs."""
    return [
        (name, label, item) for name, r in results.items() for label, some in getattr(r, kind).items() for item in some
    ]


def bodies(result, pair):
    """Names of both bodies of a pair."""
    return tuple(result.assembly.names[end] for end in result.assembly.pairs[pair].tolist())


def run_path(name):
    """The folder of a run in the data set."""
    return f"student={STUDENTS[name]}/{name}"


def grouped(pairs):
    """Key -> its values, in order of keys; no key comes last, as ``NULLS LAST`` has it."""
    result = {}
    for key, value in pairs:
        result.setdefault(key, []).append(value)
    return dict(sorted(result.items(), key=lambda item: (item[0] is None, item[0] or "")))


def ranked(counts, *more):
    """Keys by falling count, then in order."""
    return [(*key, n, *(item[key] for item in more)) for key, n in sorted(counts.items(), key=lambda i: (-i[1], i[0]))]


def pairs_missed(results):
    """Detector and bodies, how often they were missed, and in how many runs."""
    result = [((label, *bodies(results[name], item.pair)), name) for name, label, item in faults(results, "misses")]
    return ranked(Counter(key for key, _ in result), {key: len(set(names)) for key, names in grouped(result).items()})


def minutes(results):
    """Name -> detector -> contacts per minute."""
    return {name: {row["detector"]: row["contacts_per_min"] for row in metric_rows(r)} for name, r in results.items()}


def more_contacts(results):
    """Detector -> runs, and by how many contacts per minute it differs from the reference in their mean."""
    per_minute = minutes(results).values()
    more = grouped((label, some[label] - some["exact"]) for some in per_minute for label in some if label != "exact")
    return [(label, len(values), mean(values)) for label, values in more.items()]


RECOUNTS = {0: pairs_missed, 1: more_contacts}


@pytest.mark.slow
@pytest.mark.parametrize("number", range(len(QUESTIONS)))
def test_sql_questions_of_the_guide_agree_with_a_recount(number, result_by_name, tables):
    """The recount reads the results in Python, without tables."""
    db = duckdb.connect()
    for name, table in tables.items():
        db.register(name, table)
    reported = db.sql(QUESTIONS[number][1]).fetchall()
    assert len(reported) > 1
    counted = RECOUNTS[number](result_by_name)
    assert reported == [
        tuple(pytest.approx(v, abs=1e-12) if isinstance(v, float) else v for v in row) for row in counted
    ]


@pytest.mark.slow
def test_note_joins_its_contact_across_detectors(tmp_path):
    """The note is on the second contact: miss 2 at 20 Hz, miss 1 at 34 Hz, and reported at 100 Hz."""
    # Contacts in frame 3 and in 7-8. Every fifth frame shows neither, every third the first, every frame both.
    recorded = unit_cubes_on_x({"a": [0] * 12, "b": [3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.9, 3, 3, 3]})
    for rate in (20, 34, 100):
        result = compute(recorded, detectors=f"slow=discrete[rate_hz={rate},sampling_offset_s=0]", oracle="exact")
        write_run_folder(result, tmp_path / f"{rate:03d}")
    tables = read(tmp_path)
    miss = next(row for row in tables["misses"].to_pylist() if row["run"] == "020" and row["first"] == 7)
    head, example = (line.split(",") for line in NOTES[1].splitlines())
    values = [miss["session"], miss["body_a"], miss["body_b"], "0.08", *example[4:]]
    (tmp_path / "notes.csv").write_text(f"{','.join(head)}\n{','.join(values)}\n", "utf-8")
    db = duckdb.connect()
    for name, table in tables.items():
        db.register(name, table)
    db.read_csv(str(tmp_path / "notes.csv")).create("notes")
    note, tag = "hand went through the wall", "real"
    assert db.sql(NOTES[2]).fetchall() == [
        (note, tag, "020", "slow", 2),
        (note, tag, "034", "slow", 1),
        (note, tag, "100", None, None),
    ]


def test_rows_of_the_data_set_name_run_student_and_task(tables, result_by_name):
    """A row of metrics is of a whole run and so of both tasks; the run "four" has none."""
    digests = {}
    for kind, table in tables.items():
        assert table.num_rows and "student=S1" not in table.column_names, kind
        for row in table.to_pylist():
            name = row["run"].rpartition("/")[2]
            assert row["run"] == run_path(name) and row["student"] == STUDENTS[name]
            assert digests.setdefault(name, row["session"]) == row["session"]
            frame = row["stamp_ns"] // STEP_NS if kind == "events" else row.get("first")
            for span in ("task", "stage"):
                every = None if name == "four" else {"task": "stir + pour", "stage": "first + second"}[span]
                assert row[span] == (every if kind == "metrics" else action(name, span, frame)), row
    assert len(set(digests.values())) == len(POSITIONS) and all(
        re.fullmatch("[0-9a-f]{16}", d) for d in digests.values()
    )


def test_newer_tables_are_refused_and_broken_tables_named(result_by_name, tmp_path):
    """One table of a run is given a newer schema, then a column of text for stamps, then a byte that is no table."""
    file = write_run_folder(result_by_name["one"], tmp_path / "one") / "events.parquet"
    newer = SCHEMA.replace("2", "3")
    pq.write_table(pq.read_table(file).replace_schema_metadata({"schema": newer}), file)
    with pytest.raises(RunFolderError, match=rf"events.parquet has schema '{newer}', this version reads up to"):
        read(tmp_path)
    events = pq.read_table(file).replace_schema_metadata({"schema": SCHEMA})
    noon = pa.array(["noon"] * len(events))
    pq.write_table(events.set_column(events.column_names.index("stamp_ns"), "stamp_ns", noon), file)
    with pytest.raises(RunFolderError, match=r"one/events.parquet: the column 'stamp_ns' is string, not int64"):
        read(tmp_path)
    file.write_bytes(b"x")
    with pytest.raises(RunFolderError, match=r"one/events.parquet is damaged; run its session again$"):
        read(str(tmp_path))


@pytest.mark.parametrize(("stated", "offline"), [({"vr_type": "desktop"}, False), ({}, True)])
def test_metrics_hold_reference_vr_type_and_summary_times(stated, offline, tmp_path):
    """Times are milliseconds in the table and seconds in the document; offline no detector is timed frame by frame."""
    recorded = replace(session_named("one"), facts=stated)
    result = compute(recorded, detectors="slow=discrete[rate_hz=20]", oracle="exact", offline=offline)
    write_run_folder(result, tmp_path / "one")
    metrics = read(tmp_path)["metrics"]
    assert set(metrics["oracle"].to_pylist()) == {"exact"}
    assert set(metrics["vr_type"].to_pylist()) == {stated.get("vr_type")}
    for row in metrics.to_pylist():
        taken = result.document.detectors[row["detector"]].seconds
        slowest = taken.sample_times and taken.sample_times.max
        reported = [row[name] and row[name] / 1e3 for name in ("mean_ms", "p99_ms", "worst_ms")]
        assert reported == pytest.approx([taken.per_frame_mean, taken.p99, slowest])
    assert any(metrics["p99_ms"].to_pylist()) != offline


def test_single_run_folder_is_read_as_a_data_set(result_by_name, tmp_path, monkeypatch):
    """A folder that is still being written (.partial) is no run."""
    with pytest.raises(RunFolderError, match="holds no run folders"):
        read(tmp_path)
    out = write_run_folder(result_by_name["one"], tmp_path / ".one.partial")
    with pytest.raises(RunFolderError, match="holds no run folders"):
        read(tmp_path)
    assert set(read(out)["metrics"]["run"].to_pylist()) == {"."}
    monkeypatch.setattr("replay.show.results.parquet.MOST_ROWS_PER_BYTE", 0.001)
    with pytest.raises(RunFolderError, match="rows that it does not hold"):
        read(out)


class Watched(io.BytesIO):
    """A file, and the path of one, that notes which threads read it."""

    readers: ClassVar[set[int]] = set()

    def open(self, mode):
        return self

    def is_file(self):
        return True

    def read(self, *size):
        self.readers.add(threading.get_ident())
        return super().read(*size)


def test_tables_are_read_only_in_the_calling_thread():
    """A reading thread of Arrow's could still hold a Python file when the interpreter ends, and abort the program."""
    whole = io.BytesIO()
    pq.write_table(pa.table({f"column {k}": [1.0, 2.0] for k in range(20)}), whole)
    assert read_table(Watched(whole.getvalue())).num_columns == 20
    assert Watched.readers == {threading.get_ident()}
