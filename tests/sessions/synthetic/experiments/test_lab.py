"""Facts of an experiment follow from its recorded poses by another route."""

import math

import numpy as np
import pytest

from sessions.geometry.rotations import quaternion_inverse, rotated_vectors


def delivered(run):
    """Volume in mL at every frame, from the recorded angle of the key and what the scene says of the outlet."""
    (effect,) = (effect for effect in run.session.scene.effects if effect.kind == "burette")
    cavity = run.cavity("burette")
    section = cavity["capacity_ml"] * 1e-6 / (cavity["mark"] - cavity["floor"])
    arm = rotated_vectors(run.poses["stopcock"][1], np.array([1.0, 0.0, 0.0]))
    opened = np.arctan2(arm[:, 1], arm[:, 0]) / np.radians(effect.settings["full_angle_deg"])
    area = effect.settings["full_area_m2"] * opened
    steps = np.diff(run.times) * 0.5 * (area[1:] + area[:-1])
    head, volume = cavity["mark"], [0.0]
    for step in steps.tolist():
        flow = effect.settings["discharge"] * math.sqrt(2.0 * 9.80665 * head) * step
        head -= flow / section
        volume.append(volume[-1] + flow)
    return np.array(volume) * 1e6


@pytest.mark.slow
@pytest.mark.parametrize(("name", "ends_ml"), [("titration", [25.0]), ("carbonate-titration", [10.0, 20.0])])
def test_end_points_match_the_volume_released_by_the_key(name, ends_ml, made):
    """Millilitres out of the burette, which is closed less than 0.3 mL later."""
    run = made(name)
    volume = delivered(run)
    ends, (total,) = run.facts("end_point"), run.facts("delivered")
    assert [fact.values["volume_ml"] for fact in ends] == pytest.approx(ends_ml)
    assert [np.interp(fact.start, run.times, volume) for fact in ends] == pytest.approx(ends_ml, abs=0.02)
    assert volume[-1] == pytest.approx(total.values["volume_ml"], abs=0.02)
    assert 0.0 < total.values["volume_ml"] - ends_ml[-1] < 0.3


def test_dropped_beaker_falls_freely_and_breaks_at_landing_speed(made):
    """A parabola fitted to heights over a table of 0.9 m: half of g, and the speed at the end."""
    run = made("acid-dilution")
    (drop,), (broken,) = run.facts("drop"), run.facts("break")
    height = run.pose("rinse")[0][:, 1]
    falling = run.near(drop.start + 0.012, drop.end)
    half_acceleration, velocity, _ = np.polyfit(run.times[falling] - drop.end, height[falling], 2)
    assert half_acceleration == pytest.approx(-9.80665 / 2.0, rel=1e-3)
    assert -velocity == pytest.approx(broken.values["speed_m_s"], rel=1e-3)
    assert broken.start == drop.end and broken.values["speed_m_s"] > broken.values["threshold_m_s"]
    assert height[run.times > drop.end + 0.02].max() < 0.9
    height_before, *_ = height[run.near(drop.start - 0.05, drop.start)]
    assert drop.values["height_m"] == pytest.approx(height_before - 0.9, abs=1e-6)


def kept_by_counting(cavity, down, count: int = 400):
    """Millilitres (n,) kept with gravity along ``down`` (n, 3): points counted in the cones from a middle to each face.

    No formula and no library in common with the code under test.
    """
    corners, middle = cavity.to_brim.vertices[cavity.to_brim.faces], np.array(cavity.opening.centre) / 2.0
    sides = corners - middle
    volume = np.linalg.det(sides) / 6.0 * 1e6
    shift = np.random.default_rng(1).random((len(sides), 1, 3))
    # An evenly spread sequence, shifted in each cone: Roberts, The unreasonable effectiveness of quasirandom sequences.
    spread = (np.arange(count)[:, None] * np.array([0.8191725134, 0.6710436067, 0.5497004779]) + shift) % 1.0
    points = middle + np.diff(np.sort(spread), prepend=0.0) @ sides
    rim = cavity.to_brim.vertices[cavity.to_brim.vertices[:, 1] > cavity.opening.lip[1] - 1e-6]
    return np.array(
        [float(((points @ direction > (rim @ direction).max()).mean(axis=1) * volume).sum()) for direction in down]
    )


