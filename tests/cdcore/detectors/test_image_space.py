"""Depth images call only contained bodies CONTAINED, and none of them CONTACT, whatever components they have."""

from functools import cache

import numpy as np
import pytest
from support.shapes import (
    ball_mesh,
    beaker_mesh,
    box_mesh,
    merge_meshes,
    random_rotations,
    rod_mesh,
    shift_mesh,
    without_faces,
)

from cdcore import Body, Motion, TriangleMesh, Verdict, create_detector

FRAMES = 12
TWO_BALLS = merge_meshes(ball_mesh(0.1), shift_mesh(ball_mesh(0.1), [0.9, 0, 0]))
THREE_BALLS = merge_meshes(*(shift_mesh(ball_mesh(0.08), [0.5 * k, 0.1 * k, 0]) for k in range(3)))


@cache
def outer_and_inner_meshes():
    """Name -> a mesh, and a smaller one, or one of several components, for places within its bounds."""
    return {
        "ball in box": (box_mesh(), ball_mesh(0.1)),
        "rod in box": (box_mesh(), rod_mesh()),
        "one ball of two": (box_mesh(), TWO_BALLS),
        "balls of three": (box_mesh(), THREE_BALLS),
        "hollow ball": (box_mesh(), merge_meshes(ball_mesh(0.1), reversed_faces(ball_mesh(0.05)))),
        "bead in glass": (beaker_mesh(radius=0.05, height=0.1, wall=0.02), ball_mesh(0.004)),
    }


def reversed_faces(mesh):
    """The mesh inside out."""
    return TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])


def verdicts(name, first, second):
    """The answer of a detector in 12 frames, with the second mesh at random places within the bounds of the first."""
    rng = np.random.default_rng(0)
    lower, upper = first.bounds
    rotations = random_rotations(rng, FRAMES, 2)
    positions = np.einsum("nij,nj->ni", rotations[:, 0], rng.uniform(lower, upper, (FRAMES, 3)))
    motion = Motion(np.arange(FRAMES), np.stack([0 * positions, positions], axis=1), rotations)
    return create_detector(name, [Body("a", first), Body("b", second)]).detect(motion)


@pytest.mark.parametrize("name", outer_and_inner_meshes())
def test_contained_bodies_are_not_called_contact(name):
    """An inner mesh at 12 random places within the bounds of an outer one; ``exact`` says where it is contained.

    ``image-space`` compares depth images of a limited resolution: now and then its rays pass a thin crossing, so that a
    contact is called contained, in fewer than 10 % of the frames: at most one of 12.
    """
    outer, inner = outer_and_inner_meshes()[name]
    truth, answer = (verdicts(detector, outer, inner).verdict[:, 0] for detector in ("exact", "image-space"))
    contained = truth == Verdict.CONTAINED
    assert contained.any()
    assert (answer[contained] != Verdict.CONTACT).all()
    assert ((truth == Verdict.CONTACT) & (answer == Verdict.CONTAINED)).mean() < 0.1


@pytest.mark.parametrize("name", ["ball in box", "one ball of two"])
def test_contained_bodies_are_not_called_contact_outer_mesh_second(name):
    """A ball, or two as a single body, is the first of a pair; the second, a box, has its middle at 12 random places
    within the bounds of the first.

    Where ``exact`` calls them contained they are not called contact; a contact is called contained in one frame at most
    (fewer than 10 %).
    """
    outer, inner = outer_and_inner_meshes()[name]
    truth, answer = (verdicts(detector, inner, outer).verdict[:, 0] for detector in ("exact", "image-space"))
    contained, contact = truth == Verdict.CONTAINED, truth == Verdict.CONTACT
    assert contained.any()
    assert (answer[contained] != Verdict.CONTACT).all()
    assert (contact & (answer == Verdict.CONTAINED)).mean() < 0.1


@pytest.mark.parametrize(
    ("mesh", "reason"),
    [
        pytest.param(without_faces(box_mesh(), count=1), "a is open", id="open"),
        pytest.param(merge_meshes(box_mesh(), box_mesh()), "a has faces drawn twice", id="drawn twice"),
        pytest.param(
            merge_meshes(box_mesh(), shift_mesh(box_mesh(), [0.5, 0.3, 0.2])),
            "a has faces drawn twice, or parts that cross",
            id="two boxes that cross",
        ),
    ],
)
def test_meshes_without_ray_parity_are_invalid_not_clear(mesh, reason):
    """A ball is at 12 random places in a mesh that is open or overlaps itself: the parity of crossings along a ray says
    nothing of its inside. Every frame is invalid, with the reason.
    """
    answer = verdicts("image-space", mesh, ball_mesh(0.1))
    assert (answer.verdict == Verdict.INVALID).all()
    assert len(answer.reasons) == FRAMES
    assert all(text.startswith(reason) for text in answer.reasons.values())
