"""`replay mesh repair`: the file and the steps."""

import json

import numpy as np
import pytest
from support.small_worlds import cube, cubes

from replay.cli.main import main
from sessions import load_mesh, write_session
from sessions.mesh_data import MeshData, is_closed
from sessions.meshes.glb import mesh_to_glb


@pytest.fixture
def folder(tmp_path):
    held = cubes({"a": [0] * 6, "b": [3] * 6})
    open_cube = MeshData(cube().vertices, [f for f in cube().faces if cube().vertices[f, 0].min() < 0.5])
    held.meshes["a"] = open_cube
    write_session(held, tmp_path / "s.mcap")
    (tmp_path / "a.glb").write_bytes(mesh_to_glb(open_cube, "a"))
    return tmp_path


def test_a_mesh_is_mended_by_itself_or_out_of_a_recording(folder, capsys):
    out = folder / "x" / "m.glb"
    assert main(["mesh", "repair", str(folder / "a.glb"), "-o", str(out), "--format", "json"]) == 0
    assert json.loads(capsys.readouterr().out)["done"] == ["1 hole closed"]
    assert is_closed(load_mesh(out)) and np.isclose(load_mesh(out).volume, 1.0)
    for body, said in (("a", "1 hole closed\n"), ("b", "nothing to mend\n")):
        assert main(["mesh", "repair", str(folder / "s.mcap"), "--body", body, "-o", str(folder / f"{body}2.glb")]) == 0
        assert capsys.readouterr().err == said
    assert main(["mesh", "repair", str(folder / "a.glb"), "-o", str(folder / "a.glb")]) == 1
    assert "exists; name another file" in capsys.readouterr().err


def test_a_mesh_of_a_recording_needs_the_name_of_its_body(folder, capsys):
    words = ["mesh", "repair", str(folder / "s.mcap"), "-o", str(folder / "y.glb")]
    assert main(words) == 2 and main([*words, "--body", "c"]) == 1
    assert "holds no mesh of 'c'; there are: a, b" in capsys.readouterr().err
