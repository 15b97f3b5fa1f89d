import json
import re
import shutil

import pyarrow.parquet as pq
import pytest
from support.small_worlds import unit_cubes_on_x

import replay
from replay.document.coding import json_of
from replay.document.file_hash import file_hash
from replay.engine import compute
from replay.errors import OutputError, RunFolderError
from replay.show.results.run_folder import check_target, read_run_folder, write_run_folder
from replay.studies.diff.runs import diff_runs


@pytest.fixture(scope="module")
def result_of_two_contacts():
    """A run in which cubes touch in frames 2 and 6; ``slow`` samples at 20 Hz."""
    positions = {"a": [0] * 8, "b": [3, 3, 0.9, 3, 3, 3, 0.9, 3]}
    return compute(unit_cubes_on_x(positions), detectors="slow=discrete[rate_hz=20]", oracle="hybrid")


def file_names(folder):
    """Names of the files in a folder, sorted."""
    return sorted(path.name for path in folder.iterdir())


DRAWING = "replay.show.rerun_log.recording.write_recording"
"""Where the function stands that draws the picture of a run: it takes a result and a path."""


@pytest.fixture(scope="module")
def folder_with_picture_and_session(result_of_two_contacts, tmp_path_factory):
    """A run folder with a picture, which a stand-in draws, and a copy of the session file; no test changes it."""
    top = tmp_path_factory.mktemp("runs")
    session = top / "s.mcap"
    session.write_bytes(b"poses")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(DRAWING, lambda result, path: path.write_text("picture"))
        return write_run_folder(
            result_of_two_contacts, top / "deep" / "run", picture=True, files={"session.mcap": session}
        )


@pytest.fixture(scope="module")
def folder_without_picture(result_of_two_contacts, tmp_path_factory):
    """A run folder without a picture; no test changes it."""
    return write_run_folder(result_of_two_contacts, tmp_path_factory.mktemp("runs") / "run")


def test_a_run_folder_holds_tables_summary_and_picture(folder_with_picture_and_session):
    """Tables, report, picture (run.rrd), a copy of the session and the summary; nothing is left beside the folder."""
    tables = {"episodes", "events", "false", "frames", "metrics", "misses", "ranking", "session", "times", "timing"}
    others = {"report.html", "run.rrd", "session.mcap", "summary.json"}
    assert set(file_names(folder_with_picture_and_session)) == {f"{table}.parquet" for table in tables} | others
    assert file_names(folder_with_picture_and_session.parent) == ["run"]


def test_summary_has_document_files_and_hash_of_the_picture(folder_with_picture_and_session, result_of_two_contacts):
    """Beside the document of the run, the summary lists all files of the folder and says the hash of the picture."""
    folder = folder_with_picture_and_session
    summary = json.loads((folder / "summary.json").read_text())
    assert summary.pop("files") == file_names(folder)
    assert summary.pop("picture_sha256") == file_hash(folder / "run.rrd")
    assert summary == json.loads(json_of(result_of_two_contacts.document))


def test_table_of_misses_has_a_row_a_miss(folder_with_picture_and_session, result_of_two_contacts):
    """Contact is in frames 2 and 6; at 20 Hz every fifth frame is sampled, here frame 6, so that frame 2 is missed."""
    rows = pq.read_table(folder_with_picture_and_session / "misses.parquet").to_pylist()
    assert [row["first"] for row in rows] == [2]
    assert [miss.first for miss in result_of_two_contacts.misses["slow"]] == [2]


@pytest.fixture
def broken_drawing(monkeypatch):
    """Drawing the picture of a run fails half way."""

    def write_half_and_fail(result, path):
        path.write_text("half")
        raise ValueError("no ink")

    monkeypatch.setattr(DRAWING, write_half_and_fail)


def test_failed_run_folder_leaves_nothing_behind(result_of_two_contacts, tmp_path, broken_drawing):
    """The picture of a run fails half way as it is drawn ("no ink"), into a new folder."""
    with pytest.raises(ValueError, match="no ink"):
        write_run_folder(result_of_two_contacts, tmp_path / "run", picture=True)
    assert file_names(tmp_path) == []


def test_failed_run_folder_leaves_an_earlier_run_untouched(
    result_of_two_contacts, folder_without_picture, tmp_path, broken_drawing
):
    """A run is written without a picture, then over it, on request (``force``), one whose picture fails ("no ink").

    No second, half-written folder stays.
    """
    shutil.copytree(folder_without_picture, tmp_path / "run")
    before = (tmp_path / "run" / "summary.json").read_bytes()
    with pytest.raises(ValueError, match="no ink"):
        write_run_folder(result_of_two_contacts, tmp_path / "run", picture=True, force=True)
    assert file_names(tmp_path) == ["run"]
    assert (tmp_path / "run" / "summary.json").read_bytes() == before


def test_earlier_run_is_replaced_only_on_request(result_of_two_contacts, folder_without_picture):
    """Without ``force`` a folder that exists is an error, which says what to do."""
    with pytest.raises(OutputError, match="exists; name another folder, or replace it with --force"):
        write_run_folder(result_of_two_contacts, folder_without_picture)


def test_replaced_run_folder_loses_its_own_files_only(result_of_two_contacts, folder_without_picture, tmp_path):
    """Files that the summary of the earlier run lists go; a note and a folder of the user's own stay."""
    folder = shutil.copytree(folder_without_picture, tmp_path / "run")
    (folder / "old.parquet").write_text("earlier")
    list_in_summary(folder, file_names(folder))
    (folder / "note.txt").write_text("mine")
    (folder / "more").mkdir()
    write_run_folder(result_of_two_contacts, folder, force=True)
    assert "old.parquet" not in file_names(folder)
    assert (folder / "note.txt").read_text() == "mine"
    assert (folder / "more").is_dir()
    assert file_names(tmp_path) == ["run"]


