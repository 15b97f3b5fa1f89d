"""Many runs as one data set: every row says whose it is, and the guide's questions give what a recount gives."""

import io
import re
import shutil
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
from replay.show.results.data_set import DATA_SET
from replay.show.results.parquet import SCHEMA, read_table
from replay.show.results.run_folder import write_run_folder
from sessions import Event, Interval

NOTES = re.search(r"## Notes of your own.*?```csv\n(.*?)```.*?```sql\n(.*?)^```$", page("many-sessions"), re.M | re.S)
NOTES_CSV, NOTES_QUERY = NOTES.groups()
"""An example of a file of notes, and the SQL that joins it, of the guide's page *many-sessions*."""
QUESTIONS = dict(
    re.findall(r"^\d+\. ([^\n]+\?)\n\n```sql\n(.*?)^```$", page("many-sessions"), re.MULTILINE | re.DOTALL)
)
"""Question -> the SQL that answers it, of the same page."""

STUDENTS = {"one": "S1", "two": "S1", "three": "S2", "four": ""}
"""Session -> its student."""
POSITIONS = {
    "one": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3],
    "two": [3, 0.9, 3, 3, 0.7, 0.7, 3, 0.9, 0.9, 1.2, 1.2, 2],
    "three": [0.9, 0.9, 0.9, 3, 3, 0.8, 3, 3, 3, 3, 0.9, 4],
    "four": [3, 3, 1.3, 1.3, 3, 3, 0.9, 0.8, 0.9, 0.8, 3, 5],
}
SPANS = (("task", "stir", 1, 7), ("task", "pour", 5, 9), ("stage", "first", 0, 4), ("stage", "second", 4, 8))
"""Kind, name, first and last frame: the second task begins before the first ends; the last frames have neither."""
BUTTONS = {"one": (1, 6), "two": (6, 11), "three": (5,), "four": (3,)}
"""Session -> frames in which a button is pressed."""


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
    """Tables over four runs of three students, as ``replay.read`` gives them."""
    return read(data_set_folder)


def span_at(kind, name, frame):
    """The name of the task or stage (``kind``) at a frame of a session, as planted; None in the session "four"."""
    spans = [(first, word) for item, word, first, last in SPANS if item == kind and first <= frame <= last]
    return max(spans)[1] if spans and name != "four" else None


def missed_contacts(results):
    """Session, detector and miss, over all runs."""
    return [
        (name, label, miss)
        for name, result in results.items()
        for label, misses in result.misses.items()
        for miss in misses
    ]


def bodies(result, pair):
    """Names of both bodies of a pair."""
    return tuple(result.assembly.names[end] for end in result.assembly.pairs[pair].tolist())


def run_path(name):
    """The folder of a run in the data set."""
    return f"student={STUDENTS[name]}/{name}"


def pairs_missed_most(results):
    """Detector and both bodies, number of misses and of sessions with any; most misses first, then by name."""
    counts, sessions = Counter(), {}
    for name, label, miss in missed_contacts(results):
        key = (label, *bodies(results[name], miss.pair))
        counts[key] += 1
        sessions.setdefault(key, set()).add(name)
    by_falling_count = sorted(counts.items(), key=lambda item: (-item[1], item[0]))
    return [(*key, count, len(sessions[key])) for key, count in by_falling_count]


def more_contacts_per_minute(results):
    """Detector, number of runs, and by how many contacts a minute it differs from the reference in their mean."""
    differences = {}
    for result in results.values():
        per_minute = {row["detector"]: row["contacts_per_min"] for row in metric_rows(result)}
        for label, value in per_minute.items():
            if label != "exact":
                differences.setdefault(label, []).append(value - per_minute["exact"])
    return [(label, len(values), mean(values)) for label, values in sorted(differences.items())]


RECOUNTS = {
    "Which pairs are missed most?": pairs_missed_most,
    "How much does a detector change the number of contacts per minute?": more_contacts_per_minute,
}


def database_of(tables):
    """A DuckDB database with these tables by name."""
    database = duckdb.connect()
    for name, table in tables.items():
        database.register(name, table)
    return database


def test_every_question_of_the_guide_is_recounted():
    """The page *many-sessions* of the guide has questions in SQL; each is answered by a recount in Python here."""
    assert QUESTIONS.keys() == RECOUNTS.keys()


