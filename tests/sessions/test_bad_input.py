"""One table of what no reader and no function takes, `bad_input.toml`: each row ends in one sentence."""

import re
import tomllib
from functools import partial
from pathlib import Path

import pytest

from sessions import MeshData, Recorder, Session, Track, make_shape
from sessions.errors import SessionError
from sessions.glassware.catalogue import make_instrument
from sessions.importers import import_session
from sessions.importers.contacts_csv import read_contacts
from sessions.importers.csv_columns_and_units import read_mapping
from sessions.importers.ledger import Ledger
from sessions.mcap.metadata import names_of
from sessions.mcap.reader import read_session
from sessions.meshes.conventions import quaternion_from_euler
from sessions.meshes.mesh_files import load_mesh
from sessions.model.scene import Scene, SceneBody
from sessions.model.session import HandTrack
from sessions.scene_files.scene_meshes import scene_meshes
from sessions.scene_files.scene_toml import read_scene
from sessions.synthetic.assembly import Recording

TABLE = tomllib.loads(Path(__file__).with_name("bad_input.toml").read_text(encoding="utf-8"))
MAPPING = """
convention = "gltf"
[time]
column = "t"
unit = "s"
[bodies.a]
position = ["x", "y", "y"]
quaternion_xyzw = ["x", "x", "x", "x"]
"""
READERS = {
    "scene": ("scene.toml", read_scene),
    "mapping": ("map.toml", read_mapping),
    "contacts": ("contacts.csv", lambda path: read_contacts(path, Ledger(path))),
    "csv": ("take.csv", partial(import_session, "csv")),
    "mapped csv": ("take.csv", lambda path: import_session("csv", path, mapping=path.with_name("m.toml"))),
    "aframe": ("take.json", partial(import_session, "aframe")),
    "optitrack": ("take.csv", partial(import_session, "optitrack")),
    "auto": ("take", partial(import_session, "auto")),
    "session": ("take.mcap", read_session),
    "obj": ("take.obj", load_mesh),
    "stl": ("take.stl", load_mesh),
    "fbx": ("take.fbx", load_mesh),
    "names": ("take.mcap", lambda path: names_of({"names": path.read_text()}, path)),
}
"""Reader -> name of its file, and the function that reads it."""
DIGITS = {"reader": "scene", "old": "mass = 0.1", "words": "a number.* thousands of digits"}
ENDLESS = [
    {**DIGITS, "new": "mass = " + "9" * 5000},
    {**DIGITS, "new": "mass = 0x" + "f" * 5000},
    {"reader": "scene", "text": "a = " + "[" * 100_000, "words": "nested too deeply"},
    {"reader": "aframe", "text": "[" * 100_000, "words": "this is not JSON"},
]


CASES = [*TABLE["case"], *ENDLESS]


def refusal(function, *arguments, **options):
    """The sentence of the error that a function raises, or nothing."""
    try:
        function(*arguments, **options)
    except SessionError as error:
        return str(error)
    return ""


def data_of(case):
    """The bytes of a row of the table: as written, or a good file with a change."""
    if "hex" in case:
        return bytes.fromhex(case["hex"])
    if "text" in case:
        return case["text"].encode()
    good = TABLE["good"][case["reader"]]
    assert case["old"] in good
    return good.replace(case["old"], case["new"], -1 if case["reader"] == "optitrack" else 1).encode()


@pytest.mark.parametrize("reader", READERS)
def test_bad_files_are_refused_in_a_sentence_with_their_cure(tmp_path, reader):
    """Each case of a reader is a wrong file, and words that the error must hold; the error also names the file."""
    name, read = READERS[reader]
    path = tmp_path / name
    cases = [case for case in CASES if case["reader"] == reader]
    assert cases
    for case in cases:
        path.write_bytes(data_of(case))
        (tmp_path / "m.toml").write_text(case.get("mapping", MAPPING))
        message = refusal(read, path)
        assert re.search(case["words"], message), (case["words"], message)
        assert case.get("names", name) in message, (case["words"], message)
        assert message.isprintable(), (case["words"], message)


def test_every_case_has_a_reader():
    """A case of another reader would be read by no test."""
    assert {case["reader"] for case in CASES} <= {*READERS}


@pytest.mark.parametrize("reader", TABLE["good"])
def test_unchanged_originals_of_wrong_files_are_read(tmp_path, reader):
    """Each reader has a good file, in which the cases above change a piece: what it reads is not empty."""
    name, read = READERS[reader]
    (tmp_path / name).write_bytes(TABLE["good"][reader].encode())
    assert read(tmp_path / name)


def call_while_recording(folder, method, *arguments, **options):
    """Raises the error of a recorder's method that is called between two frames, both of which must be recorded."""
    with Recorder(folder / "s.mcap") as recorder:
        recorder.poses(1, {"cup": POSE})
        with pytest.raises(SessionError) as raised:
            getattr(recorder, method)(*arguments, **options)
        recorder.poses(2, {"cup": POSE})
    assert read_session(folder / "s.mcap").frames.stamp_ns.tolist() == [1, 2]
    raise raised.value


POSE = ((0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))
CALLS = {
    "mesh": MeshData, "euler angles": quaternion_from_euler, "track": Track, "hand": HandTrack, "shape": make_shape,
    "session": Session.from_arrays, "instrument": make_instrument, "made-up session": Recording,
}  # fmt: skip


def test_invalid_arguments_are_refused_in_a_sentence(tmp_path):
    """A case of bad_input.toml has a function (``of``; behind "record" a recorder's method), arguments and error.

    A recorder goes on after the error.
    """
    for number, case in enumerate(TABLE["call"]):
        folder = tmp_path / str(number)
        folder.mkdir()
        function, _, method = case["of"].partition("record ")
        calls = CALLS | {
            "": partial(call_while_recording, folder, method),
            "body of a scene": lambda **body: scene_meshes(Scene(bodies=(SceneBody(**body),)), tmp_path),
        }
        message = refusal(calls[function], *case.get("given", ()), **case.get("options", {}))
        assert re.search(case["words"], message), (case["of"], case["words"], message)
        assert message.isprintable(), (case["of"], message)
