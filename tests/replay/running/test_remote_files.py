import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from support.small_worlds import unit_cubes_on_x

from replay.cli.main import main
from replay.errors import OutputError, PlaceError
from replay.running.batch import run_batch
from replay.running.remote_files import path_of_place, store_errors
from replay.show.results.run_folder import read_run_folder
from sessions import write_session

SETTINGS = {"detectors": "hybrid", "oracle": "none", "picture": False}


@pytest.fixture
def store(request, tmp_path):
    """The address of a store with the session files s0 and s1 in its folder sessions; both are in tmp_path, too.

    A store is a place that is reached by a URL: in memory, on a disk, or S3.
    """
    pytest.importorskip("upath")
    root = request.getfixturevalue(request.param) if request.param == "s3" else request.param.format(tmp_path)
    file_system = path_of_place(root).fs
    file_system.makedirs(path_of_place(root).path + "/sessions", exist_ok=True)
    for name, nearest in (("s0", 0.8), ("s1", 0.9)):
        session = unit_cubes_on_x({"a": [0.0] * 9, "b": list(np.linspace(3, nearest, 9))})
        write_session(session, tmp_path / f"{name}.mcap")
        file_system.put_file(str(tmp_path / f"{name}.mcap"), path_of_place(f"{root}/sessions/{name}.mcap").path)
    return root


def sessions_of(store):
    """Addresses of both sessions of a store."""
    return [f"{store}/sessions/s0.mcap", f"{store}/sessions/s1.mcap"]


@pytest.fixture
def local_digest(tmp_path):
    """Returns the digest of the runs of so many sessions from this disk to this disk."""

    def digest(sessions):
        files = [tmp_path / f"s{number}.mcap" for number in range(sessions)]
        return run_batch(files, tmp_path / "here", settings=SETTINGS).digest

    return digest


@pytest.fixture(scope="module")
def s3():
    """An object store on this machine; workers find it through the environment."""
    server = pytest.importorskip("moto.moto_server.threaded_moto_server").ThreadedMotoServer("127.0.0.1", 0)
    pytest.importorskip("s3fs")
    server.start()
    with pytest.MonkeyPatch.context() as patch:
        for name in ("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"):
            patch.setenv(name, "made-up")
        patch.setenv("AWS_DEFAULT_REGION", "us-east-1")
        patch.setenv("AWS_ENDPOINT_URL", "http://{}:{}".format(*server.get_host_and_port()))
        yield "s3://laboratory"
    server.stop()


def test_url_of_an_unknown_store_is_refused():
    """There is no store of the kind nonsense; a folder would do."""
    pytest.importorskip("upath")
    with pytest.raises(PlaceError, match=r"nonsense://a cannot be reached .*or name a folder"):
        path_of_place("nonsense://a")


def test_url_without_the_package_for_urls_names_what_to_install(monkeypatch):
    """``None`` in sys.modules makes the import of ``upath`` fail."""
    monkeypatch.setitem(sys.modules, "upath", None)
    with pytest.raises(PlaceError, match=r"s3://a cannot be reached .*pip install \"vrlab-replay\[cluster\]\""):
        path_of_place("s3://a")


def test_url_without_its_store_package_is_refused_with_a_hint(monkeypatch):
    """A store other than s3, here Google's, needs a package that no extra of this program brings (``gcsfs``)."""
    pytest.importorskip("upath")
    monkeypatch.setitem(sys.modules, "gcsfs", None)
    with pytest.raises(PlaceError, match=r"gs://a/b cannot be reached .*install what fsspec needs for it"):
        path_of_place("gs://a/b")


def test_path_of_this_machine_is_a_plain_path():
    """A text without a URL's scheme is a path of pathlib."""
    path = path_of_place("runs/a")
    assert path == Path("runs/a")
    assert type(path) is type(Path("runs/a"))


PATH_IN_A_STORE = SimpleNamespace(fs=None)
"""Stands for the path of a URL: it has a file system of its own."""


@pytest.mark.parametrize(
    ("path", "error", "raised"),
    [
        pytest.param(PATH_IN_A_STORE, OSError("no network"), PlaceError, id="system's error, store"),
        pytest.param(PATH_IN_A_STORE, OutputError("exists"), OutputError, id="own error, store"),
        pytest.param(Path("runs"), OSError("disk full"), OSError, id="system's error, disk"),
        pytest.param(Path("runs"), OutputError("exists"), OutputError, id="own error, disk"),
    ],
)
def test_only_foreign_errors_of_a_store_are_replaced(path, error, raised):
    """An OSError becomes a PlaceError for a path in a store, and stays for one of a disk; errors of ours stay."""
    with pytest.raises(raised) as caught, store_errors(path):
        raise error
    assert type(caught.value) is raised


STORES = ["memory://laboratory", "file://{}/far", pytest.param("s3", marks=pytest.mark.slow)]


