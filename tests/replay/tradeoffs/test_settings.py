from dataclasses import fields

import pytest

from cdcore.detectors import DETECTORS, load_detector
from replay.tradeoffs import settings as listing
from replay.tradeoffs.settings import AS_IT_COMES, ASKED, Setting, settings_list, settings_of


def test_compounds_are_listed_with_the_extra_and_shipped_colliders_where_there_are_some(monkeypatch):
    monkeypatch.setattr(listing, "find_spec", lambda name: None)
    bare = {one.label for one in settings_list()}
    monkeypatch.setattr(listing, "find_spec", lambda name: True)
    more = [one for one in settings_list(shipped=True) if one.label not in bare]
    assert {one.label: str(one.spec).partition("=")[2] for one in more} == {
        "collider shape shipped": "collider[shape=shipped]",
        "collider pieces 4": "collider[shape=compound,pieces=4]",
        "collider pieces 16": "collider[shape=compound,pieces=16]",
    }  # fmt: skip


def test_the_list_holds_every_detector_and_every_axis_once():
    tried = settings_list()
    assert {one.detector for one in tried} == set(DETECTORS) - {"image-space"}, "that one only when asked"
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


def test_whoever_is_asked_for_faces_comes_without_them_too():
    plain = [one.spec for one in settings_list() if one.axis == AS_IT_COMES]
    asked = [one for one in settings_list() if one.axis == ASKED]
    assert all(one.faces and one.spec in plain for one in asked) and len(asked) >= 3
    assert asked[0].label == f"{asked[0].detector} faces"


def test_what_a_short_time_limit_leaves_advises_on_engines_colliders_and_a_live_loop():
    head = settings_list()[:33]
    assert {"hybrid", "exact", "discrete", "collider", "solid-style"} <= {one.detector for one in head}
    assert {"step rate", "shape", "mesh resolution", "budget"} <= {one.axis for one in head}
    assert {"discrete step rate 10 Hz", "sphere"} <= {one.label for one in settings_list()[:8]}


@pytest.mark.parametrize(
    ("spec", "complete"),
    [
        ("exact", True), ("exact[threads=2]", True), ("exact[containment=false]", False), ("hybrid", True),
        ("discrete", True), ("discrete[rate_hz=22.5]", False), ("static[epsilon=0.01]", False), ("sphere", False),
        ("solid-style[budget=30]", False), ("collider", False), ("collider[shape=mesh]", True), ("hybrid-qaco", False),
        ("hybrid-qaco[decide=mesh]", True), ("continuous", False), ("package.module:Class", False),
    ],
)  # fmt: skip
def test_complete_is_what_asks_every_face_at_every_frame(spec, complete):
    (one,) = settings_of(f"it={spec}")
    assert one.complete == complete and one.label == one.line == "it" and one.spec.label == "it"
    assert not Setting("hybrid", "mesh resolution", "5 mm", cell=0.005).complete
    assert not Setting("hybrid", ASKED, "faces", faces=True).complete


def test_fewer_settings_are_simpler_and_the_exact_one_is_the_simplest():
    plain = {one.detector: one.simplicity for one in settings_list() if one.axis == AS_IT_COMES}
    assert min(plain, key=plain.get) == "exact"
    assert all(one.simplicity > max(plain.values()) for one in settings_list() if one.axis != AS_IT_COMES)
