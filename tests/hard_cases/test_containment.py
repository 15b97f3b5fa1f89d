"""Hard cases 27 and 28: a body inside another is contained, a body in a cavity is not, in every order and place."""

from __future__ import annotations

import numpy as np
import pytest
from support.shapes import ball_mesh, beaker_mesh, box_mesh, moved, random_rotations, rod_mesh

from cdcore import Body, Motion, Verdict, create_detector

DETECTORS_ON_MESHES = ["hybrid", "static", "discrete", "exact"]
CASES = {
    "ball .1 in a unit box": (ball_mesh(0.1), box_mesh()),
    "ball .2 in a ball of 1": (ball_mesh(0.2), ball_mesh(1.0)),
}


def seen(name, first, second, motion):
    return create_detector(name, [Body("first", first), Body("second", second)]).detect(motion)


def poses(world, count=12):
    rng = np.random.default_rng(int(world))
    turn, place = random_rotations(rng, count), rng.normal(size=(count, 3)) * world
    turn[0], place[0] = np.eye(3), 0.0
    return Motion(np.arange(count), np.repeat(place[:, None], 2, 1), np.repeat(turn[:, None], 2, 1))


@pytest.mark.parametrize("name", DETECTORS_ON_MESHES)
@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("world", [0.0, 1.0, 1e3])
@pytest.mark.parametrize("turned", [False, True], ids=["inner first", "outer first"])
def test_27_a_body_wholly_inside_another_is_contained(name, case, world, turned):
    inner, outer = CASES[case]
    detection = seen(name, *((outer, inner) if turned else (inner, outer)), poses(world))
    assert (detection.verdict == Verdict.CONTAINED).all()
    assert detection.containment == ("decided",)


@pytest.mark.parametrize("name", DETECTORS_ON_MESHES)
@pytest.mark.parametrize("world", [0.0, 1.0, 1e3])
@pytest.mark.parametrize("turned", [False, True], ids=["rod first", "beaker first"])
def test_28_a_rod_in_an_open_beaker_touches_nothing_and_is_not_contained(name, world, turned):
    rod, beaker = moved(rod_mesh(), [0.01, 0.005, 0.01]), beaker_mesh()
    detection = seen(name, *((beaker, rod) if turned else (rod, beaker)), poses(world))
    assert (detection.verdict == Verdict.CLEAR).all()
    assert detection.containment == ("decided",)


@pytest.mark.parametrize("name", DETECTORS_ON_MESHES)
def test_a_ball_that_moves_in_through_the_wall_is_clear_then_contact_then_contained(name):
    places = np.zeros((41, 2, 3))
    places[:, 0, 0] = 1.0125 - 0.025 * np.arange(41)
    motion = Motion(np.arange(41), places, np.tile(np.eye(3), (41, 2, 1, 1)))
    verdict = seen(name, ball_mesh(0.1), box_mesh(), motion).verdict[:, 0].tolist()
    # The wall is at .5 and the ball's extent along x is .1: contact from .6 to .4.
    expected = [Verdict.CLEAR] * 17 + [Verdict.CONTACT] * 8 + [Verdict.CONTAINED] * 16
    assert verdict == expected
