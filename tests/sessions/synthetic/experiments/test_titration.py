from __future__ import annotations

import numpy as np
import pytest

from sessions.geometry.rotations import rotated


def delivered(run):
    """Volume in mL at every frame, from the recorded angle of the key and what the scene says of the outlet."""
    (effect,) = (effect for effect in run.session.scene.effects if effect.kind == "burette")
    cavity = run.cavity("burette")
    section = cavity["capacity_ml"] * 1e-6 / (cavity["mark"] - cavity["floor"])
    arm = rotated(run.poses["stopcock"][1], np.array([1.0, 0.0, 0.0]))
    opened = np.arctan2(arm[:, 1], arm[:, 0]) / np.radians(effect.settings["full_angle_deg"])
    area = effect.settings["full_area_m2"] * opened
    head, volume = cavity["mark"], [0.0]
    for k in range(1, len(run.times)):
        step = (run.times[k] - run.times[k - 1]) * 0.5 * (area[k] + area[k - 1])
        flow = effect.settings["discharge"] * np.sqrt(2.0 * 9.80665 * head) * step
        head -= flow / section
        volume.append(volume[-1] + flow)
    return np.array(volume) * 1e6


def test_the_end_point_is_when_the_recorded_key_has_let_25_ml_out(made):
    run = made("titration")
    volume = delivered(run)
    (end_point,), (total,) = run.facts("end_point"), run.facts("delivered")
    assert np.interp(end_point.start, run.times, volume) == pytest.approx(25.0, abs=0.02)
    assert volume[-1] == pytest.approx(total.values["volume_ml"], abs=0.02)
    assert 25.0 < total.values["volume_ml"] < 25.3


def test_the_equivalence_volume_follows_from_what_the_scene_declares(made):
    run = made("titration")
    acid = run.session.scene.body("flask").extra["properties"]["liquid"]
    base = run.session.scene.body("burette").extra["properties"]["liquid"]
    (end_point,) = run.facts("end_point")
    assert end_point.values["volume_ml"] == pytest.approx(acid["volume_ml"] * acid["molar"] / base["molar"])


def test_the_key_turns_open_throttles_and_closes(made):
    run = made("titration")
    turns = run.facts("stopcock")
    assert [(turn.values["from_deg"], turn.values["to_deg"]) for turn in turns] == [
        pytest.approx((0.0, 40.0)), pytest.approx((40.0, 7.0)), pytest.approx((7.0, 0.0)),
    ]  # fmt: skip
    arm = rotated(run.poses["stopcock"][1], np.array([1.0, 0.0, 0.0]))
    angle = np.degrees(np.arctan2(arm[:, 1], arm[:, 0]))
    for turn in turns:
        assert angle[run.near(turn.start - 0.2, turn.start)] == pytest.approx(turn.values["from_deg"], abs=1e-6)
        assert angle[run.near(turn.end, turn.end + 0.2)] == pytest.approx(turn.values["to_deg"], abs=1e-6)


def test_the_flasks_mouth_is_under_the_tip_while_base_runs(made):
    run = made("titration")
    (total,) = run.facts("delivered")
    running = run.near(total.start, total.end)
    tip = run.within("flask", run.pose("burette")[0])[running]
    assert np.hypot(tip[:, 0], tip[:, 2]).max() < run.cavity("flask")["opening_radius"]
    assert tip[:, 1].min() > run.cavity("flask")["opening"][1]


def test_the_key_belongs_to_the_burette(made):
    scene = made("titration").session.scene
    assert scene.body("stopcock").parent == "burette"
    assert scene.body("burette").fixed is not None
