from sessions import Scene, Severity
from sessions.doctor.scene_faults import scene_findings
from sessions.scene import Pose, SceneBody


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