@pytest.mark.slow
@pytest.mark.parametrize("question", RECOUNTS)
def test_sql_questions_of_the_guide_agree_with_a_recount(question, result_by_name, tables):
    """The SQL of the guide reads the tables of four runs, the recount their results in memory, in plain Python.

    Both give rows in the same order.
    """
    answered = database_of(tables).sql(QUESTIONS[question]).fetchall()
    recounted = RECOUNTS[question](result_by_name)
    assert len(recounted) > 1
    assert answered == [
        tuple(pytest.approx(value, abs=1e-12) if isinstance(value, float) else value for value in row)
        for row in recounted
    ]


@pytest.mark.slow
def test_note_joins_its_contact_across_detectors(tmp_path):
    """Two contacts, in frame 3 and in frames 7 and 8 of 10 ms, and three runs; a note of a user is on the second.

    At 20 Hz every fifth frame is sampled, which misses both contacts (the second is miss 2); at 34 Hz every third,
    which misses only the second (miss 1); at 100 Hz every frame: no miss. The guide's SQL joins the note in all three.
    """
    recorded = unit_cubes_on_x({"a": [0] * 12, "b": [3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.9, 3, 3, 3]})
    for rate_hz in (20, 34, 100):
        result = compute(recorded, detectors=f"slow=discrete[rate_hz={rate_hz},sampling_offset_s=0]", oracle="exact")
        write_run_folder(result, tmp_path / f"{rate_hz:03d}")
    tables = read(tmp_path)
    (miss,) = [row for row in tables["misses"].to_pylist() if row["run"] == "020" and row["first"] == 7]
    head, example = (line.split(",") for line in NOTES_CSV.splitlines())
    second_of_contact = "0.08"
    note = dict(zip(head, example, strict=True)) | {
        "session": miss["session"],
        "body_a": miss["body_a"],
        "body_b": miss["body_b"],
        "at": second_of_contact,
    }
    (tmp_path / "notes.csv").write_text(f"{','.join(note)}\n{','.join(note.values())}\n", "utf-8")
    database = database_of(tables)
    database.read_csv(str(tmp_path / "notes.csv")).create("notes")
    text, tag = note["note"], note["tag"]
    assert database.sql(NOTES_QUERY).fetchall() == [
        (text, tag, "020", "slow", 2),
        (text, tag, "034", "slow", 1),
        (text, tag, "100", None, None),
    ]


def test_rows_of_the_data_set_name_run_and_student(tables):
    """Folders are called like "student=S1/one"; each row of each table has that path and the student, "" for none.

    Of the name of the folder no column is made.
    """
    assert tables.keys() == DATA_SET.keys()
    for name, table in tables.items():
        assert table.num_rows > 0, name
        assert "student=S1" not in table.column_names, name
        for row in table.to_pylist():
            session = row["run"].rpartition("/")[2]
            assert row["run"] == run_path(session), name
            assert row["student"] == STUDENTS[session], name


def test_session_digest_of_a_run_is_equal_in_all_tables(tables):
    """Every row names its session by a digest, 16 hexadecimal digits over its poses; four sessions have four."""
    digests = {}
    for table in tables.values():
        for row in table.to_pylist():
            digests.setdefault(row["run"], set()).add(row["session"])
    assert [len(own) for own in digests.values()] == [1, 1, 1, 1]
    distinct = set().union(*digests.values())
    assert len(distinct) == 4
    assert all(re.fullmatch("[0-9a-f]{16}", digest) for digest in distinct)


def test_rows_name_the_task_and_stage_at_their_begin(tables):
    """Events begin at their stamp, others in their first frame (of 10 ms); tasks and stages were planted by frames.

    Of two tasks at once the later counts. The session "four" has neither tasks nor stages.
    """
    rows = [(name, row) for name, table in tables.items() if name != "metrics" for row in table.to_pylist()]
    assert {name for name, _row in rows} == DATA_SET.keys() - {"metrics"}
    for name, row in rows:
        session = row["run"].rpartition("/")[2]
        frame = row["stamp_ns"] // STEP_NS if name == "events" else row["first"]
        assert row["task"] == span_at("task", session, frame), (name, row)
        assert row["stage"] == span_at("stage", session, frame), (name, row)


def test_metrics_name_all_tasks_and_stages_of_a_session(tables):
    """A row of metrics is about a whole session.

    Three have the tasks "stir" and "pour" in two stages, "four" has none.
    """
    for row in tables["metrics"].to_pylist():
        has_none = row["run"] == run_path("four")
        assert (row["task"], row["stage"]) == ((None, None) if has_none else ("stir + pour", "first + second"))


@pytest.fixture
def run_folder(data_set_folder, tmp_path):
    """A run folder, ``one``, that a test may change."""
    return shutil.copytree(data_set_folder / run_path("one"), tmp_path / "one")


