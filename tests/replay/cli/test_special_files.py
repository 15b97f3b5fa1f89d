"""No verb waits for a FIFO, reads a device without end, or takes a socket for a file."""

import os
import signal
import socket
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from support.small_worlds import unit_cubes_on_x

from replay.cli.main import main
from sessions import write_session

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="a FIFO and /dev/zero are POSIX")

SECONDS = 20


@pytest.fixture(autouse=True)
def alarm() -> Iterator[None]:
    """A reader that waits or reads for ever fails, instead of holding up the tests."""

    def late(*_: Any) -> None:
        raise TimeoutError(f"still reading after {SECONDS} s")

    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(SECONDS)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)


@pytest.fixture
def make_irregular_file(tmp_path: Path) -> Callable[[str, str], Path]:
    """Makes a file of a kind under a name of its own, such as a FIFO that is called ``log.csv``."""

    def placed(kind: str, name: str) -> Path:
        path = tmp_path / "special" / name
        path.parent.mkdir(exist_ok=True)
        if kind == "device":
            path.symlink_to("/dev/zero")
        elif kind == "FIFO":
            os.mkfifo(path)
        else:
            here = Path.cwd()
            os.chdir(path.parent)  # the name of a socket is at most 108 bytes long
            with socket.socket(socket.AF_UNIX) as server:
                server.bind(name)
            os.chdir(here)
        return path

    return placed


@pytest.fixture(scope="module")
def session_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of a cup in 3 frames, which verbs only read."""
    path = tmp_path_factory.mktemp("recording") / "s.mcap"
    write_session(unit_cubes_on_x({"cup": [0.0] * 3}), path)
    return path


FORMATS = ("csv", "aframe", "mcap", "ros2", "optitrack", "xdf", "auto")


@pytest.mark.sampled(2)
@pytest.mark.parametrize("kind", ("device", "FIFO", "socket"))
@pytest.mark.parametrize(
    "arguments",
    (
        ("run", "{session}", "--scene", "{path}", "--out", "{out}"),
        ("run", "{path}", "--out", "{out}"),
        ("info", "{path}"),
        ("doctor", "{path}"),
        ("recover", "{path}", "{out}"),
        ("mesh", "repair", "{path}", "-o", "{out}"),
        ("import", "csv", "{table}", "--mapping", "{path}", "-o", "{out}"),
        *(("import", kind, "{path}", "-o", "{out}") for kind in FORMATS),
        ("scene", "check", "{path}"),
        ("scene", "new", "{path}", "-o", "{out}"),
        ("import", "contacts", "{path}", "--session", "{session}", "-o", "{out}"),
        ("import", "csv", "{table}", "--mesh", "cup={path}", "-o", "{out}"),
        ("import", "csv", "{table}", "--meshes", "{path}", "-o", "{out}"),
        ("import", "csv", "{table}", "--colliders", "{path}", "-o", "{out}"),
    ),
    ids=" ".join,
)
def test_verb_refuses_irregular_files_and_writes_nothing(
    make_irregular_file, session_file, tmp_path, capsys, kind, arguments
):
    """``arguments``: of a command that takes a file at {path}, which is of a ``kind`` that cannot be read to an end.

    It fails (1) or is a wrong call (2), before an alarm after 20 s, and the error says which kind of file it is.
    """
    path, out = make_irregular_file(kind, "given"), tmp_path / "out.mcap"
    table = tmp_path / "log.csv"
    table.write_text("time,cup_x\n0,1\n")
    files = {"path": path, "session": session_file, "out": out, "table": table}
    assert main([word.format(**files) for word in arguments]) in (1, 2)
    output = capsys.readouterr().err
    assert kind in output and "Traceback" not in output
    assert not out.exists()