def check_pour(run, fact, before):
    """The recorded tilt lets the liquid out from the stated time on, as much as stated, into what is stated."""
    source, cavity = fact.values["source"], run.cavity(fact.values["source"])
    rotation = run.pose(source)[1]
    tilt = np.arccos(np.clip(rotated_vectors(rotation, np.array([0.0, 1.0, 0.0]))[:, 1], -1.0, 1.0))
    down = rotated_vectors(quaternion_inverse(rotation), np.array([0.0, -1.0, 0.0]))
    during = run.near(fact.start - 3.0, fact.end + 0.3)
    kept = kept_by_counting(run.vessel(source), down[during])
    times = run.times[during]
    step = np.diff(run.times).max()
    assert abs(times[np.argmax(kept < before)] - fact.start) < 2.0 * step + 0.02
    assert before - kept.min() == pytest.approx(fact.values["volume_ml"], rel=0.02)
    assert times[np.argmax(tilt[during] > tilt[during].max() - 1e-4)] == pytest.approx(fact.end, abs=0.15)
    if fact.kind == "pour":
        target = fact.values["target"]
        spot = run.within(target, run.point(source, cavity["lip"]))[run.near(fact.start, fact.end)]
        assert np.hypot(spot[:, 0], spot[:, 2]).max() < run.cavity(target)["opening_radius"]
        assert spot[:, 1].min() > run.cavity(target)["opening"][1]
    else:
        spot = run.within("water", run.point(source, cavity["lip"]))[run.near(fact.start, fact.end)]
        assert np.hypot(spot[:, 0], spot[:, 2]).min() > run.cavity("water")["opening_radius"]


POURS = {
    "silver-chloride": ["pour"],
    "gas-collection": ["pour"],
    "acid-dilution": ["pour", "pour", "spill", "pour"],
    "marble": ["pour"],
    "ammonia-calorimetry": ["pour"],
}


@pytest.mark.slow
@pytest.mark.parametrize(("name", "kinds"), POURS.items(), ids=POURS)
def test_pours_and_the_spill_agree_with_the_poses(name, kinds, made):
    """For each pour the truth's volume, time and target are checked by the tilt of the recorded glass (``check_pour``).

    Volumes are also added up from glass to glass: ``left`` is what each still holds.
    """
    run = made(name)
    left = {
        body.id: body.extra["properties"]["liquid"]["volume_ml"]
        for body in run.session.scene.bodies
        if "liquid" in body.extra.get("properties", {})
    }
    poured = sorted([*run.facts("pour"), *run.facts("spill")], key=lambda fact: fact.start)
    assert [fact.kind for fact in poured] == kinds
    for fact in poured:
        source = fact.values["source"]
        check_pour(run, fact, left[source])
        left[source] -= fact.values["volume_ml"]
        assert fact.values["left_ml"] == pytest.approx(left[source])
        if fact.kind == "pour":
            left[fact.values["target"]] = left.get(fact.values["target"], 0.0) + fact.values["volume_ml"]


def test_interactivity_lasts_from_first_to_last_hold(made):
    """The interval begins when a hand first takes hold of something and ends when the last is let go."""
    run = made("marble")
    holds = [(fact.start, fact.end) for fact in run.facts("hold")]
    (interval,) = [interval for interval in run.session.intervals if interval.name == "interactivity"]
    start_ns = run.session.frames.stamp_ns[0]
    assert len(holds) > 1
    assert (interval.start_ns - start_ns) / 1e9 == pytest.approx(min(start for start, _ in holds), abs=1e-6)
    assert (interval.end_ns - start_ns) / 1e9 == pytest.approx(max(end for _, end in holds), abs=1e-6)
