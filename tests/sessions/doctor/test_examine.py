import pytest
from support.planted_faults import clean
from support.small_worlds import cube

from sessions import examine
from sessions.errors import SessionFileError
from sessions.meshes.glb import mesh_to_glb


def codes(path):
    return [one.code for one in examine(path)]


def test_a_missing_file_is_an_error_and_not_a_finding(tmp_path):
    with pytest.raises(SessionFileError, match="check the path"):
        examine(tmp_path / "none.mcap")


def test_whatever_is_in_a_file_becomes_findings(tmp_path):
    (tmp_path / "empty.mcap").write_bytes(b"")
    (tmp_path / "text.mcap").write_bytes(b"not an MCAP")
    (tmp_path / "magic.mcap").write_bytes(b"\x89MCAP0\r\n")
    (tmp_path / "broken.glb").write_bytes(b"glTF????")
    (tmp_path / "scene.toml").write_text("[[body]]\nid = 3\n")
    assert codes(tmp_path / "empty.mcap") == codes(tmp_path / "text.mcap") == ["not-mcap"]
    assert codes(tmp_path / "magic.mcap") == ["torn", "no-poses"]
    assert codes(tmp_path / "broken.glb") == ["mesh-unreadable"]
    assert codes(tmp_path / "scene.toml") == ["bad-scene"]


def test_a_mesh_and_a_scene_are_examined_by_themselves(tmp_path):
    (tmp_path / "cube.glb").write_bytes(mesh_to_glb(cube(0.1), "cube"))
    (tmp_path / "scene.toml").write_text('[[body]]\nid = "cube"\nmesh = "cube.glb"\n')
    assert codes(tmp_path / "cube.glb") == [] == codes(tmp_path / "scene.toml")


def test_memory_and_file_give_the_same_findings(tmp_path):
    draft = clean()
    draft.arrays["position"][300, 1] = float("nan")
    assert examine(draft.session()) == examine(draft.write(tmp_path / "a.mcap"))
