from itertools import product
from typing import NamedTuple

import numpy as np
import pytest
from support.small_worlds import cube

from replay.engine import compute
from sessions import Session
from sessions.model.scene import Scene, SceneBody, SceneEffect
from sessions.model.session import Track

GRAVITY, RATE, FLOOR = 9.80665, 90.0, 0.5
"""A cube of 0.2 m falls from rest on a cube of 1 m whose top is at 0.5 m."""


def breakable_scene(**limits):
    """A cup of 0.1 kg that breaks on a block, from 1 m/s on unless other limits are given."""
    given = limits or {"speed_m_s": 1.0}
    bodies = (SceneBody("cup", extra={"mass": 0.1}), SceneBody("top"))
    return Scene(bodies=bodies, effects=(SceneEffect("breakage", {"between": ["cup", "top"], **given}),))


def cup_over_block(heights, times=None, valid=None, aside=0.0, **limits):
    """The cube's underside at these heights over the top, its middle so far aside of it."""
    count = len(heights)
    stamps = np.round(np.arange(count) / RATE * 1e9 if times is None else times * 1e9).astype(np.int64)
    point = np.zeros((count, 3))
    point[:, 0], point[:, 1] = aside, FLOOR + 0.1 + np.asarray(heights)
    rotation = np.tile([0.0, 0.0, 0.0, 1.0], (count, 1))
    tracks = {"cup": Track(stamps, point, rotation, valid), "top": Track(stamps, np.zeros((count, 3)), rotation)}
    return Session.from_tracks(tracks, {"cup": cube(edge=0.2), "top": cube()}, breakable_scene(**limits))


def cup_that_falls(height, phase=0.0, rest=-0.0005, count=60, **more):
    """A cup that falls from rest, 0.1 s after the start, from this height over the block."""
    times = np.arange(count) / RATE
    fall = np.maximum(0.0, times - 0.1 - phase)
    return cup_over_block(np.maximum(rest, height - 0.5 * GRAVITY * fall**2), **more)


def breakage_of(session):
    """Events of breaking, events of impacts, and the effect's run."""
    run = compute(session, detectors=()).effects["breakage"]
    return run.output.events_named("broken"), run.output.events_named("impact"), run


@pytest.mark.sampled(3)
@pytest.mark.parametrize("height", [0.06, 0.1, 0.25])
@pytest.mark.parametrize("phase", [0.0, 0.003, 0.007])
def test_the_speed_of_a_fall_follows_from_its_height(height, phase):
    """A cup of 0.1 kg, which breaks from 1 m/s on, falls from rest on a block 0.1 s after the start, at 90 Hz.

    It hits at the speed root of 2 g h after root of 2 h / g, midway on the block's top, and breaks. ``phase``: seconds
    between its start and a frame. The effect runs in 3 frames only, the last before the impact and two after it, and
    counts no impact that it cannot judge.
    """
    mass_kg, start_s = 0.1, 0.1 + phase
    (crash,), (impact,), run = breakage_of(cup_that_falls(height, phase))
    assert impact.values["speed_m_s"] == pytest.approx(np.sqrt(2 * GRAVITY * height), rel=0.005)
    assert impact.values["energy_j"] == pytest.approx(mass_kg * GRAVITY * height, rel=0.01)
    assert crash.time == pytest.approx(start_s + np.sqrt(2 * height / GRAVITY), abs=0.001)
    assert crash.level == "error"
    assert crash.point == pytest.approx((0.0, FLOOR, 0.0), abs=0.001)
    assert run.frames_run == 3 and not run.counters


@pytest.mark.parametrize("side", [-1, 1])
def test_impact_point_lies_on_the_body_hit_despite_noise(side):
    """A cup of 0.2 m falls 0.1 m, 0.5 mm beside a block of 1 m, and stands 0.5 mm over its edge when it is down.

    It hits at the speed root of 2 g h; the point is on the edge. ``side``: which of the block's edges, at x = 0.5 m.
    """
    height, halves_of_both = 0.1, 0.5 + 0.1
    is_down = np.arange(60) / RATE >= 0.1 + np.sqrt(2 * height / GRAVITY)  # it falls from 0.1 s on
    aside = side * (halves_of_both + np.where(is_down, -0.0005, 0.0005))
    (crash,), (impact,), _ = breakage_of(cup_that_falls(height, aside=aside))
    assert impact.values["speed_m_s"] == pytest.approx(np.sqrt(2 * GRAVITY * height), rel=0.01)
    assert crash.point == pytest.approx((side * 0.5, FLOOR, 0.0), abs=0.002)


