import json

import numpy as np
import pytest
from support.mcap_samples import protobuf_messages, write_foreign
from support.small_worlds import cube, cubes

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


def test_what_was_assumed_is_said_unless_it_was_given(tmp_path, capsys):
    source = tmp_path / "foreign.mcap"
    write_foreign(source, protobuf_messages(cubes({"cup": [0, 1, 2]}).frames))
    words = ["import", "mcap", str(source), "-o", str(tmp_path / "s.mcap"), "--force"]
    assert main([*words, "--topic", "/tf"]) == 0
    said = capsys.readouterr().err
    assert "assumed: axes ros" in said and "name other axes with --convention" in said
    assert main([*words, "--convention", "openxr"]) == 0 and "axes ros" not in capsys.readouterr().err
    assert main([*words, "--topic", "/other"]) == 1 and "/other" in capsys.readouterr().err


@pytest.mark.parametrize("reported", [True, False])
def test_after_a_csv_with_an_engines_reports_comes_their_audit(tmp_path, capsys, reported):
    rows = ["kind,time,body,px,py,pz,qx,qy,qz,qw,tracked,other,value", "pose,0,Cup,0,0,0,0,0,0,1,1,,"]
    rows += ["enter,0,Cup,,,,,,,,,Hand,"] * reported
    (tmp_path / "unity.csv").write_text("\n".join([*rows, ""]))
    out = tmp_path / "s.mcap"
    assert main(["import", "csv", str(tmp_path / "unity.csv"), "-o", str(out)]) == 0
    words = f"what the engine reported is in it; compare it: replay run {out} --out runs/s\n"
    assert (words in capsys.readouterr().err) == reported
