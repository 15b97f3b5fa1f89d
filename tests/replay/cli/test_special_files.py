"""No reader waits for a FIFO, reads a device without end, or takes a folder or a socket for a file."""

import os
import signal
import socket
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from replay.cli.main import main
from sessions import Session, examine, import_session, load_mesh, read_scene, read_session, recover, write_session
from sessions.errors import SessionError
from sessions.importers.contacts_csv import read_contacts
from sessions.meshes.mesh_match import matched, read_colliders

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="a FIFO and /dev/zero are POSIX")

SECONDS = 20
SPECIAL = ("device", "FIFO", "folder", "socket")


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
def special(tmp_path: Path) -> Callable[[str, str], Path]:
    """A file of a kind under a name of its own, such as a FIFO that is called ``log.csv``."""

    def placed(kind: str, name: str) -> Path:
        path = tmp_path / "special" / name
        path.parent.mkdir(exist_ok=True)
        if kind == "device":
            path.symlink_to("/dev/zero")
        elif kind == "FIFO":
            os.mkfifo(path)
        elif kind == "folder":
            path.mkdir()
        else:
            here = Path.cwd()
            os.chdir(path.parent)  # the name of a socket is at most 108 bytes long
            with socket.socket(socket.AF_UNIX) as server:
                server.bind(name)
            os.chdir(here)
        return path

    return placed


def session_of(path: Path) -> Path:
    times = np.arange(3) * 10_000_000
    still = (np.zeros((3, 3)), np.tile([0.0, 0.0, 0.0, 1.0], (3, 1)))
    write_session(Session.from_arrays(times, {"cup": still}), path)
    return path


READERS: dict[str, tuple[str, Callable[[Path], Any]]] = {
    "a session": ("s.mcap", read_session),
    "a session to be recovered": ("s.mcap", lambda path: recover(path, path.with_name("out.mcap"))),
    "a session to be examined": ("s.mcap", examine),
    "a scene to be examined": ("s.toml", examine),
    "a mesh to be examined": ("s.glb", examine),
    "a scene": ("s.toml", read_scene),
    "a mesh": ("s.glb", load_mesh),
    "meshes of bodies": ("s.glb", lambda path: list(matched(path / "x" if path.is_dir() else path, ["cup"], None))),
    "colliders": ("s.glb", lambda path: read_colliders(path, ["cup"])),
    "contacts": ("s.csv", read_contacts),
    **{
        f"a recording of {kind}": (name, lambda path, kind=kind: import_session(kind, path))
        for kind, name in (
            ("csv", "s.csv"), ("aframe", "s.json"), ("mcap", "s.mcap"), ("ros2", "s.mcap"), ("optitrack", "s.csv"),
            ("xdf", "s.xdf"), ("auto", "s.csv"), ("uxf", "cup_movement_T001.csv"),
        )
    },
}  # fmt: skip
"""What is read -> a file name for it, and the reader."""


@pytest.mark.parametrize("kind", SPECIAL)
@pytest.mark.parametrize("reader", READERS)
def test_a_reader_refuses_what_is_no_regular_file_and_names_it(special, kind, reader):
    name, read = READERS[reader]
    path = special(kind, name)
    if kind == "folder" and "uxf" in reader:
        pytest.skip("a UXF session is a folder")
    with pytest.raises(SessionError) as refusal:
        read(path)
    said = str(refusal.value)
    assert str(path) in said and "\n" not in said
    assert kind in said or kind == "folder"


@pytest.mark.parametrize("kind", ("device", "FIFO", "socket"))
@pytest.mark.parametrize(
    "words",
    (
        ("run", "{session}", "--scene", "{path}", "--out", "{out}"),
        ("run", "{path}", "--out", "{out}"),
        ("info", "{path}"),
        ("doctor", "{path}"),
        ("recover", "{path}", "{out}"),
        ("mesh", "repair", "{path}", "-o", "{out}"),
        ("import", "csv", "{table}", "--mapping", "{path}", "-o", "{out}"),
        ("import", "csv", "{path}", "-o", "{out}"),
        ("import", "contacts", "{path}", "--session", "{session}", "-o", "{out}"),
        ("import", "csv", "{table}", "--mesh", "cup={path}", "-o", "{out}"),
        ("import", "csv", "{table}", "--meshes", "{path}", "-o", "{out}"),
        ("import", "csv", "{table}", "--colliders", "{path}", "-o", "{out}"),
    ),
    ids=" ".join,
)
def test_a_verb_refuses_what_is_no_regular_file_and_writes_nothing(special, tmp_path, capsys, kind, words):
    path, out = special(kind, "given"), tmp_path / "out.mcap"
    table = tmp_path / "log.csv"
    table.write_text("time,cup_x\n0,1\n")
    places = {"path": path, "session": session_of(tmp_path / "s.mcap"), "out": out, "table": table}
    assert main([word.format(**places) for word in words]) in (1, 2)
    said = capsys.readouterr().err
    assert kind in said and "Traceback" not in said and not out.exists()