def test_a_body_set_down_gently_meets_and_does_not_break():
    """A cup that breaks from 1 m/s on sinks from 20 mm over a block at 0.1 m/s, and then stays 0.5 mm in it."""
    speed_m_s = 0.1
    heights = np.maximum(-0.0005, 0.02 - speed_m_s * np.arange(60) / RATE)
    crash, (impact,), _ = breakage_of(cup_over_block(heights))
    assert not crash
    assert impact.values["speed_m_s"] == pytest.approx(speed_m_s, rel=0.01) and not impact.values["broken"]


def test_impact_speed_is_the_component_perpendicular_to_the_surface():
    """A cup that breaks from 1 m/s on slides over a block at 1 m/s and sinks on it, from 30 mm, at 0.1 m/s.

    ``across``: the impact notes that its speed is the one across the surface.
    """
    seconds, sinks_m_s, slides_m_s = np.arange(60) / RATE, 0.1, 1.0
    session = cup_over_block(np.maximum(-0.0005, 0.03 - sinks_m_s * seconds))
    position = session.frames.position
    position.setflags(write=True)
    cup, x = 0, 0
    position[:, cup, x] = -0.35 + slides_m_s * seconds
    crash, (impact,), _ = breakage_of(session)
    assert not crash
    assert impact.values["across"] and impact.values["speed_m_s"] == pytest.approx(sinks_m_s, rel=0.05)


def test_impact_without_a_surface_point_has_the_relative_speed():
    """A cup of 0.2 m moves 18 m/s down, the block 9 m/s up: from frame 30, 5 cm apart, to 31 they come 0.3 m nearer.

    So the cup is all inside at once. Their faces meet in no frame, so that there is no point of the impact, and no
    direction across a surface.
    """
    seconds, down_m_s, up_m_s = (np.arange(60) - 30) / RATE, 18.0, 9.0
    session = cup_over_block(0.05 - down_m_s * seconds)
    position = session.frames.position
    position.setflags(write=True)
    block, y = 1, 1
    position[:, block, y] = up_m_s * seconds
    _, (impact,), _ = breakage_of(session)
    assert impact.point is None and impact.values["speed_m_s"] == pytest.approx(down_m_s + up_m_s, rel=1e-5)


FRAMES = np.arange(60)
SINCE_POSE = np.arange(120) / RATE - 50 / RATE
"""Since a pose came back after a loss, seconds."""
GAP = "not judged: gap, loss or jump before it"


def test_a_tracking_jump_into_contact_breaks_nothing():
    """A cup rests over a block and from a frame to the next is ``step`` m lower, 0.5 mm in the block: tracking jumped.

    As a motion even 5 mm in a frame of 1/90 s are 0.45 m/s; 30 mm are 2.7 m/s, and the cup breaks from 1 m/s on.
    """
    for step in [0.005, 0.03, 0.2, 3.0]:
        crashes, _impacts, _run = breakage_of(cup_over_block(np.where(FRAMES < 30, step - 0.0005, -0.0005)))
        assert not crashes, step


def test_a_push_of_a_few_millimetres_is_an_impact():
    """A hand pushes a cup at rest down on a block 8 mm below, with 5 g, and it stays there.

    It meets the block at 0.9 m/s after two to three frames, too few for its speed: 0.4 m/s at least are noted.
    ``phase``: of a frame, at which it begins.
    """
    acceleration_m_s2, gap_m = 5 * GRAVITY, 0.008
    speed_m_s = np.sqrt(2 * acceleration_m_s2 * gap_m)
    for phase in (0.0, 0.25, 0.5):
        pushed_s = np.maximum(0.0, FRAMES - 29 - phase) / RATE
        heights = np.maximum(-0.0005, gap_m - 0.5 * acceleration_m_s2 * pushed_s**2)
        _crashes, impacts, _run = breakage_of(cup_over_block(heights))
        assert 0.4 < max(impact.values["speed_m_s"] for impact in impacts) < speed_m_s, phase


@pytest.mark.parametrize(
    ("session", "reason"),
    [
        # It sinks at 0.02 m/s, and jumps down by 30 mm shortly before that is a contact.
        (cup_over_block(np.maximum(0.0385 - 0.02 * FRAMES / RATE - 0.03 * (FRAMES >= 30), -0.001),
                        speed_m_s=0.3), GAP),
        (cup_that_falls(height=0.25, valid=(FRAMES < 26) | (FRAMES >= 29)), GAP),
        (cup_over_block(np.where(FRAMES < 30, 0.3, -0.0005), FRAMES / RATE + 0.3 * (FRAMES >= 30)), GAP),
        (cup_over_block(np.full(20, -0.0005)), "not judged: in contact from the start"),
        # It drifts back after a loss.
        (cup_over_block(np.where(SINCE_POSE < 0, 0.04, 0.03 * np.exp(-np.maximum(SINCE_POSE, 0) / 0.02) - 0.001),
                        valid=(SINCE_POSE < -0.1) | (SINCE_POSE >= 0), speed_m_s=0.2), GAP),
    ],
    ids=["jump", "lost before the impact", "gap", "from the start", "drifts back"],
)  # fmt: skip
def test_an_impact_of_unknown_path_is_only_counted(session, reason):
    """A cup meets a block, but its path before is not known: no event, and a counter with the ``reason``."""
    crashes, impacts, run = breakage_of(session)
    assert not crashes and not impacts
    assert run.counters == {reason: 1}


