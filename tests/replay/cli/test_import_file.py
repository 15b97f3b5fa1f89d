import json

import numpy as np
import pytest
from support.small_worlds import cube, cubes

from replay.cli.main import main
from replay.contact_import import OFFSET_FACT, import_contacts
from replay.errors import AuditError
from replay.pipeline.engine import compute
from replay.prepare.assemble import RESIDUAL_FACT
from sessions import read_session, write_session
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


PLACES = {"a": [0] * 14, "b": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3, 3, 3]}
CSV = "time,a,b,what\n100.04,a,b,begin\n100.04,a,b,end\n100.08,b,a,begin\n100.10,b,a,end\n100.2,a,Floor,begin\n"


@pytest.fixture
def csv(tmp_path):
    path = tmp_path / "engine.csv"
    path.write_text(CSV, encoding="utf-8")
    return path


def test_another_clock_is_fitted_and_the_reports_become_a_detector(csv, tmp_path):
    session, fit = import_contacts(csv, cubes(PLACES))
    assert fit.seconds == pytest.approx(-100.0) and fit.residual == pytest.approx(0.0, abs=1e-9)
    assert (fit.matched, fit.of) == (4, 5)
    assert float(session.facts[OFFSET_FACT]) == pytest.approx(-100.0)
    write_session(session, tmp_path / "s.mcap")
    result = compute(read_session(tmp_path / "s.mcap"), detectors="recorded", oracle="exact")
    assert result.summary["audit"]["recorded"]["missed"]["count"] == 0
    assert result.summary["audit"]["recorded"]["missed"]["of"] == 4


def test_a_given_offset_is_taken_as_it_is(csv):
    session, fit = import_contacts(csv, cubes(PLACES), offset=-99.99)
    assert fit.seconds == -99.99 and fit.residual == pytest.approx(0.01)
    assert float(session.facts[RESIDUAL_FACT]) == pytest.approx(0.01)
    assert session.live_contacts[0].time_ns == 50_000_000


def test_a_file_about_other_bodies_is_refused(tmp_path):
    (tmp_path / "x.csv").write_text("0,x,y,begin\n")
    with pytest.raises(AuditError, match="names no body of the session, which has: a, b"):
        import_contacts(tmp_path / "x.csv", cubes(PLACES))


def test_the_command_line_prints_offset_and_residual(csv, tmp_path, capsys):
    write_session(cubes(PLACES), tmp_path / "s.mcap")
    out = tmp_path / "with.mcap"
    command = ["import", "contacts", str(csv), "-o", str(out)]
    assert main([*command, "--session", str(tmp_path / "s.mcap")]) == 0
    assert "clock offset -100.0000 s, residual 0.0 ms" in capsys.readouterr().err
    assert len(read_session(out).live_contacts) == 5
    assert main([*command, "--force"]) == 2
    assert "--session" in capsys.readouterr().err