@pytest.fixture
def events_file(run_folder):
    """The file of events of a run in the folder ``one``."""
    return run_folder / "events.parquet"


def test_newer_table_of_a_data_set_is_refused(events_file, tmp_path):
    """The table of events of the only run in a folder says the next version of its schema."""
    newer = SCHEMA.replace("2", "3")
    pq.write_table(pq.read_table(events_file).replace_schema_metadata({"schema": newer}), events_file)
    with pytest.raises(RunFolderError, match=rf"events.parquet has schema '{newer}', this version reads up to"):
        read(tmp_path)


def test_table_with_a_column_of_another_type_is_refused(events_file, tmp_path):
    """Stamps in the table of events of the only run in a folder are texts, not integers."""
    events = pq.read_table(events_file)
    texts = pa.array(["noon"] * len(events))
    pq.write_table(events.set_column(events.column_names.index("stamp_ns"), "stamp_ns", texts), events_file)
    with pytest.raises(RunFolderError, match=r"one/events.parquet: the column 'stamp_ns' is string, not int64"):
        read(tmp_path)


def test_damaged_table_of_a_data_set_is_named(events_file, tmp_path):
    """The file of events of the only run in a folder is a single byte; the folder may be named by a text too."""
    events_file.write_bytes(b"x")
    with pytest.raises(RunFolderError, match=r"one/events.parquet is damaged; run its session again$"):
        read(str(tmp_path))


def test_metrics_name_the_reference(tables):
    """All four runs of the data set were compared with ``exact``."""
    assert set(tables["metrics"]["oracle"].to_pylist()) == {"exact"}


@pytest.mark.parametrize(
    ("facts", "vr_type", "offline"),
    [
        pytest.param({"vr_type": "desktop"}, "desktop", False, id="type of VR stated, frame by frame"),
        pytest.param({}, None, True, id="type of VR not stated, offline"),
    ],
)
def test_metrics_have_vr_type_and_times_of_the_summary(facts, vr_type, offline, tmp_path):
    """A recording may state the type of VR as a fact. Times are seconds in the document, milliseconds in the table.

    A detector that runs offline, on all frames at once, has a mean time but no p99 and no slowest frame.
    """
    recorded = replace(session_named("one"), facts=facts)
    result = compute(recorded, detectors="slow=discrete[rate_hz=20]", oracle="exact", offline=offline)
    write_run_folder(result, tmp_path / "one")
    rows = read(tmp_path)["metrics"].to_pylist()
    assert {row["vr_type"] for row in rows} == {vr_type}
    for row in rows:
        seconds = result.document.detectors[row["detector"]].seconds
        assert row["mean_ms"] == pytest.approx(1e3 * seconds.per_frame_mean)
        if offline:
            assert (row["p99_ms"], row["worst_ms"]) == (None, None)
        else:
            assert row["p99_ms"] == pytest.approx(1e3 * seconds.p99)
            assert row["worst_ms"] == pytest.approx(1e3 * seconds.sample_times.max)


def test_folder_without_complete_runs_is_refused(run_folder, tmp_path):
    """First the folder is empty; then it has a run that is still being written, which is called .NAME.partial."""
    (tmp_path / "runs").mkdir()
    with pytest.raises(RunFolderError, match="holds no run folders"):
        read(tmp_path / "runs")
    run_folder.rename(tmp_path / "runs" / ".one.partial")
    with pytest.raises(RunFolderError, match="holds no run folders"):
        read(tmp_path / "runs")


def test_single_run_folder_is_read_as_a_data_set(run_folder):
    """The path of a run is relative to the folder that is read, here the run itself: "."."""
    assert set(read(run_folder)["metrics"]["run"].to_pylist()) == {"."}


def test_table_of_more_rows_than_bytes_hold_is_refused(run_folder, monkeypatch):
    """A damaged file may claim any number of rows; here the most rows a byte are lowered to 0.001, which all exceed."""
    monkeypatch.setattr("replay.show.results.parquet.MOST_ROWS_PER_BYTE", 0.001)
    with pytest.raises(RunFolderError, match="rows that it does not hold"):
        read(run_folder)


class WatchedFile(io.BytesIO):
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
    """A reading thread of Arrow's could still hold a Python file when the interpreter ends, and abort the program.

    The file notes the threads that read it; twenty columns are enough for Arrow to use several.
    """
    content = io.BytesIO()
    pq.write_table(pa.table({f"column {k}": [1.0, 2.0] for k in range(20)}), content)
    assert read_table(WatchedFile(content.getvalue())).num_columns == 20
    assert WatchedFile.readers == {threading.get_ident()}