@pytest.mark.sampled(2)
@pytest.mark.parametrize("store", STORES, indirect=True)
def test_store_runs_have_the_digest_of_local_runs(store, local_digest, tmp_path):
    """The run of a session in a store, written to the store, has the same files and digest as on disk."""
    batch = run_batch(sessions_of(store)[:1], f"{store}/far", settings=SETTINGS)
    assert batch.kept == ()
    assert batch.digest == local_digest(sessions=1) != ""
    files_here = {path.name for path in (tmp_path / "here" / "s0").iterdir()}
    assert {path.name for path in path_of_place(f"{store}/far/s0").iterdir()} == files_here


def test_summary_is_the_last_file_put_into_a_store(tmp_path):
    """Without summary.json a run counts as broken off; a store in memory lists files in the order of their writing."""
    pytest.importorskip("upath")
    write_session(unit_cubes_on_x({"a": [0.0] * 3, "b": [3.0, 2.0, 0.9]}), tmp_path / "s0.mcap")
    run_batch([tmp_path / "s0.mcap"], "memory://order", settings=SETTINGS)
    files = [name for name in path_of_place("memory://order").fs.store if name.startswith("/order/s0/")]
    assert files[-1] == "/order/s0/summary.json" and len(files) > 1


@pytest.mark.sampled(2)
@pytest.mark.parametrize("store", STORES, indirect=True)
def test_run_in_a_store_without_its_summary_is_made_again(store):
    """The summary of s1 is removed, as if its run was killed before the last file was there; s0 is kept."""
    first = run_batch(sessions_of(store), f"{store}/runs", settings=SETTINGS)
    path_of_place(f"{store}/runs/s1/summary.json").unlink()
    again = run_batch(sessions_of(store), f"{store}/runs", settings=SETTINGS)
    assert again.kept == ("s0",)
    assert again.digest == first.digest
    with pytest.raises(OutputError, match="other settings"):
        run_batch(sessions_of(store), f"{store}/runs", settings={**SETTINGS, "seed": 1})


@pytest.mark.sampled(2)
@pytest.mark.parametrize("store", STORES, indirect=True)
def test_missing_store_session_fails_alone_by_name(store, tmp_path):
    """A store, in memory or on a disk, has no session "gone": a batch reports it and does s0."""
    sessions = [f"{store}/sessions/s0.mcap", f"{store}/sessions/gone.mcap"]
    batch = run_batch(sessions, tmp_path / "runs", settings=SETTINGS)
    assert batch.done == ("s0",)
    assert "gone.mcap cannot be reached" in batch.failed["gone"]


@pytest.mark.sampled(2)
@pytest.mark.parametrize("store", STORES, indirect=True)
def test_run_of_a_missing_store_session_makes_no_folder(store, tmp_path, capsys):
    """The command ends with code 1 and names the file."""
    assert main(["run", f"{store}/sessions/gone.mcap", "-o", str(tmp_path / "run")]) == 1
    assert "gone.mcap cannot be reached" in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "run").exists()


@pytest.mark.slow
@pytest.mark.parametrize("store", STORES, indirect=True)
def test_command_run_takes_urls_for_session_and_run_folder(store, capsys):
    """A run folder that is there is replaced by --force alone."""
    out = f"{store}/run"
    command = ["run", f"{store}/sessions/s0.mcap", "--detectors", "hybrid", "--no-picture", "-o", out]
    assert main(command) == 0
    assert f"{path_of_place(out)}/report.html" in capsys.readouterr().out
    assert read_run_folder(path_of_place(out)).document.session.recording.bytes > 0
    assert main(command) == 1
    assert "replace it with --force" in " ".join(capsys.readouterr().err.split())
    assert main([*command, "--force"]) == 0
    assert path_of_place(f"{out}/summary.json").is_file()


@pytest.mark.slow
@pytest.mark.parametrize("store", STORES, indirect=True)
def test_command_run_takes_the_url_of_a_folder_of_sessions(store, capsys):
    """Both sessions of the store are run into a folder of the store."""
    command = ["run", f"{store}/sessions", "-o", f"{store}/class", "--detectors", "hybrid", "--no-picture"]
    assert main(command) == 0
    assert "2 of 2 sessions are in" in " ".join(capsys.readouterr().out.split())


@pytest.mark.slow
@pytest.mark.parametrize("verb", ["info", "doctor"])
@pytest.mark.parametrize("store", STORES, indirect=True)
def test_commands_that_read_a_session_take_its_url(store, verb, capsys):
    """The session s0 is in the store, "gone" is not: exit code 1."""
    assert main([verb, f"{store}/sessions/s0.mcap"]) == 0
    assert "s0.mcap" in capsys.readouterr().out
    assert main([verb, f"{store}/sessions/gone.mcap"]) == 1
    assert "gone.mcap cannot be reached" in " ".join(capsys.readouterr().err.split())


@pytest.mark.slow
@pytest.mark.parametrize("store", ["file://{}/far", "s3"], indirect=True)
def test_workers_of_a_cluster_fetch_and_put_by_themselves(store, local_digest):
    """Two processes run the sessions of a store into the store; the digest is that of runs on this disk."""
    batch = run_batch(sessions_of(store), f"{store}/runs", settings=SETTINGS, jobs=2)
    assert batch.digest == local_digest(sessions=2) != ""
