import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from replay.errors import OutputError, RunFolderError, StudyError
from replay.studies.class_study.collecting import collect, metric_files, read_students, write_table
from replay.studies.class_study.refusals import StudyRefusedError


def row(student, session, detector="exact", **more):
    return {"student": student, "session": session, "detector": detector, "settings": "s", "recall": 1.0, **more}


def folder(path, *rows):
    path.mkdir(parents=True)
    pq.write_table(pa.Table.from_pylist(list(rows)), path / "metrics.parquet")
    return path


def test_rows_of_all_runs_are_joined_in_order_of_student(tmp_path):
    folder(tmp_path / "batch" / "b", row("S2", "y"), row("S2", "y", "hybrid"))
    folder(tmp_path / "batch" / "a", row("S1", "x"))
    other = folder(tmp_path / "single", row("S0", "z"))
    table = collect([tmp_path / "batch", other])
    assert table["student"].to_pylist() == ["S0", "S1", "S2", "S2"]
    assert table["detector"].to_pylist()[2:] == ["exact", "hybrid"]


def test_a_task_that_only_one_scene_has_is_null_elsewhere(tmp_path):
    one = folder(tmp_path / "a", row("S1", "x", **{"task_seconds/stir": 3.0}))
    two = folder(tmp_path / "b", row("S2", "y", **{"task_seconds/pour": 4.0}))
    table = collect([one, two])
    assert table["task_seconds/stir"].to_pylist() == [3.0, None]
    assert table["task_seconds/pour"].to_pylist() == [None, 4.0]


def test_a_run_collected_twice_counts_once(tmp_path):
    one = folder(tmp_path / "a", row("S1", "x"))
    assert len(collect([one, one])) == 1


def test_a_session_of_two_students_is_refused(tmp_path):
    one, two = folder(tmp_path / "a", row("S1", "x")), folder(tmp_path / "b", row("S2", "x"))
    with pytest.raises(StudyRefusedError) as refused:
        collect([one, two])
    assert refused.value.rule == "ids"


def test_recordings_without_a_pseudonym_get_theirs_from_a_file(tmp_path):
    one = folder(tmp_path / "a", row("", "x"))
    with pytest.raises(StudyRefusedError, match="ids"):
        collect([one])
    students = tmp_path / "students.csv"
    students.write_text("session,student\nx,S7\n")
    assert collect([one], students)["student"].to_pylist() == ["S7"]


@pytest.mark.parametrize(
    "text, error", [("a,b\n1,2\n", StudyError), ("session,student\nx,S1\nx,S2\n", StudyRefusedError)]
)
def test_a_file_of_students_that_is_none_is_refused(tmp_path, text, error):
    file = tmp_path / "students.csv"
    file.write_text(text)
    with pytest.raises(error):
        read_students(file)


def test_folders_of_runs_are_found_and_half_written_ones_are_not(tmp_path):
    folder(tmp_path / "b" / "one", row("S1", "x"))
    folder(tmp_path / "b" / ".two.1234.partial", row("S2", "y"))
    assert [file.parent.name for file in metric_files(tmp_path / "b")] == ["one"]
    (tmp_path / "empty").mkdir()
    with pytest.raises(RunFolderError, match="holds no metrics"):
        metric_files(tmp_path / "empty")
    with pytest.raises(RunFolderError, match="no runs"):
        collect([])


def test_a_table_is_written_whole_or_not_at_all(tmp_path):
    table = pa.Table.from_pylist([row("S1", "x")])
    out = write_table(table, tmp_path / "deep" / "m.parquet")
    assert pq.read_table(out) == table
    with pytest.raises(OutputError, match="--force"):
        write_table(table, out)
    write_table(table, out, force=True)
    assert [file.name for file in out.parent.iterdir()] == ["m.parquet"]


def test_a_broken_table_names_its_file(tmp_path):
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "metrics.parquet").write_bytes(b"x")
    with pytest.raises(RunFolderError, match=r"metrics.parquet cannot be read"):
        collect([tmp_path / "a"])
