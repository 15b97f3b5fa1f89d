"""Contained is a body of which a part lies inside a closed mesh, and an open mesh contains nothing."""

from functools import cache

import numpy as np
import pytest
from support.shapes import (
    ball_mesh,
    beaker_mesh,
    box_mesh,
    merge_meshes,
    motion_at_rest,
    random_rotations,
    rod_mesh,
    shift_mesh,
    without_faces,
)

from cdcore import Body, Motion, TriangleMesh, Verdict
from cdcore.containment.containment_stage import ContainmentStage, containment_word, parity_decides
from cdcore.containment.ray_parity import point_inside
from cdcore.narrow.brute_force import meeting_faces_exhaustive
from cdcore.poses import place_points

INNER_AND_OUTER = np.array([[0, 1]])


def contained_frames(inner, outer, motion=None, enabled=True):
    """Whether one body is inside the other, (T,), over the whole motion; frame by frame the answer is the same."""
    bodies = [Body("inner", inner), Body("outer", outer)]
    motion = motion_at_rest(bodies, np.zeros((2, 3))) if motion is None else motion
    stage, frames, verdict = (
        ContainmentStage(bodies, INNER_AND_OUTER, enabled=enabled),
        np.arange(len(motion)),
        np.zeros((len(motion), 1), "u1"),
    )
    assert stage.mark(motion, frames, 0 * frames, verdict) == enabled * len(motion)
    if enabled:
        live = [stage.question(motion.frames(frame, frame + 1), 0, 0.0)[0] for frame in frames]
        assert verdict[:, 0].tolist() == live
    return verdict[:, 0] == Verdict.CONTAINED


def inside_out(mesh):
    """The mesh with its faces inwards."""
    return TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])


@cache
def shapes():
    """Name -> inner mesh, outer mesh, whether the first is contained in the second."""
    return {
        "ball in box": (ball_mesh(0.1), box_mesh(), True),
        "ball in ball": (ball_mesh(0.2), ball_mesh(1.0), True),
        "box in box, all rays along edges": (box_mesh((0.5, 0.5, 0.5)), box_mesh(), True),
        "rod in the cavity of a beaker": (shift_mesh(rod_mesh(), [0, 0, 0.01]), beaker_mesh(), False),
        "ball beside a box": (shift_mesh(ball_mesh(0.1), [0.7, 0, 0]), box_mesh(), False),
        "open ball in box": (without_faces(ball_mesh(0.1), count=2), box_mesh(), True),
        "ball in a box that lacks a triangle": (ball_mesh(0.1), without_faces(box_mesh(), count=1), True),
        "two balls in a box": (merge_meshes(ball_mesh(0.1), shift_mesh(ball_mesh(0.1), [0.3, 0, 0])), box_mesh(), True),
        "one ball of two in a box": (
            merge_meshes(ball_mesh(0.1), shift_mesh(ball_mesh(0.1), [2, 0, 0])),
            box_mesh(),
            True,
        ),
        "one ball of two in a box, the other too large for it": (
            merge_meshes(shift_mesh(ball_mesh(3), [9, 0, 0]), ball_mesh(0.1)),
            box_mesh(),
            True,
        ),
        "two balls on both sides of a box": (
            merge_meshes(shift_mesh(ball_mesh(0.1), [-2, 0, 0]), shift_mesh(ball_mesh(0.1), [2, 0, 0])),
            box_mesh(),
            False,
        ),
        "ball in the hollow of a shell": (
            ball_mesh(0.1),
            merge_meshes(ball_mesh(1.0), inside_out(ball_mesh(0.5))),
            False,
        ),
        "ball in two shells wound alike": (ball_mesh(0.1), merge_meshes(ball_mesh(1.0), ball_mesh(0.5)), True),
        "ball in the core of a shell": (
            ball_mesh(0.1),
            merge_meshes(ball_mesh(1.0), ball_mesh(0.7), ball_mesh(0.4)),
            True,
        ),
        "box in a box that is larger by rounding": (box_mesh([np.nextafter(1.0, 0.0)] * 3), box_mesh(), True),
        "bead in the glass of a beaker": (shift_mesh(ball_mesh(0.0005), [0.039, 0, 0.05]), beaker_mesh(), True),
    }


@pytest.mark.parametrize("case", shapes())
@pytest.mark.parametrize("backward", [False, True], ids=["forward", "backward"])
def test_body_with_a_component_inside_is_contained(case, backward):
    """Rows of ``shapes``, with the inner body as the first or as the second of the pair."""
    inner, outer, expected = shapes()[case]
    assert contained_frames(*((outer, inner) if backward else (inner, outer))).tolist() == [expected]


