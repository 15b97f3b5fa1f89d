import json
from functools import partial

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


@pytest.fixture
def drawing(monkeypatch):
    """Sets what draws the picture: a function of a result and a path."""
    return partial(monkeypatch.setattr, "replay.show.rerun_log.recording.write_recording")


def test_a_run_folder_holds_tables_summary_and_picture(result_of_two_contacts, tmp_path, drawing):
    """The picture is drawn by a stand-in; the summary lists all files and the picture's hash."""
    drawing(lambda actual, path: path.write_text("p"))
    session = tmp_path / "s.mcap"
    session.write_bytes(b"poses")
    out = write_run_folder(
        result_of_two_contacts, tmp_path / "deep" / "run", picture=True, files={"session.mcap": session}
    )
    tables = [
        "episodes.parquet",
        "events.parquet",
        "false.parquet",
        "frames.parquet",
        "metrics.parquet",
        "misses.parquet",
        "ranking.parquet",
    ]
    others = ["session.mcap", "session.parquet", "summary.json", "times.parquet", "timing.parquet"]
    assert file_names(out) == [*tables, "report.html", "run.rrd", *others]
    summary = json.loads((out / "summary.json").read_text())
    assert summary.pop("files") == file_names(out)
    assert summary.pop("picture_sha256") == file_hash(out / "run.rrd")
    assert summary == json.loads(json_of(result_of_two_contacts.document))
    assert pq.read_table(out / "misses.parquet").num_rows == len(result_of_two_contacts.misses["slow"])
    assert file_names(out.parent) == ["run"]


def test_a_failure_leaves_nothing_behind_and_an_earlier_run_untouched(result_of_two_contacts, tmp_path, drawing):
    """Drawing the picture fails half way, into a new folder and over an earlier run."""

    def broken(got, path):
        path.write_text("half")
        raise ValueError("no ink")

    drawing(broken)
    with pytest.raises(ValueError, match="no ink"):
        write_run_folder(result_of_two_contacts, tmp_path / "run", picture=True)
    assert file_names(tmp_path) == []
    write_run_folder(result_of_two_contacts, tmp_path / "run")
    before = (tmp_path / "run" / "summary.json").read_bytes()
    with pytest.raises(ValueError, match="no ink"):
        write_run_folder(result_of_two_contacts, tmp_path / "run", picture=True, force=True)
    assert file_names(tmp_path) == ["run"] and (tmp_path / "run" / "summary.json").read_bytes() == before


def test_earlier_run_is_replaced_only_on_request(result_of_two_contacts, tmp_path):
    """Files that the earlier summary lists go; a note and a folder of the user's own stay."""
    out = write_run_folder(result_of_two_contacts, tmp_path / "run")
    (out / "old.parquet").write_text("earlier")
    _list(out, [*file_names(out)])
    (out / "note.txt").write_text("mine")
    (out / "more").mkdir()
    with pytest.raises(OutputError, match="exists; name another folder, or replace it with --force"):
        write_run_folder(result_of_two_contacts, out)
    write_run_folder(result_of_two_contacts, out, force=True)
    assert "old.parquet" not in file_names(out) and (out / "note.txt").read_text() == "mine" and (out / "more").is_dir()
    assert file_names(tmp_path) == ["run"]


def _list(out, files):
    """Lets the summary of a run folder list these files."""
    summary = json.loads((out / "summary.json").read_text())
    (out / "summary.json").write_text(json.dumps({**summary, "files": files}))


def test_force_never_replaces_a_folder_without_a_run(tmp_path):
    """A folder of other files, also beside a summary that is none, is of another program or lists a file outside."""
    (tmp_path / "thesis.txt").write_text("years")
    with pytest.raises(OutputError, match="is not a run folder and is not replaced"):
        check_target(tmp_path, force=True)
    with pytest.raises(OutputError, match="is a file"):
        check_target(tmp_path / "thesis.txt", force=True)
    outside = '{"schema": "vrlab-replay/run/2", "files": ["../thesis.txt"]}'
    for mark in ("{}", '{"schema": "vrlab-study/1"}', "[]", outside):
        (tmp_path / "summary.json").write_text(mark)
        with pytest.raises(OutputError, match="is not a run folder and is not replaced"):
            check_target(tmp_path, force=True)
    (tmp_path / "empty").mkdir()
    check_target(tmp_path / "empty", force=True)
    check_target(tmp_path / "new")


