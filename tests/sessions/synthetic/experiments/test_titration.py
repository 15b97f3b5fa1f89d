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


VOLUMES = {"acid": 40.0, "rinse": 60.0}


def test_pours_and_the_spill_agree_with_the_poses(made, check_pour):
    run = made("acid-dilution")
    left = dict(VOLUMES)
    poured = sorted([*run.facts("pour"), *run.facts("spill")], key=lambda fact: fact.start)
    assert [fact.kind for fact in poured] == ["pour", "pour", "spill", "pour"]
    for fact in poured:
        source = fact.values["source"]
        check_pour(run, fact, before=left[source])
        left[source] -= fact.values["volume_ml"]
        assert fact.values["left_ml"] == pytest.approx(left[source])


def test_the_dropped_beaker_falls_freely_and_breaks_at_the_speed_it_lands_with(made):
    run = made("acid-dilution")
    (drop,), (broken,) = run.facts("drop"), run.facts("break")
    height = run.pose("rinse")[0][:, 1]
    falling = run.near(drop.start + 0.012, drop.end)
    curve = np.polyfit(run.times[falling] - drop.end, height[falling], 2)
    assert curve[0] == pytest.approx(-9.80665 / 2.0, rel=1e-3)
    assert -curve[1] == pytest.approx(broken.values["speed_m_s"], rel=1e-3)
    assert broken.start == drop.end and broken.values["speed_m_s"] > broken.values["threshold_m_s"]
    assert height[run.times > drop.end + 0.02].max() < 0.9
    assert drop.values["height_m"] == pytest.approx(height[run.near(drop.start - 0.05, drop.start)][0] - 0.9, abs=1e-6)


def test_near_misses_keep_their_clearance(made, verdicts):
    from dataclasses import replace

    from sessions import Session
    from sessions.model.track import Track

    run = made("silver-chloride")
    (fact,) = run.facts("near_miss")
    still = run.near(fact.start + 0.1, fact.end - 0.1)
    answers = []
    for nearer in (fact.values["clearance_m"] - 0.0005, fact.values["clearance_m"] + 0.0005):
        tracks = {}
        for name in ("hand-left", "sodium-chloride"):
            track = run.session.tracks[name]
            shift = np.array([0.0, 0.0, -nearer]) if name == "hand-left" else np.zeros(3)
            tracks[name] = Track(track.times_ns[still], track.positions[still] + shift, track.quaternions_xyzw[still])
        moved = Session.from_tracks(tracks, meshes=run.session.meshes)
        answers.append(verdicts(replace(moved), [("hand-left", "sodium-chloride")]).max())
    assert answers == [0, 1]