@pytest.mark.parametrize("away", [0.0, 1e4])
def test_random_relative_poses_agree_with_the_exact_answer(away):
    """A ball of 4 mm in and around a beaker 10 cm high; both ``away`` metres from the origin.

    Truth is the exact parity of a ray from one corner of the ball, where the surfaces do not meet.
    """
    inner, outer = ball_mesh(0.004, rings=4, sides=6), beaker_mesh(radius=0.04, height=0.1, wall=0.01)
    rng = np.random.default_rng(1)
    rotation, position = random_rotations(rng, 250, 2), np.zeros((250, 2, 3))
    position[:, 0] = np.einsum(
        "kij,kj->ki", rotation[:, 1], rng.uniform([-0.05, -0.05, -0.01], [0.05, 0.05, 0.11], (250, 3))
    )
    motion = Motion(np.arange(250), position + away, rotation)
    answers, inside = contained_frames(inner, outer, motion), []
    for frame in range(250):
        surfaces = [
            place_points(mesh.triangles, rotation[frame, k], motion.translations[frame, k])
            for k, mesh in enumerate((inner, outer))
        ]
        # Where the surfaces meet the question does not apply.
        if not len(meeting_faces_exhaustive(*surfaces)):
            inside.append(point_inside(surfaces[0][0, 0], surfaces[1]))
            assert answers[frame] == inside[-1]
    assert 5 < sum(inside) < len(inside) - 5


def test_meshes_with_holes_are_named_in_order():
    """``ajar`` lacks a triangle; names stand in alphabetical order, whichever body is the first of the pair."""
    closed, ajar = box_mesh(), without_faces(box_mesh(), count=1)
    assert containment_word(Body("a", closed), Body("b", closed)) == "decided"
    assert containment_word(Body("a", closed), Body("b", ajar)) == "partly: inside undecided: b has holes"
    both = "partly: inside undecided: a has holes and b has holes"
    assert containment_word(Body("b", ajar), Body("a", ajar)) == both


@pytest.mark.parametrize("reversed_", [False, True], ids=["doubled", "double-sided"])
@pytest.mark.parametrize("count", [1, 12])
def test_faces_drawn_twice_count_once(reversed_, count):
    """A box whose first faces are drawn again has the ball in its middle inside, and one 0.7 m away not."""
    box, ball = box_mesh(), Body("ball", ball_mesh(0.1))
    again = box.faces[:count, ::-1] if reversed_ else box.faces[:count]
    own = TriangleMesh(
        np.concatenate([box.vertices, box.vertices]), np.concatenate([box.faces, again + len(box.vertices)])
    )
    twice = Body("box", own)
    assert contained_frames(ball.mesh, own).all()
    assert not contained_frames(shift_mesh(ball.mesh, [0.7, 0.0, 0.0]), own).any()
    assert containment_word(ball, twice) == containment_word(twice, Body("b", own)) == "decided"


CROSSING = (box_mesh(), shift_mesh(box_mesh(), [0.5, 0.3, 0.2]))


@pytest.mark.sampled(3)
@pytest.mark.parametrize(
    ("components", "by_parity", "always"),
    [
        ((box_mesh(), shift_mesh(box_mesh(), [9, 0, 0])), True, True),  # far from each other
        (CROSSING, False, True),  # crossing, wound alike
        ((CROSSING[0], inside_out(CROSSING[1])), False, False),  # crossing, wound oppositely
        ((box_mesh(), shift_mesh(box_mesh(), [1.0, 0.5, 0.25])), False, True),  # touching
        ((ball_mesh(1.0), ball_mesh(0.5)), False, True),  # nested, wound alike
        ((ball_mesh(0.5), box_mesh((9, 9, 9))), False, True),
        ((ball_mesh(1.0), inside_out(ball_mesh(0.5))), True, True),  # hollow
        ((inside_out(ball_mesh(1.0)), ball_mesh(0.5), inside_out(ball_mesh(0.2))), True, True),
        ((ball_mesh(1.0), inside_out(ball_mesh(0.5)), inside_out(ball_mesh(0.2))), True, True),
        ((ball_mesh(1.0), ball_mesh(0.7), inside_out(ball_mesh(0.4))), False, True),
    ],
)
@pytest.mark.parametrize("size", [1.0, 1e-3, 1e103, 1e-110])
def test_winding_numbers_decide_containment_where_ray_parity_cannot(components, by_parity, always, size):
    """Parity of crossings fails where parts overlap; winding fails only where overlapping parts are wound oppositely.

    ``by_parity``: whether parity decides; ``always``: whether winding or parity does.
    """
    whole = merge_meshes(*components)
    body = Body("parts", TriangleMesh(whole.vertices * size, whole.faces))
    assert parity_decides(body.mesh) == by_parity
    word = containment_word(Body("ball", ball_mesh(0.1)), body)
    doubt = "partly: inside undecided: parts has crossing parts of opposite winding"
    assert word == ("decided" if always else doubt)


def test_containment_that_is_switched_off_marks_nothing():
    """A ball of 0.1 m in the middle of a box of 1 m."""
    assert not contained_frames(ball_mesh(0.1), box_mesh(), enabled=False).any()
