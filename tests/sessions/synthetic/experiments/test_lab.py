"""Facts of an experiment follow from its recorded poses by another route."""

import math

import numpy as np
import pytest

from sessions.geometry.rotations import quaternion_inverse, rotated_vectors


def delivered_ml(run):
    """Volume out of the burette in mL at every frame, from the recorded angle of its key and the scene's outlet."""
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
    """The truth of a titration states at which volumes an indicator changes, and how much ran out in all.

    The flow through the burette's key, by its recorded angle, gives the same volumes at these times, to 0.02 mL; the
    key is closed less than 0.3 mL after the last.
    """
    run = made(name)
    volume_ml = delivered_ml(run)
    end_points, (total,) = run.facts("end_point"), run.facts("delivered")
    total_ml = total.values["volume_ml"]
    assert [fact.values["volume_ml"] for fact in end_points] == pytest.approx(ends_ml)
    assert [np.interp(fact.start, run.times, volume_ml) for fact in end_points] == pytest.approx(ends_ml, abs=0.02)
    assert volume_ml[-1] == pytest.approx(total_ml, abs=0.02)
    assert 0.0 < total_ml - ends_ml[-1] < 0.3


TABLE_HEIGHT_M = 0.9


def test_dropped_beaker_falls_freely_and_breaks_at_landing_speed(made):
    """A beaker falls from the hand onto a table; a parabola fitted to its heights has the acceleration of gravity.

    Its speed at the end is that at which, by the truth, the beaker breaks, and above what it stands; after that it
    lies below the height of the table, as pieces. The stated height is that above the table.
    """
    run = made("acid-dilution")
    (drop,), (broken,) = run.facts("drop"), run.facts("break")
    positions, _rotations = run.pose("rinse")
    height = positions[:, 1]
    frame_s = 0.012
    falling = run.near(drop.start + frame_s, drop.end)  # without the first frame, in which the hand may hold it
    half_acceleration, velocity, _ = np.polyfit(run.times[falling] - drop.end, height[falling], 2)
    assert half_acceleration == pytest.approx(-9.80665 / 2.0, rel=1e-3)
    assert -velocity == pytest.approx(broken.values["speed_m_s"], rel=1e-3)
    assert broken.start == drop.end
    assert broken.values["speed_m_s"] > broken.values["threshold_m_s"]
    assert height[run.times > drop.end + 0.02].max() < TABLE_HEIGHT_M  # from the second frame after it on
    height_before, *_ = height[run.near(drop.start - 0.05, drop.start)]
    assert drop.values["height_m"] == pytest.approx(height_before - TABLE_HEIGHT_M, abs=1e-6)


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
    """An experiment pours liquid from glass to glass, and spills some; its truth has volume, time and target of each.

    ``check_pour`` counts what the recorded tilt of a glass keeps in it: less than before from the stated time on,
    within two frames, and in the end so much less as is stated, within 2 %; its lip is above the opening of the target,
    or for a spill beside it. Volumes are also added up from glass to glass.
    """
    run = made(name)
    content_ml = {
        body.id: body.extra["properties"]["liquid"]["volume_ml"]
        for body in run.session.scene.bodies
        if "liquid" in body.extra.get("properties", {})
    }
    pours = sorted([*run.facts("pour"), *run.facts("spill")], key=lambda fact: fact.start)
    assert [fact.kind for fact in pours] == kinds
    for fact in pours:
        source, volume_ml = fact.values["source"], fact.values["volume_ml"]
        check_pour(run, fact, before=content_ml[source])
        content_ml[source] -= volume_ml
        assert fact.values["left_ml"] == pytest.approx(content_ml[source])
        if fact.kind == "pour":
            target = fact.values["target"]
            content_ml[target] = content_ml.get(target, 0.0) + volume_ml


def test_interactivity_lasts_from_first_to_last_hold(made):
    """A session's interval "interactivity" is from when a hand first takes hold of something until the last release.

    The truth has several holds.
    """
    run = made("marble")
    holds = [(fact.start, fact.end) for fact in run.facts("hold")]
    (interval,) = [interval for interval in run.session.intervals if interval.name == "interactivity"]
    start_ns = run.session.frames.stamp_ns[0]
    assert len(holds) > 1
    assert (interval.start_ns - start_ns) / 1e9 == pytest.approx(min(start for start, _ in holds), abs=1e-6)
    assert (interval.end_ns - start_ns) / 1e9 == pytest.approx(max(end for _, end in holds), abs=1e-6)
