"""A command that is killed, or may write no more, leaves no torn, lost or foreign file, and the next call works."""

import json
import subprocess
import sys
import time

import numpy as np
import pyarrow.parquet as pq
import pytest
from support.processes import environment
from support.small_worlds import unit_cubes_on_x

from sessions import read_session, write_session

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform == "win32", reason="no signal kills there, and no limit is known"),
]
CSV = "kind,time,body,px,py,pz,qx,qy,qz,qw,tracked,other,value\n" + "".join(
    f"pose,{0.011 * k:.6f},Cup{k % 2},{0.01 * k},1,0,0,0,0,1,1,,\n" for k in range(600)
)
VERBS = {
    "import": ("import", "csv", "../s.csv", "--convention", "unity", "-o", "made.mcap"),
    "recover": ("recover", "../s.torn", "made.mcap"),
    "run": ("run", "../s.mcap", "--out", "made.mcap", "-q"),
    "demo": ("demo", "-q", "--scene", "fast-ball", "-o", "made.mcap"),
}


@pytest.fixture
def work_folder(tmp_path):
    """A folder with a file of somebody else, and beside it what commands read."""
    write_session(unit_cubes_on_x({"a": [0] * 90, "b": [0, 3, 0.9] * 30}), tmp_path / "s.mcap")
    data = (tmp_path / "s.mcap").read_bytes()
    (tmp_path / "s.torn").write_bytes(data[: len(data) * 9 // 10])
    (tmp_path / "s.csv").write_text(CSV)
    folder = tmp_path / "work"
    folder.mkdir()
    (folder / "thesis.txt").write_text("three years of work")
    return folder


def command_of_verb(verb):
    """The command line of a verb that overwrites what stands there."""
    return [sys.executable, "-m", "replay", *VERBS[verb], "--force"]


def assert_whole(made):
    """A session with poses, or a run folder with all files that its summary lists."""
    if made.is_file():
        assert len(read_session(made).frames) > 0
        return
    assert sorted(json.loads((made / "summary.json").read_bytes())["files"]) == sorted(f.name for f in made.iterdir())
    for table in made.glob("*.parquet"):
        pq.read_table(table)


def assert_called_again(verb, work):
    """Fails unless the command, called again, writes a whole file and leaves what was there."""
    done = subprocess.run(
        command_of_verb(verb), cwd=work, env=environment(), capture_output=True, text=True, timeout=300
    )
    assert done.returncode in (0, 3), done.stderr
    assert sorted(file.name for file in work.iterdir()) == ["made.mcap", "thesis.txt"]
    assert (work / "thesis.txt").read_text() == "three years of work"
    assert_whole(work / "made.mcap")


@pytest.mark.parametrize("verb", VERBS)
@pytest.mark.parametrize("earlier", [False, True])
def test_killed_command_leaves_earlier_output_and_the_next_call_works(work_folder, verb, earlier):
    """It is killed up to 30 ms after it began to write beside its output.

    The output that stands then is whole, the earlier or the new one; only while they change places there is none.
    """
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    if earlier:
        assert_called_again(verb, work_folder)
    process = subprocess.Popen(command_of_verb(verb), cwd=work_folder, env=environment(), **quiet)
    while process.poll() is None and not any(work_folder.glob(".made*")):
        time.sleep(0.0005)
    time.sleep(float(np.random.default_rng([1, earlier, len(verb)]).uniform(0, 0.03)))
    process.kill()
    process.wait()
    for made in work_folder.glob("made.mcap"):
        assert_whole(made)
    assert (work_folder / "made.mcap").exists() or not earlier or any(work_folder.glob(".made*"))
    assert_called_again(verb, work_folder)


@pytest.mark.parametrize("verb", VERBS)
@pytest.mark.parametrize("room", [4096, 20_000])
def test_full_disk_is_reported_and_changes_nothing(work_folder, verb, room):
    """No file may grow beyond ``room`` bytes: the command ends with one error and no file, or needed no more room.

    It exits with 1 after an error, with 3 after a loss of data that it reports.
    """

    def limited():
        import resource

        resource.setrlimit(resource.RLIMIT_FSIZE, (room, room))

    done = subprocess.run(
        command_of_verb(verb),
        cwd=work_folder,
        env=environment(),
        preexec_fn=limited,
        capture_output=True,
        text=True,
        timeout=300,
    )
    errors = [line for line in done.stderr.splitlines() if line.startswith("error: ")]
    assert (done.returncode, len(errors)) in [(1, 1), (0, 0), (3, 0)] and "Traceback" not in done.stderr
    if done.returncode == 1:
        assert [file.name for file in work_folder.iterdir()] == ["thesis.txt"]


PLAIN = {"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"}


@pytest.mark.parametrize("variables", [{"HOME": "/dev/null", "XDG_CACHE_HOME": ""}, PLAIN], ids=["no home", "locale C"])
def test_command_works_without_home_or_utf_8_in_any_folder(work_folder, variables):
    """The folder's name has spaces, quotes, brackets, a dollar and letters of two scripts."""
    folder = work_folder.rename(work_folder.parent / "\u00dcbung $(c) 'd' [red] \u6771")
    done = subprocess.run(
        command_of_verb("import"), cwd=folder, env=environment() | variables, capture_output=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    assert_whole(folder / "made.mcap")
