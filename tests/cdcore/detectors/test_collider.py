"""What a collider in place of the mesh invents and misses follows from closed forms."""

import numpy as np
import pytest
from support.shapes import box_mesh, revolved_mesh

from cdcore import Body, Motion, Verdict, create_detector
from cdcore.errors import InvalidSettingError
from cdcore.protocol import counts_as_contact

RIM, INNER = 0.1, 0.033
BEAKER = Body("beaker", revolved_mesh([(0, 0), (0.035, 0), (0.035, RIM), (INNER, RIM), (INNER, 0.002), (0, 0.002)], 40))
ROD = Body("rod", box_mesh((0.006, 0.006, 0.2), (0.0, 0.0, 0.1)))


def stirring(rate=90.0, seconds=8.0):
    """The rod's foot goes up and down through the rim: height of the foot over time, and the motion."""
    times = np.arange(int(seconds * rate)) / rate
    foot = RIM + 0.05 * np.cos(2 * np.pi * 0.35 * times + 0.2)
    places = np.zeros((len(times), 2, 3))
    places[:, 1, 2] = foot
    return foot, Motion(times, places, np.broadcast_to(np.eye(3), (len(times), 2, 3, 3)))


def test_the_hull_of_a_beaker_invents_exactly_the_seconds_a_rod_is_below_its_rim():
    foot, motion = stirring()
    exact = create_detector("exact", [BEAKER, ROD]).detect(motion)
    assert not counts_as_contact(exact.verdict).any()
    hull = counts_as_contact(create_detector("collider", [BEAKER, ROD]).detect(motion).verdict)[:, 0]
    assert np.array_equal(hull, foot <= RIM)
    change = np.flatnonzero(np.diff(hull.astype(int), prepend=0, append=0))
    stays = list(zip(change[::2], change[1::2], strict=True))
    expected = seconds_below(8.0)
    assert len(stays) == len(expected) == 3
    for (first, after), (start, end) in zip(stays, expected, strict=True):
        assert abs((after - first) / 90 - (end - start)) <= 1 / 90


def seconds_below(seconds):
    """Where the cosine of the foot's height is negative, from one quarter period to the third."""
    turn = 2 * np.pi * 0.35
    stays = [((np.pi / 2 + k * 2 * np.pi - 0.2) / turn, (3 * np.pi / 2 + k * 2 * np.pi - 0.2) / turn) for k in range(9)]
    return [(start, min(end, seconds)) for start, end in stays if start < seconds]


@pytest.mark.parametrize("rate", [50.0, 60.0, 72.0, 90.0])
def test_a_fixed_step_holds_what_it_saw_at_the_last_tick(rate):
    foot, motion = stirring(rate=240.0)
    held = counts_as_contact(create_detector("collider", [BEAKER, ROD], rate_hz=rate).detect(motion).verdict)[:, 0]
    ticks = np.floor((motion.times + 1e-6) * rate)
    seen = [frame for frame in range(len(foot)) if frame == 0 or ticks[frame] > ticks[frame - 1]]
    last = np.array([max(one for one in seen if one <= frame) for frame in range(len(foot))])
    assert np.array_equal(held, foot[last] <= RIM)


def test_a_sphere_misses_the_corner_that_sticks_out_and_says_that_its_shape_is_the_cause():
    box, wall = Body("box", box_mesh()), Body("wall", box_mesh((0.1, 4.0, 4.0)))
    quarter = np.pi / 4
    turn = np.array([[np.cos(quarter), -np.sin(quarter), 0], [np.sin(quarter), np.cos(quarter), 0], [0, 0, 1.0]])
    places = np.zeros((2, 2, 3))
    places[:, 1, 0] = 0.05 + np.array([0.6, 0.8])
    turns = np.broadcast_to(np.stack([turn, np.eye(3)]), (2, 2, 3, 3))
    motion = Motion([0.0, 1.0], places, turns)
    assert create_detector("exact", [box, wall]).detect(motion).verdict[:, 0].tolist() == [1, 0]
    detector = create_detector("collider", [box, wall], shape="sphere")
    spheres = detector.colliders[1].mesh.referenced_vertices
    assert np.abs(spheres).max() == pytest.approx(2.0)  # the wall's sphere swallows everything near it
    assert detector.detect(motion).verdict[0, 0] != Verdict.CLEAR
    small = create_detector("collider", [box, Body("pin", box_mesh((0.1, 0.1, 0.1)))], shape="sphere")
    there = places.copy()
    there[:, 1, 0] = 0.65
    near = Motion([0.0, 1.0], there, turns)
    assert small.detect(near).verdict[:, 0].tolist() == [0, 0]
    told = small.explain(near, 0, 0, np.zeros((1, 2), dtype=np.int64))
    assert told.shapes_meet is False and told.looked is True


def test_unknown_shapes_and_rates_are_refused():
    with pytest.raises(InvalidSettingError, match="choose one of: hull, box, sphere, capsule, mesh"):
        create_detector("collider", [BEAKER], shape="blob")
    with pytest.raises(InvalidSettingError, match="is no rate"):
        create_detector("collider", [BEAKER], rate_hz=0.0)


def test_a_mesh_as_collider_gives_the_verdicts_of_exact():
    _, motion = stirring()
    exact = create_detector("exact", [BEAKER, ROD]).detect(motion).verdict
    assert np.array_equal(create_detector("collider", [BEAKER, ROD], shape="mesh").detect(motion).verdict, exact)