class Fall(NamedTuple):
    """How a cup that falls behaves at the block, and how it is recorded."""

    restitution: float
    depth: float  # that the tracker shows it inside the block, metres
    noise: float  # of the tracker, metres
    phase: float  # of the frames, as a fraction of a frame


def heights_of_fall(height, rate, fall):
    """Heights of a cube that falls on another, dips in and bounces on until it rests: 1.6 s at a rate."""
    restitution, depth, noise, phase = fall
    times = (np.arange(round(1.6 * rate)) + phase) / rate - 0.5
    speed = np.sqrt(2 * GRAVITY * height)
    since = times - speed / GRAVITY
    heights = np.where(times > 0.0, height - 0.5 * GRAVITY * times**2, height)
    dip = 2.0 * depth / speed
    later = np.full(len(times), -min(depth, 2e-4))
    begin, up = dip, restitution * speed
    while up > 0.01:
        flight = 2.0 * up / GRAVITY
        inside = (since >= begin) & (since < begin + flight)
        later[inside] = up * (since[inside] - begin) - 0.5 * GRAVITY * (since[inside] - begin) ** 2
        begin, up = begin + flight, restitution * up
    dipping = -depth * np.sin(np.pi * np.clip(since / max(dip, 1e-12), 0.0, 1.0))
    heights = np.where(since >= 0.0, np.where(since < dip, dipping, later), heights)
    return heights + np.random.default_rng(round(100 * phase)).normal(0.0, noise, len(times))


HEIGHTS, RATES = (0.1, 0.2, 0.5, 1.0, 2.0), (30, 90, 250)
"""Metres, and frames a second."""

FALLS = [
    Fall(*values)
    for values in product((0.0, 0.2, 0.4, 0.6, 0.8), (0.0, 0.0005, 0.002, 0.005), (0.0, 3e-4), np.arange(10) / 10)
]


def crashes_of_fall(height, rate, fall, breaks_from):
    """Events of breaking of a cup that falls and breaks from a speed on, in m/s.

    The hardest impact must be noted with the speed of the fall: by at most a sixth less, or, where the tracker is not
    noisy and the cup falls from half a metre or more, within 5 %.
    """
    heights = heights_of_fall(height, rate, fall)
    session = cup_over_block(heights, times=np.arange(len(heights)) / rate, speed_m_s=breaks_from)
    crashes, impacts, _ = breakage_of(session)
    speed = np.sqrt(2 * GRAVITY * height)
    hard = [impact.values["speed_m_s"] for impact in impacts if impact.values["speed_m_s"] > speed / 1.2]
    assert hard, fall
    if height >= 0.5 and not fall.noise:
        assert hard[0] == pytest.approx(speed, rel=0.05), fall
    return crashes


@pytest.mark.sampled(4)
@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("height", HEIGHTS)
def test_a_fall_breaks_above_the_threshold_and_never_below(height, rate):
    """Two random falls: of a cup that endures a sixth less than its speed, and of one that endures a quarter more.

    ``rate``: frames a second. Falls differ in how far the cup bounces, in noise, and in where frames lie.
    """
    speed = np.sqrt(2 * GRAVITY * height)
    weak, strong = (FALLS[row] for row in np.random.default_rng(rate).permutation(len(FALLS))[:2])
    assert len(crashes_of_fall(height, rate, weak, breaks_from=speed / 1.2)) == 1, weak
    assert not crashes_of_fall(height, rate, strong, breaks_from=speed / 0.8), strong


@pytest.mark.slow
@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("height", HEIGHTS)
def test_three_thousand_falls_break_only_above_the_threshold(height, rate):
    """Every second cup endures a sixth less than the speed of its fall, the others a quarter more.

    Each of FALLS has another bounce, depth inside the block, noise, or place of its frames.
    """
    speed = np.sqrt(2 * GRAVITY * height)
    for row, fall in enumerate(FALLS[::2]):
        breaks = row % 2 == 0
        crashes = crashes_of_fall(height, rate, fall, breaks_from=speed / (1.2 if breaks else 0.8))
        assert len(crashes) == breaks, fall
