"""Settings that a tradeoff tries, and their order."""

from dataclasses import fields

import pytest

from cdcore.detectors.detector_table import load_detector
from replay.advice.settings import next_to_front, settings_list, settings_of
from replay.detection.detector_spec import parse_detector


def test_tradeoff_tries_recorded_colliders():
    """Colliders that were recorded with the bodies are called ``shipped``; just they are added to the settings."""
    usual = {setting.detector_text for setting in settings_list()}
    with_recorded = {setting.detector_text for setting in settings_list(has_shipped_colliders=True)}
    assert with_recorded - usual == {"collider[shape=shipped]"}


def test_tradeoff_tries_compounds_of_4_and_16_pieces():
    """A compound is a body cut into convex pieces: up to 4 and up to 16, and no other number, are tried."""
    compounds = {setting.detector_text for setting in settings_list() if setting.settings.get("shape") == "compound"}
    assert compounds == {"collider[shape=compound,pieces=4]", "collider[shape=compound,pieces=16]"}


def test_every_setting_has_a_label_of_its_own():
    """A tradeoff tries 40 settings at least, with as many labels."""
    labels = [setting.label for setting in settings_list()]
    assert len(labels) >= 40
    assert len(set(labels)) == len(labels)


def test_every_setting_is_accepted_by_its_detector():
    """Its detector exists and has these settings; its text, as a command has it, reads back as the same."""
    for setting in settings_list():
        detector = load_detector(setting.detector)
        assert set(setting.settings) <= {item.name for item in fields(detector.Settings)}, setting.label
        detector.Settings(**setting.settings)
        parsed = parse_detector(setting.detector_text)
        assert (parsed.name, dict(parsed.settings)) == (setting.detector, dict(setting.settings))


def test_first_eleven_settings_cover_each_family():
    """Settings are tried in their order until the time is up, so that the first are as different as can be.

    Detectors: all triangles (exact), FCL (hybrid), the ant colony search (hybrid-qaco) and colliders; five shapes of
    colliders; three step rates in Hz.
    """
    first_settings = settings_list()[:11]
    assert {setting.detector for setting in first_settings} == {"exact", "hybrid", "hybrid-qaco", "collider"}
    shapes = {setting.settings.get("shape") for setting in first_settings}
    assert shapes >= {"box", "capsule", "sphere", "hull", "mesh"}
    assert {setting.rate_hz for setting in first_settings} >= {10, 22.5, 50}


def test_step_as_fast_as_recording_adds_no_setting():
    """A headset of 90 Hz records 89.94 frames a second: a step of 90 Hz sees them all, as no step rate does.

    So the settings for such a recording have only the slower steps, and none (None).
    """
    all_rates = {setting.rate_hz for setting in settings_list()}
    rates_of_recording = {setting.rate_hz for setting in settings_list(frames_hz=89.94)}
    assert 90 in all_rates
    assert rates_of_recording == {rate for rate in all_rates if rate is None or rate < 89}


def test_next_candidates_are_neighbours_of_the_front():
    """So far nothing is both quicker and more accurate than exact and meshes at 50 Hz, which are the front.

    Next are settings of the same family, meshes at a step rate: the two rates beside 50 Hz, and one of those beyond.
    """
    settings = settings_list()
    untried = [setting for setting in settings if setting.label != "meshes at 50 Hz"]
    next_settings = next_to_front(untried, settings, ["exact", "meshes at 50 Hz"])[:3]
    assert [setting.line for setting in next_settings] == ["meshes at a step rate"] * 3
    assert {45, 60} < {setting.rate_hz for setting in next_settings} < {30, 45, 60, 72}


@pytest.mark.parametrize(
    ("spec", "is_complete"),
    [
        pytest.param("exact", True, id="exact: all triangles"),
        pytest.param("exact[containment=false]", False, id="exact: bodies inside others are not found"),
        pytest.param("hybrid", True, id="hybrid: all triangles by FCL"),
        pytest.param("discrete", True, id="discrete: all triangles"),
        pytest.param("discrete[rate_hz=22.5]", False, id="discrete: a step rate leaves out frames"),
        pytest.param("static[epsilon=0.01]", False, id="static: a tolerance"),
        pytest.param("sphere", False, id="sphere: bounding spheres"),
        pytest.param("solid-style[budget=30]", False, id="solid-style: a budget of triangles"),
        pytest.param("collider", False, id="collider: hulls"),
        pytest.param("collider[shape=mesh]", True, id="collider: the meshes themselves"),
        pytest.param("hybrid-qaco", False, id="hybrid-qaco: a search"),
        pytest.param("hybrid-qaco[decide=mesh]", True, id="hybrid-qaco: a search, then all triangles"),
        pytest.param("continuous", False, id="continuous: the way between frames"),
        pytest.param("package.module:Class", False, id="a class of a user"),
    ],
)
def test_complete_setting_tests_all_faces_in_every_frame(spec, is_complete):
    """A setting is complete if it decides by all triangles of both bodies, in every frame, the inside included."""
    (setting,) = settings_of(f"it={spec}")
    assert setting.complete == is_complete


def test_setting_of_a_command_has_its_label():
    """``it=...`` calls the setting "it", and its detector too."""
    (setting,) = settings_of("it=exact")
    assert (setting.label, setting.spec.label) == ("it", "it")
