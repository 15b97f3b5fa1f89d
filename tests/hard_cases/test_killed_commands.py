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
"""600 poses of two cups."""
COMMANDS = {
    "import": ("import", "csv", "../s.csv", "--convention", "unity", "-o", "made.mcap"),
    "recover": ("recover", "../s.torn", "made.mcap"),
    "run": ("run", "../s.mcap", "--out", "made.mcap", "-q"),
    "demo": ("demo", "-q", "--scene", "fast-ball", "-o", "made.mcap"),
}


@pytest.fixture
def folder_with_a_thesis(tmp_path):
    """A folder with a file of somebody else, thesis.txt, and beside it what commands read."""
    write_session(unit_cubes_on_x({"a": [0] * 90, "b": [0, 3, 0.9] * 30}), tmp_path / "s.mcap")
    data = (tmp_path / "s.mcap").read_bytes()
    (tmp_path / "s.torn").write_bytes(data[: len(data) * 9 // 10])
    (tmp_path / "s.csv").write_text(CSV)
    folder = tmp_path / "work"
    folder.mkdir()
    (folder / "thesis.txt").write_text("three years of work")
    return folder


def command_line(name):
    """The command line of a command that writes made.mcap, a session or a run folder, over what stands there."""
    return [sys.executable, "-m", "replay", *COMMANDS[name], "--force"]


def assert_whole(made):
    """Asserts that a path is a session with poses, or a run folder with all files that its summary lists, readable."""
    if made.is_file():
        assert len(read_session(made).frames) > 0
        return
    assert sorted(json.loads((made / "summary.json").read_bytes())["files"]) == sorted(f.name for f in made.iterdir())
    for table in made.glob("*.parquet"):
        pq.read_table(table)


def assert_command_works(name, folder):
    """Asserts that the command writes a whole made.mcap and leaves thesis.txt, and nothing else."""
    process = subprocess.run(
        command_line(name), cwd=folder, env=environment(), capture_output=True, text=True, timeout=300
    )
    success, reported_loss = 0, 3
    assert process.returncode in (success, reported_loss), process.stderr
    assert sorted(file.name for file in folder.iterdir()) == ["made.mcap", "thesis.txt"]
    assert (folder / "thesis.txt").read_text() == "three years of work"
    assert_whole(folder / "made.mcap")


@pytest.mark.parametrize("name", COMMANDS)
@pytest.mark.parametrize("earlier", [False, True], ids=["no earlier output", "earlier output"])
def test_killed_command_leaves_earlier_output_and_the_next_call_works(folder_with_a_thesis, name, earlier):
    """A command is killed up to 30 ms after it began to write a hidden file (.made...) beside its output, made.mcap.

    The output that stands then is whole, the earlier or the new one; only while they change places there is none. The
    same command, called again, works.
    """
    folder = folder_with_a_thesis
    if earlier:
        assert_command_works(name, folder)
    silent = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    process = subprocess.Popen(command_line(name), cwd=folder, env=environment(), **silent)
    while process.poll() is None and not any(folder.glob(".made*")):
        time.sleep(0.0005)
    time.sleep(float(np.random.default_rng([1, earlier, len(name)]).uniform(0, 0.03)))
    process.kill()
    process.wait()
    output = folder / "made.mcap"
    if output.exists():
        assert_whole(output)
    elif earlier:
        assert any(folder.glob(".made*")), "the outputs change places"
    assert_command_works(name, folder)


@pytest.mark.parametrize("name", COMMANDS)
@pytest.mark.parametrize("most_bytes", [4096, 20_000])
def test_full_disk_is_reported_and_changes_nothing(folder_with_a_thesis, name, most_bytes):
    """No file may grow beyond so many bytes: the command ends with one error, exit code 1, and leaves no file.

    Or it needed no more room: it ends with 0, or with 3 after a loss of data that it reports.
    """

    def limit_file_size():
        import resource

        resource.setrlimit(resource.RLIMIT_FSIZE, (most_bytes, most_bytes))

    process = subprocess.run(
        command_line(name),
        cwd=folder_with_a_thesis,
        env=environment(),
        preexec_fn=limit_file_size,
        capture_output=True,
        text=True,
        timeout=300,
    )
    errors = [line for line in process.stderr.splitlines() if line.startswith("error: ")]
    assert "Traceback" not in process.stderr
    if process.returncode == 1:
        assert len(errors) == 1
        assert [file.name for file in folder_with_a_thesis.iterdir()] == ["thesis.txt"]
    else:
        assert process.returncode in (0, 3)
        assert errors == []


NO_HOME = {"HOME": "/dev/null", "XDG_CACHE_HOME": ""}
LOCALE_C = {"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"}


@pytest.mark.parametrize("variables", [NO_HOME, LOCALE_C], ids=["no home", "locale C, no UTF-8"])
def test_import_works_without_home_or_utf_8_in_any_folder(folder_with_a_thesis, variables):
    """Environment variables take away the home folder, or UTF-8; a table of poses is imported.

    The folder's name has spaces, quotes, brackets, a dollar and letters of two scripts.
    """
    folder = folder_with_a_thesis.rename(folder_with_a_thesis.parent / "\u00dcbung $(c) 'd' [red] \u6771")
    process = subprocess.run(
        command_line("import"), cwd=folder, env=environment() | variables, capture_output=True, timeout=300
    )
    assert process.returncode == 0, process.stderr
    assert_whole(folder / "made.mcap")
