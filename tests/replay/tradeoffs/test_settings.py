from dataclasses import fields

from cdcore.detectors import DETECTORS, load_detector
from replay.tradeoffs.settings import ASKED, settings_list


def test_the_list_holds_every_detector_and_every_axis_once():
    tried = settings_list()
    assert {one.detector for one in tried} == set(DETECTORS)
    axes = {
        "step rate", "shape", "mesh resolution", "tolerance", "samples", "budget", "booleans or faces",
    }  # fmt: skip
    assert axes <= {one.axis for one in tried}
    labels = [one.label for one in tried]
    assert len(labels) == len(set(labels)) >= 40


def test_every_setting_is_one_its_detector_has():
    for one in settings_list():
        detector = load_detector(one.detector)
        assert set(one.settings) <= {item.name for item in fields(detector.Settings)}, one.label
        detector.Settings(**one.settings)


def test_each_point_of_a_line_turns_one_axis_of_one_detector():
    for one in settings_list():
        assert one.line.startswith(one.detector) and (one.axis in one.line) == (one.axis != "as it comes")
        assert one.spec.name == one.detector and dict(one.spec.settings) == dict(one.settings)


def test_whoever_is_asked_for_faces_is_asked_for_booleans_with_the_same_settings():
    asked = [one for one in settings_list() if one.axis == ASKED]
    booleans, faces = ([one for one in asked if one.faces is wanted] for wanted in (False, True))
    assert [one.spec for one in booleans] == [one.spec for one in faces] and len(faces) >= 3
    assert {one.line for one in booleans} == {one.line for one in faces}
    assert f"{faces[0].detector} faces" == faces[0].label


def test_what_a_short_time_limit_leaves_advises_on_engines_colliders_and_a_live_loop():
    head = settings_list()[:33]
    assert {"hybrid", "exact", "discrete", "collider", "solid-style"} <= {one.detector for one in head}
    assert {"step rate", "shape", "mesh resolution", "budget"} <= {one.axis for one in head}
    assert len([one for one in head if one.detector == "discrete"]) >= 3