def test_unwritable_path_is_one_clear_error(result_of_two_contacts, tmp_path):
    """A folder inside a file cannot be made."""
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot be written"):
        write_run_folder(result_of_two_contacts, tmp_path / "file" / "run")


def test_a_run_folder_reads_back(result_of_two_contacts, tmp_path):
    """Its misses are numbered from 1, and it was written without a picture."""
    folder = read_run_folder(write_run_folder(result_of_two_contacts, tmp_path / "run"))
    assert folder.document.oracle == "hybrid"
    numbers = [row["number"] for row in folder.rows("misses")]
    assert numbers == [miss.number for miss in result_of_two_contacts.misses["slow"]] and numbers[0] == 1
    with pytest.raises(RunFolderError, match="holds no picture"):
        _ = folder.picture


@pytest.mark.parametrize(
    ("schema", "message"),
    [
        ("vrlab-replay/run/10", "newer version"),
        ("vrlab-replay/run/3", "newer version"),
        ("vrlab-replay/run/0", "older version"),
        ("vrlab-replay/run/x", "has schema"),
        ("other/run/1", "has schema"),
    ],
)
def test_run_folder_of_another_schema_names_its_age_if_known(schema, message, tmp_path):
    """This version reads ``vrlab-replay/run/2``."""
    (tmp_path / "summary.json").write_text(f'{{"schema": "{schema}"}}')
    with pytest.raises(RunFolderError, match=message):
        read_run_folder(tmp_path)


def test_reading_a_folder_without_a_known_run_is_refused(tmp_path):
    """Without a summary, with one of a newer version, and with one that is a list."""
    with pytest.raises(RunFolderError, match="is not a run folder"):
        read_run_folder(tmp_path)
    (tmp_path / "summary.json").write_text('{"schema": "vrlab-replay/run/99"}')
    with pytest.raises(RunFolderError, match="written by a newer version"):
        read_run_folder(tmp_path)
    (tmp_path / "summary.json").write_text("[1]")
    with pytest.raises(RunFolderError, match="has schema None"):
        read_run_folder(tmp_path)


@pytest.fixture
def flipped(result_of_two_contacts, tmp_path, drawing):
    """A run folder in whose picture one bit was changed."""
    drawing(lambda actual, path: path.write_bytes(b"picture"))
    folder = write_run_folder(result_of_two_contacts, tmp_path / "flipped", picture=True)
    picture = folder / "run.rrd"
    data = bytearray(picture.read_bytes())
    data[3] ^= 1
    picture.write_bytes(data)
    return folder


@pytest.mark.parametrize(
    "use",
    [
        replay.view,
        lambda run: diff_runs(run, run),
        lambda run: replay.share(run, run.parent / "sent", anyway=True),
    ],
    ids=["view", "diff", "share"],
)
def test_a_flipped_bit_in_the_picture_is_refused(flipped, use):
    """``use``: what is done with the run folder."""
    with pytest.raises(RunFolderError, match=r"run.rrd is damaged: it is not the picture that its run wrote"):
        use(flipped)


def test_a_picture_that_no_run_wrote_is_refused(result_of_two_contacts, tmp_path):
    """The run was written without a picture; the file is put beside."""
    folder = write_run_folder(result_of_two_contacts, tmp_path / "run")
    (folder / "run.rrd").write_bytes(b"of another run")
    with pytest.raises(RunFolderError, match="is not the picture that its run wrote"):
        _ = read_run_folder(folder).picture


def test_run_folder_of_an_older_version_names_the_renewing_command(tmp_path):
    """Version 1; this one reads 2."""
    (tmp_path / "summary.json").write_text('{"schema": "vrlab-replay/run/1"}')
    with pytest.raises(RunFolderError, match=r"older version .* replay run SESSION.mcap --out FOLDER --force"):
        read_run_folder(tmp_path)
