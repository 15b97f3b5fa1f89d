import json

import numpy as np
import pytest
from mcap.writer import Writer
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


def test_auto_says_what_it_takes_a_file_for_and_why(tmp_path, capsys):
    source = aframe(tmp_path / "m.json")
    assert main(["import", "auto", str(source), "-o", str(tmp_path / "s.mcap")]) == 0
    assert "taken for aframe, because it is JSON\n" in capsys.readouterr().err
    assert main(["import", "aframe", str(source), "-o", str(tmp_path / "s.mcap"), "--force"]) == 0
    assert "taken for" not in capsys.readouterr().err


def test_stand_in_meshes_are_said_to_be_stand_ins(tmp_path, capsys):
    source = aframe(tmp_path / "m.json")
    assert main(["import", "aframe", str(source), "-o", str(tmp_path / "s.mcap")]) == 0
    said = capsys.readouterr().err
    assert "proxy meshes stand in for: left, right" in said
    converted = read_session(tmp_path / "s.mcap").facts.get("conversions", "none")
    assert ("converted" in said) == (converted != "none") and (converted == "none" or f"converted: {converted}" in said)


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


def test_what_was_assumed_is_said_unless_it_was_given(tmp_path, capsys):
    source = tmp_path / "foreign.mcap"
    with source.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema("foxglove.FrameTransform", "jsonschema", b"{}")
        for topic in ("/tf", "/other"):
            channel = writer.register_channel(topic, "json", schema)
            for stamp in (1, 2):
                pose = {
                    "child_frame_id": topic,
                    "translation": dict.fromkeys("xyz", 0),
                    "rotation": {"x": 0, "y": 0, "z": 0, "w": 1},
                }
                writer.add_message(channel, stamp, json.dumps(pose).encode(), stamp)
        writer.finish()
    out = str(tmp_path / "s.mcap")
    assert main(["import", "mcap", str(source), "-o", out, "--topic", "/tf"]) == 0
    assert "2 frames of tf\n" in (said := capsys.readouterr().err)
    assert "assumed: axes ros" in said and "name other axes with --convention" in said
    assert main(["import", "mcap", str(source), "-o", out, "--force", "--convention", "openxr"]) == 0
    assert "of tf, other" in (said := capsys.readouterr().err) and "axes ros" not in said


def test_an_unknown_format_is_answered_with_those_there_are(tmp_path, capsys):
    source = aframe(tmp_path / "m.json")
    assert main(["import", "fbx", str(source), "-o", str(tmp_path / "s.mcap")]) == 1
    assert "aframe, csv" in capsys.readouterr().err


@pytest.mark.parametrize("reported", [True, False])
def test_after_a_csv_with_an_engines_reports_comes_their_audit(tmp_path, capsys, reported):
    rows = ["kind,time,body,px,py,pz,qx,qy,qz,qw,tracked,other,value", "pose,0,Cup,0,0,0,0,0,0,1,1,,"]
    rows += ["enter,0,Cup,,,,,,,,,Hand,"] * reported
    (tmp_path / "unity.csv").write_text("\n".join([*rows, ""]))
    out = tmp_path / "s.mcap"
    assert main(["import", "csv", str(tmp_path / "unity.csv"), "-o", str(out)]) == 0
    words = f"what the engine reported is in it; compare it: replay run {out} --out runs/s\n"
    assert (words in capsys.readouterr().err) == reported
