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
"""Bodies of the only pair."""


def contained_frames(inner, outer, motion=None, enabled=True):
    """Whether one body is inside the other, in each frame; asserts that frame by frame the answer is the same.

    Without a motion both are in a single frame at the origin.
    """
    bodies = [Body("inner", inner), Body("outer", outer)]
    motion = motion_at_rest(bodies, np.zeros((2, 3))) if motion is None else motion
    stage = ContainmentStage(bodies, INNER_AND_OUTER, enabled=enabled)
    frames, verdict = np.arange(len(motion)), np.full((len(motion), 1), Verdict.CLEAR, "u1")
    assert stage.mark(motion, frames, 0 * frames, verdict) == enabled * len(motion), "frames that were tested"
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
@pytest.mark.parametrize("inner_first", [True, False], ids=["inner first", "outer first"])
def test_body_with_a_component_inside_is_contained(case, inner_first):
    """Two meshes at rest without contact, and whether a component of the first is inside the solid of the second: a
    ball in a box is, a rod in the cavity of a beaker is not (``shapes``).

    Either of them may be the first of the pair.
    """
    inner, outer, expected = shapes()[case]
    pair = (inner, outer) if inner_first else (outer, inner)
    assert contained_frames(*pair).tolist() == [expected]


@pytest.mark.parametrize("away", [0.0, 1e4], ids="{:g} m from the origin".format)
def test_random_relative_poses_agree_with_the_exact_answer(away):
    """A ball of radius 4 mm at 120 places in and around a beaker with walls of 1 cm; inside is inside the glass.

    Truth is the exact parity of a ray from one corner of the ball, where the surfaces do not meet.
    """
    frames = 120
    ball, beaker = ball_mesh(0.004, rings=4, sides=6), beaker_mesh(radius=0.04, height=0.1, wall=0.01)
    rng = np.random.default_rng(1)
    rotation, position = random_rotations(rng, frames, 2), np.zeros((frames, 2, 3))
    in_beaker_frame = rng.uniform([-0.05, -0.05, -0.01], [0.05, 0.05, 0.11], (frames, 3))
    position[:, 0] = np.einsum("kij,kj->ki", rotation[:, 1], in_beaker_frame)
    motion = Motion(np.arange(frames), position + away, rotation)
    answers, inside = contained_frames(ball, beaker, motion), []
    for frame in range(frames):
        ball_faces, beaker_faces = (
            place_points(mesh.triangles, rotation[frame, k], motion.translations[frame, k])
            for k, mesh in enumerate((ball, beaker))
        )
        if len(meeting_faces_exhaustive(ball_faces, beaker_faces)):
            continue  # where the surfaces meet the question does not apply
        inside.append(point_inside(ball_faces[0, 0], beaker_faces))
        assert answers[frame] == inside[-1], frame
    assert 5 < sum(inside) < len(inside) - 5, "both answers occur"


def test_meshes_with_holes_are_named_in_order():
    """Two closed boxes are decided; of boxes that lack a triangle the sentence names each, in alphabetical order."""
    closed, holed = box_mesh(), without_faces(box_mesh(), count=1)
    assert containment_word(Body("a", closed), Body("b", closed)) == "decided"
    assert containment_word(Body("a", closed), Body("b", holed)) == "partly: inside undecided: b has holes"
    both = "partly: inside undecided: a has holes and b has holes"
    assert containment_word(Body("b", holed), Body("a", holed)) == both


@pytest.mark.parametrize("other_side", [False, True], ids=["same winding", "from both sides"])
@pytest.mark.parametrize("count", [1, 12], ids=["one face", "all 12 faces"])
def test_faces_drawn_twice_count_once(other_side, count):
    """A box of 1 m whose first faces are drawn again, with vertices of their own: whether a ball of 0.1 m is inside is
    decided, in the middle yes, 0.7 m away from it no.
    """
    box, ball = box_mesh(), ball_mesh(0.1)
    again = box.faces[:count, ::-1] if other_side else box.faces[:count]
    doubled = TriangleMesh(
        np.concatenate([box.vertices, box.vertices]), np.concatenate([box.faces, again + len(box.vertices)])
    )
    assert containment_word(Body("ball", ball), Body("box", doubled)) == "decided"
    assert contained_frames(ball, doubled).all()
    assert not contained_frames(shift_mesh(ball, [0.7, 0.0, 0.0]), doubled).any()


def test_containment_of_two_doubled_boxes_is_decided():
    """Each of two boxes has all faces twice, once with the other winding."""
    doubled = merge_meshes(box_mesh(), inside_out(box_mesh()))
    assert containment_word(Body("a", doubled), Body("b", doubled)) == "decided"


SHIFTED = shift_mesh(box_mesh(), [0.5, 0.3, 0.2])
"""A box of 1 m that crosses the box of 1 m about the origin."""
PARITY, WINDING, NEITHER = "parity", "winding", "neither"


@pytest.mark.sampled(3)
@pytest.mark.parametrize(
    ("components", "decided_by"),
    [
        pytest.param((box_mesh(), shift_mesh(box_mesh(), [9, 0, 0])), PARITY, id="far from each other"),
        pytest.param((box_mesh(), SHIFTED), WINDING, id="crossing, wound alike"),
        pytest.param((box_mesh(), inside_out(SHIFTED)), NEITHER, id="crossing, wound oppositely"),
        pytest.param((box_mesh(), shift_mesh(box_mesh(), [1.0, 0.5, 0.25])), WINDING, id="touching"),
        pytest.param((ball_mesh(1.0), ball_mesh(0.5)), WINDING, id="ball in ball, wound alike"),
        pytest.param((ball_mesh(0.5), box_mesh((9, 9, 9))), WINDING, id="ball in box, wound alike"),
        pytest.param((ball_mesh(1.0), inside_out(ball_mesh(0.5))), PARITY, id="hollow ball"),
        pytest.param(
            (inside_out(ball_mesh(1.0)), ball_mesh(0.5), inside_out(ball_mesh(0.2))), PARITY, id="alternating, inwards"
        ),
        pytest.param(
            (ball_mesh(1.0), inside_out(ball_mesh(0.5)), inside_out(ball_mesh(0.2))),
            PARITY,
            id="two inner ones inwards",
        ),
        pytest.param(
            (ball_mesh(1.0), ball_mesh(0.7), inside_out(ball_mesh(0.4))), WINDING, id="two outer ones outwards"
        ),
    ],
)
@pytest.mark.parametrize("size", [1.0, 1e-3, 1e103, 1e-110])
def test_winding_numbers_decide_containment_where_ray_parity_cannot(components, decided_by, size):
    """Parts of a mesh: parity of a ray's crossings fails where parts overlap that are wound alike.

    Winding numbers fail only where parts cross that are wound oppositely; then the sentence says so. ``size``: a factor
    for all lengths; at 1e103 a volume is no longer finite in float64, at 1e-110 it is 0.
    """
    whole = merge_meshes(*components)
    body = Body("parts", TriangleMesh(whole.vertices * size, whole.faces))
    assert parity_decides(body.mesh) == (decided_by is PARITY)
    undecided = "partly: inside undecided: parts has crossing parts of opposite winding"
    expected = undecided if decided_by is NEITHER else "decided"
    assert containment_word(Body("ball", ball_mesh(0.1)), body) == expected


def test_containment_that_is_switched_off_marks_nothing():
    """A ball of 0.1 m in the middle of a box of 1 m, which it does not touch: no frame is marked as contained."""
    assert not contained_frames(ball_mesh(0.1), box_mesh(), enabled=False).any()
