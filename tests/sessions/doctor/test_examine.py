import subprocess
import sys

import pytest
from support.planted_faults import FAULTS, clean
from support.small_worlds import cube

from sessions import Scene, Severity, examine
from sessions.doctor.pose_pass import look_through
from sessions.doctor.session_findings import examine_session, frame_findings, scene_findings
from sessions.errors import SessionFileError
from sessions.meshes.glb import mesh_to_glb
from sessions.model.scene import Pose, SceneBody


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


def test_a_session_is_examined_without_loading_a_container():
    code = "import sys, sessions.doctor.session_findings; print('mcap' in sys.modules, 'trimesh' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "False"]


def test_a_pass_that_was_made_already_is_used():
    draft = clean()
    FAULTS["frozen pose"](draft, 1, 300)
    session = draft.session()
    looked = look_through([session.frames])
    found = [*examine_session(session, looked)]
    assert found == [*examine_session(session)]
    assert [one for one in frame_findings(looked, session.scene, {}) if one not in found] == []
    assert "frozen" in {one.code for one in found}


def said(scene, names, meshes):
    return {(one.code, one.body, one.severity) for one in scene_findings(scene, names, meshes)}


def test_a_scene_that_fits_its_recording_has_nothing_wrong():
    scene = Scene(bodies=(SceneBody("a"), SceneBody("table", fixed=Pose())), pairs=(("a", "table"),))
    assert said(scene, ["a"], ["a", "table"]) == set()


def test_what_was_declared_but_not_recorded_and_the_other_way_round_is_named():
    scene = Scene(
        bodies=(SceneBody("a", proxy=True), SceneBody("b"), SceneBody("c", parent="gone", fixed=Pose())),
        pairs=(("a", "d"),),
    )
    assert said(scene, ["a", "e"], ["a", "c"]) == {
        ("proxy", "a", Severity.NOTE),
        ("unrecorded-body", "b", Severity.WARNING),
        ("unrecorded-body", "c", Severity.ERROR),
        ("unrecorded-body", "d", Severity.WARNING),
        ("undeclared-body", "e", Severity.NOTE),
        ("no-mesh", "e", Severity.NOTE),
    }
