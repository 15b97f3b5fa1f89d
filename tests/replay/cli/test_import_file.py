import json

import numpy as np
from support.small_worlds import cube

from replay.cli.main import main
from sessions import read_session
from sessions.meshes.glb import mesh_to_glb


def aframe(path, frames=20):
    def pose(k, x):
        place = {"x": x + 0.01 * k, "y": 1.0, "z": 0.0}
        return {"timestamp": 1000.0 + 11.1 * k, "position": place, "rotation": {"x": 0, "y": 10, "z": 0}}

    devices = {name: {"poses": [pose(k, x) for k in range(frames)]} for name, x in (("left", 0.0), ("right", 0.5))}
    path.write_text(json.dumps(devices))
    return path


def test_a_motion_capture_with_meshes_becomes_a_session_file(tmp_path, capsys):
    source, out = aframe(tmp_path / "m.json"), tmp_path / "deep" / "s.mcap"
    (tmp_path / "wand.glb").write_bytes(mesh_to_glb(cube(0.1), "wand"))
    meshes = [f"--mesh={side}={tmp_path / 'wand.glb'}" for side in ("left", "right")]
    assert main(["import", "aframe", str(source), "-o", str(out), *meshes]) == 0
    printed, said = capsys.readouterr()
    assert printed == f"{out}\n" and "20 frames of left, right" in said
    session = read_session(out)
    assert set(session.meshes) == {"left", "right"} and len(session.frames) == 20
    assert np.allclose(session.frames.position[0, 1], [0.5, 1.0, 0.0])


def test_json_says_where_the_session_lies_and_what_was_said(tmp_path, capsys):
    source, out = aframe(tmp_path / "m.json"), tmp_path / "s.mcap"
    assert main(["import", "aframe", str(source), "-o", str(out), "--format", "json"]) == 0
    printed, said = capsys.readouterr()
    told = json.loads(printed)
    assert (told["out"], told["frames"], told["bodies"]) == (str(out), 20, ["left", "right"])
    assert told["notes"] == said.splitlines() and "proxy meshes stand in for: left, right" in said


def test_stand_in_meshes_are_said_to_be_stand_ins(tmp_path, capsys):
    source = aframe(tmp_path / "m.json")
    assert main(["import", "aframe", str(source), "-o", str(tmp_path / "s.mcap")]) == 0
    assert "proxy meshes stand in for: left, right" in capsys.readouterr().err


def test_a_file_in_the_way_is_kept_unless_forced(tmp_path, capsys):
    source, out = aframe(tmp_path / "m.json"), tmp_path / "s.mcap"
    out.write_text("precious")
    assert main(["import", "aframe", str(source), "-o", str(out)]) == 1
    assert out.read_text() == "precious" and "--force" in capsys.readouterr().err
    assert main(["import", "aframe", str(source), "-o", str(out), "--force"]) == 0


def test_a_mesh_option_must_name_body_and_file(tmp_path, capsys):
    source = aframe(tmp_path / "m.json")
    for text, words in (("left", "is not BODY=FILE"), ("left=nowhere.glb", "does not exist")):
        assert main(["import", "aframe", str(source), "-o", str(tmp_path / "s.mcap"), "--mesh", text]) == 2
        assert words in capsys.readouterr().err


def test_an_option_of_another_format_is_refused_by_name(tmp_path, capsys):
    source = aframe(tmp_path / "m.json")
    assert main(["import", "aframe", str(source), "-o", str(tmp_path / "s.mcap"), "--convention", "unity"]) == 1
    assert "has no option 'convention'" in capsys.readouterr().err


def test_an_unknown_format_is_answered_with_those_there_are(tmp_path, capsys):
    source = aframe(tmp_path / "m.json")
    assert main(["import", "fbx", str(source), "-o", str(tmp_path / "s.mcap")]) == 1
    assert "aframe, csv" in capsys.readouterr().err