def list_in_summary(folder, files):
    """Lets the summary of a run folder list these files."""
    summary = json.loads((folder / "summary.json").read_text())
    (folder / "summary.json").write_text(json.dumps({**summary, "files": files}))


@pytest.mark.parametrize(
    "summary",
    [
        pytest.param(None, id="no summary"),
        pytest.param("{}", id="an empty summary"),
        pytest.param('{"schema": "vrlab-study/1"}', id="a summary of another program"),
        pytest.param("[]", id="a list for a summary"),
        pytest.param('{"schema": "vrlab-replay/run/2", "files": ["../thesis.txt"]}', id="a file outside listed"),
    ],
)
def test_force_never_replaces_a_folder_without_a_run(summary, tmp_path):
    """A folder with a file of the user's own, and what may stand in ``summary.json`` beside it."""
    (tmp_path / "thesis.txt").write_text("years")
    if summary is not None:
        (tmp_path / "summary.json").write_text(summary)
    with pytest.raises(OutputError, match="is not a run folder and is not replaced"):
        check_target(tmp_path, force=True)


def test_force_never_replaces_a_file(tmp_path):
    """A file stands where the run folder is to be."""
    (tmp_path / "thesis.txt").write_text("years")
    with pytest.raises(OutputError, match="is a file"):
        check_target(tmp_path / "thesis.txt", force=True)


def test_empty_or_absent_folder_may_become_a_run_folder(tmp_path):
    """An empty folder with ``force``, an absent one without: neither is an error."""
    (tmp_path / "empty").mkdir()
    check_target(tmp_path / "empty", force=True)
    check_target(tmp_path / "new")


def test_unwritable_path_is_a_clear_error(result_of_two_contacts, tmp_path):
    """The run folder is to be made inside a file."""
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot be written"):
        write_run_folder(result_of_two_contacts, tmp_path / "file" / "run")


def test_a_run_folder_reads_back(folder_without_picture):
    """A run is written and read.

    Its reference was ``hybrid``, and the only miss of its detector ``slow`` is number 1.
    """
    folder = read_run_folder(folder_without_picture)
    assert folder.document.oracle == "hybrid"
    assert [row["number"] for row in folder.rows("misses")] == [1]


def test_run_folder_without_a_picture_has_none(folder_without_picture):
    """The run was written without a picture; whoever wants that gets an error."""
    folder = read_run_folder(folder_without_picture)
    with pytest.raises(RunFolderError, match="holds no picture"):
        _ = folder.picture


def refusal_of(folder):
    """The message with which a folder is refused that is to be read as a run folder; "" where it is read."""
    try:
        read_run_folder(folder)
    except RunFolderError as error:
        return str(error)
    return ""


def test_run_folder_of_another_schema_names_its_age_if_known(tmp_path):
    """This version reads ``vrlab-replay/run/2``; a folder of another schema is refused with this message."""
    message_of_schema = {
        "vrlab-replay/run/99": "written by a newer version",
        "vrlab-replay/run/10": "newer version",
        "vrlab-replay/run/3": "newer version",
        "vrlab-replay/run/1": r"older version .* replay run SESSION.mcap --out FOLDER --force",
        "vrlab-replay/run/0": "older version",
        "vrlab-replay/run/x": "has schema 'vrlab-replay/run/x'",
        "other/run/1": "has schema 'other/run/1'",
    }
    for schema, message in message_of_schema.items():
        (tmp_path / "summary.json").write_text(f'{{"schema": "{schema}"}}')
        assert re.search(message, refusal_of(tmp_path)), schema


def test_folder_without_a_summary_is_no_run_folder(tmp_path):
    """The folder is empty."""
    with pytest.raises(RunFolderError, match="is not a run folder"):
        read_run_folder(tmp_path)


def test_run_folder_whose_summary_is_a_list_is_refused(tmp_path):
    """A list has no schema."""
    (tmp_path / "summary.json").write_text("[1]")
    with pytest.raises(RunFolderError, match="has schema None"):
        read_run_folder(tmp_path)


@pytest.fixture
def folder_with_changed_picture(folder_with_picture_and_session, tmp_path):
    """A run folder in whose picture, seven bytes by a stand-in, one bit was changed later."""
    folder = shutil.copytree(folder_with_picture_and_session, tmp_path / "flipped")
    picture = folder / "run.rrd"
    content = bytearray(picture.read_bytes())
    content[3] ^= 1
    picture.write_bytes(content)
    return folder


@pytest.mark.parametrize(
    "use_folder",
    [
        pytest.param(replay.view, id="view"),
        pytest.param(lambda folder: diff_runs(folder, folder), id="diff"),
        pytest.param(lambda folder: replay.share(folder, folder.parent / "sent", anyway=True), id="share"),
    ],
)
def test_a_flipped_bit_in_the_picture_is_refused(folder_with_changed_picture, use_folder):
    """One bit of the picture in a run folder was changed. The summary has the hash of the picture that was drawn.

    Nothing that uses the folder takes another one.
    """
    with pytest.raises(RunFolderError, match=r"run.rrd is damaged: it is not the picture that its run wrote"):
        use_folder(folder_with_changed_picture)


def test_a_picture_that_no_run_wrote_is_refused(folder_without_picture, tmp_path):
    """The run was written without a picture; a file of its name is put beside its tables later."""
    folder = shutil.copytree(folder_without_picture, tmp_path / "run")
    (folder / "run.rrd").write_bytes(b"of another run")
    with pytest.raises(RunFolderError, match="is not the picture that its run wrote"):
        _ = read_run_folder(folder).picture
