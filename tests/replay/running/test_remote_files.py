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
    """A folder of a store, with two sessions in it."""
    pytest.importorskip("upath")
    root = request.getfixturevalue(request.param) if request.param == "s3" else request.param.format(tmp_path)
    path_of_place(root).fs.makedirs(path_of_place(root).path + "/sessions", exist_ok=True)
    for k in range(2):
        write_session(
            unit_cubes_on_x({"a": [0.0] * 9, "b": list(np.linspace(3, 0.8 + 0.1 * k, 9))}), tmp_path / f"s{k}.mcap"
        )
        path_of_place(root).fs.put_file(str(tmp_path / f"s{k}.mcap"), path_of_place(f"{root}/sessions/s{k}.mcap").path)
    return root


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


def test_unreadable_url_is_refused_with_the_package_to_install(monkeypatch):
    """A store of an unknown kind, and a known one (s3) where the package ``upath`` is not installed."""
    pytest.importorskip("upath")
    with pytest.raises(PlaceError, match=r"nonsense://a cannot be reached .*or name a folder"):
        path_of_place("nonsense://a")
    monkeypatch.setitem(sys.modules, "upath", None)
    with pytest.raises(PlaceError, match=r"s3://a cannot be reached .*pip install \"vrlab-replay\[cluster\]\""):
        path_of_place("s3://a")


def test_url_without_its_store_package_is_refused_with_a_hint(monkeypatch):
    """A store other than s3 needs a package of its own, which the extra of this program does not bring."""
    pytest.importorskip("upath")
    monkeypatch.setitem(sys.modules, "gcsfs", None)
    with pytest.raises(PlaceError, match=r"gs://a/b cannot be reached .*install what fsspec needs for it"):
        path_of_place("gs://a/b")


def test_path_of_this_machine_is_a_plain_path():
    assert type(path_of_place("runs/a")) is type(Path("runs/a"))


REMOTE = SimpleNamespace(fs=None)
"""What the path of a URL looks like: it has a file system."""


@pytest.mark.parametrize(
    ("address", "error", "raised"),
    [
        (REMOTE, OSError("no network"), PlaceError),
        (REMOTE, OutputError("exists"), OutputError),
        (Path("runs"), OSError("disk full"), OSError),
        (Path("runs"), OutputError("exists"), OutputError),
    ],
)
def test_only_foreign_errors_of_a_store_are_replaced(address, error, raised):
    """An OSError becomes a PlaceError for a path of a store, and stays for a path of a disk; errors of ours stay."""
    with pytest.raises(raised) as caught, store_errors(address):
        raise error
    assert type(caught.value) is raised


STORES = ["memory://laboratory", "file://{}/far", pytest.param("s3", marks=pytest.mark.slow)]


@pytest.mark.sampled(2)
@pytest.mark.parametrize("store", STORES, indirect=True)
def test_store_runs_have_the_digest_of_local_runs(store, tmp_path):
    """Runs of sessions in a store have the same files and digest as on disk, and summary.json is put there last.

    A run without that file counts as broken off and is made again; other settings are refused.
    """
    given = [f"{store}/sessions/s{k}.mcap" for k in range(2)]
    here = run_batch([tmp_path / "s0.mcap", tmp_path / "s1.mcap"], tmp_path / "here", settings=SETTINGS)
    existing = run_batch(given, f"{store}/runs", settings=SETTINGS)
    assert here.digest == existing.digest != "" and existing.kept == ()
    names = {path.name for path in (tmp_path / "here" / "s0").iterdir()}
    assert {path.name for path in path_of_place(f"{store}/runs/s0").iterdir()} == names
    put = [name for name in getattr(path_of_place(store).fs, "store", ()) if "/runs/s0/" in name]
    assert put[-1:] in ([], ["/laboratory/runs/s0/summary.json"])
    path_of_place(f"{store}/runs/s1/summary.json").unlink()  # as if killed before the last file was there
    again = run_batch(given, f"{store}/runs", settings=SETTINGS)
    assert again.kept == ("s0",) and again.digest == here.digest
    with pytest.raises(OutputError, match="other settings"):
        run_batch(given, f"{store}/runs", settings={**SETTINGS, "seed": 1})


@pytest.mark.sampled(2)
@pytest.mark.parametrize("store", STORES, indirect=True)
def test_missing_store_session_fails_alone_by_name(store, tmp_path, capsys):
    """The store has no session "gone": a batch reports it and does s0, a single run ends with code 1 and no folder."""
    batch = run_batch(
        [f"{store}/sessions/{name}.mcap" for name in ("s0", "gone")], tmp_path / "runs", settings=SETTINGS
    )
    assert batch.done == ("s0",) and "gone.mcap cannot be reached" in batch.failed["gone"]
    assert main(["run", f"{store}/sessions/gone.mcap", "-o", str(tmp_path / "one")]) == 1
    assert "gone.mcap cannot be reached" in capsys.readouterr().err and not (tmp_path / "one").exists()


@pytest.mark.slow
@pytest.mark.parametrize("store", STORES, indirect=True)
def test_verbs_take_urls_for_sessions_and_runs(store, tmp_path, capsys):
    """run (one session, again, with --force, a whole folder), info and doctor, with sessions and runs in a store."""
    text = [f"{store}/sessions/s0.mcap", "--detectors", "hybrid", "--no-picture", "-o"]
    assert main(["run", *text, f"{store}/one"]) == 0
    assert f"{path_of_place(f'{store}/one')}/report.html" in capsys.readouterr().out
    assert read_run_folder(path_of_place(f"{store}/one")).document.session.recording.bytes > 0
    assert main(["run", *text, f"{store}/one"]) == 1
    assert "replace it with --force" in capsys.readouterr().err
    assert main(["run", *text, f"{store}/one", "--force"]) == 0 and path_of_place(f"{store}/one/summary.json").is_file()
    for verb in ("info", "doctor"):
        assert main([verb, f"{store}/sessions/s0.mcap"]) == 0
        assert "s0.mcap" in capsys.readouterr().out
        assert main([verb, f"{store}/sessions/gone.mcap"]) == 1
        assert "gone.mcap cannot be reached" in capsys.readouterr().err
    assert main(["run", f"{store}/sessions", "-o", f"{store}/class", "--detectors", "hybrid", "--no-picture"]) == 0
    assert "2 of 2 sessions are in" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.parametrize("store", ["file://{}/far", "s3"], indirect=True)
def test_workers_of_a_cluster_fetch_and_put_by_themselves(store, tmp_path):
    """Two processes run the sessions of a store into the store; the digest is that of runs on this disk."""
    given = [f"{store}/sessions/s{k}.mcap" for k in range(2)]
    here = run_batch([tmp_path / "s0.mcap", tmp_path / "s1.mcap"], tmp_path / "here", settings=SETTINGS)
    existing = run_batch(given, f"{store}/runs", settings=SETTINGS, jobs=2)
    assert here.digest == existing.digest != ""
