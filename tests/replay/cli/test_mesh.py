"""`replay mesh repair`: the file, the steps, and the contacts that change, counted."""

import json

import numpy as np
import pytest
from support.small_worlds import cube, cubes

from replay.cli.main import main
from sessions import load_mesh, write_session
from sessions.mesh_data import MeshData, is_closed
from sessions.meshes.glb import mesh_to_glb

PLACES = {"a": [0] * 6, "b": [3, 3, 0.9, 0.2, 3, 3]}


@pytest.fixture
def session(tmp_path):
    held = cubes(PLACES)
    # The cube without the side that looks at b, and b small enough to go in by there.
    open_cube = MeshData(cube().vertices, [f for f in cube().faces if cube().vertices[f, 0].min() < 0.5])
    held.meshes["a"] = open_cube
    held.meshes["b"] = MeshData(0.1 * cube().vertices, cube().faces)
    write_session(held, tmp_path / "s.mcap")
    (tmp_path / "a.glb").write_bytes(mesh_to_glb(open_cube, "a"))
    return tmp_path


def test_a_mended_mesh_changes_as_many_pair_frames_as_are_said(session, capsys):
    # Closed, it holds b at 0.2: inside. At 0.9 b hovers before it.
    out = session / "mended.glb"
    assert main(["mesh", "repair", str(session / "s.mcap"), "--body", "a", "-o", str(out)]) == 0
    said = capsys.readouterr()
    assert said.out.splitlines() == [
        str(out), "1 of 6 pair-frames of a change: 1 become contact, 0 are none any more",
    ]  # fmt: skip
    assert said.err.splitlines()[0] == "1 hole closed" and is_closed(load_mesh(out))
    given = ["mesh", "repair", str(session / "a.glb"), "--session", str(session / "s.mcap"), "--body", "a"]
    given += ["--format", "json"]
    assert main([*given, "-o", str(session / "again.glb")]) == 0
    plain = json.loads(capsys.readouterr().out)
    assert plain["contacts"] == {"pair_frames": 6, "new": 1, "gone": 0} and plain["done"] == ["1 hole closed"]
    assert main(["mesh", "repair", str(session / "s.mcap"), "--body", "b", "-o", str(session / "b.glb")]) == 0
    said = capsys.readouterr()
    assert "0 of 6 pair-frames of b change\n" in said.out and "nothing to mend" in said.err


def test_a_mesh_by_itself_is_mended_without_a_recording(session, capsys):
    assert main(["mesh", "repair", str(session / "a.glb"), "-o", str(session / "a.glb")]) == 1
    assert "exists; name another file" in capsys.readouterr().err
    assert main(["mesh", "repair", str(session / "a.glb"), "-o", str(session / "x" / "m.glb"), "--format", "json"]) == 0
    assert json.loads(capsys.readouterr().out)["contacts"] is None
    assert np.isclose(load_mesh(session / "x" / "m.glb").volume, 1.0)
    assert main(["mesh", "repair", str(session / "s.mcap"), "-o", str(session / "y.glb")]) == 2
    assert main(["mesh", "repair", str(session / "s.mcap"), "--body", "c", "-o", str(session / "y.glb")]) == 1
    assert "holds no mesh of 'c'; there are: a, b" in capsys.readouterr().err
