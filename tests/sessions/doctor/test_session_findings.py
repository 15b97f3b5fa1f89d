import subprocess
import sys

from support.planted_faults import FAULTS, clean

from sessions import Scene, Severity
from sessions.doctor.pose_pass import look_through
from sessions.doctor.session_findings import examine_session, frame_findings, scene_findings
from sessions.model.scene import Pose, SceneBody


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
