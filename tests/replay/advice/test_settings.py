from dataclasses import fields

import pytest

from cdcore.detectors.detector_table import load_detector
from replay.advice.settings import next_to_front, settings_list, settings_of
from replay.detection.detector_spec import parse_detector


def test_tradeoff_tries_compounds_and_recorded_colliders():
    """Recorded (``shipped``) colliders where there are any; compounds of 4 and of 16 pieces always."""
    bare = {setting.label for setting in settings_list()}
    more = {setting.detector_text for setting in settings_list(has_shipped_colliders=True) if setting.label not in bare}
    assert more == {"collider[shape=shipped]"}
    compounds = {setting.detector_text for setting in settings_list() if setting.settings.get("shape") == "compound"}
    assert compounds == {f"collider[shape=compound,pieces={most}]" for most in (4, 16)}


def test_every_setting_exists_and_its_spec_is_accepted():
    """At least 40 settings, each under a label of its own; the text of each reads back as itself."""
    labels = [setting.label for setting in settings_list()]
    assert len(labels) == len(set(labels)) >= 40
    for setting in settings_list():
        detector = load_detector(setting.detector)
        assert set(setting.settings) <= {item.name for item in fields(detector.Settings)}, setting.label
        detector.Settings(**setting.settings)
        again = parse_detector(setting.detector_text)
        assert (again.name, dict(again.settings)) == (setting.detector, dict(setting.settings))


def test_first_eleven_settings_cover_each_family():
    """Listed first, in case time is short: exact, FCL, the paper's search, five shapes and three step rates."""
    head = settings_list()[:11]
    assert {setting.detector for setting in head} == {"exact", "hybrid", "hybrid-qaco", "collider"}
    assert {"box", "capsule", "sphere", "hull", "mesh"} <= {setting.settings.get("shape") for setting in head}
    assert {10, 22.5, 50} <= {setting.rate_hz for setting in head}


def test_step_as_fast_as_recording_adds_no_setting():
    """A headset of 90 Hz records 89.94 frames a second: a step of 90 Hz sees them all, as no step (None) does."""
    rates_tried = {setting.rate_hz for setting in settings_list()}
    rates_of_recording = {setting.rate_hz for setting in settings_list(frames_hz=89.94)}
    assert 90 in rates_tried
    assert rates_of_recording == {rate for rate in rates_tried if rate is None or rate < 89}


def test_next_candidates_are_neighbours_of_the_front():
    """The front has exact and meshes at 50 Hz: meshes at other step rates come next, of them the nearest."""
    every = settings_list()
    untried = [setting for setting in every if setting.label != "meshes at 50 Hz"]
    nearest = next_to_front(untried, every, ["exact", "meshes at 50 Hz"])[:3]
    assert [setting.line for setting in nearest] == ["meshes at a step rate"] * 3
    assert {setting.rate_hz for setting in nearest} <= {30, 45, 60, 72}


@pytest.mark.parametrize(
    ("spec", "complete"),
    [
        ("exact", True), ("exact[containment=false]", False), ("hybrid", True),
        ("discrete", True), ("discrete[rate_hz=22.5]", False), ("static[epsilon=0.01]", False), ("sphere", False),
        ("solid-style[budget=30]", False), ("collider", False), ("collider[shape=mesh]", True), ("hybrid-qaco", False),
        ("hybrid-qaco[decide=mesh]", True), ("continuous", False), ("package.module:Class", False),
    ],
)  # fmt: skip
def test_complete_setting_tests_all_faces_in_every_frame(spec, complete):
    """Step rates leave out frames; budgets, tolerances, balls, hulls and an unasked inside leave out faces."""
    (setting,) = settings_of(f"it={spec}")
    assert setting.complete == complete and setting.label == "it" == setting.spec.label
