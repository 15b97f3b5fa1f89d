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

FRAMES = 20
TWO_BALLS = merge_meshes(ball_mesh(0.1), shift_mesh(ball_mesh(0.1), [0.9, 0, 0]))
THREE_BALLS = merge_meshes(*(shift_mesh(ball_mesh(0.08), [0.5 * k, 0.1 * k, 0]) for k in range(3)))


def reversed_faces(mesh):
    """The mesh inside out."""
    return TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])


@cache
def pairs():
    """Name -> outer mesh, inner mesh."""
    return {
        "ball in box": (box_mesh(), ball_mesh(0.1)),
        "rod in box": (box_mesh(), rod_mesh()),
        "one ball of two": (box_mesh(), TWO_BALLS),
        "balls of three": (box_mesh(), THREE_BALLS),
        "hollow ball": (box_mesh(), merge_meshes(ball_mesh(0.1), reversed_faces(ball_mesh(0.05)))),
        "bead in glass": (beaker_mesh(radius=0.05, height=0.1, wall=0.02), ball_mesh(0.004)),
    }


def verdicts(name, first, second, seed=0):
    """The answer of a detector for the second body at random places within the bounds of the first."""
    rng = np.random.default_rng(seed)
    lower, upper = first.bounds
    rotations = random_rotations(rng, FRAMES, 2)
    positions = np.einsum("nij,nj->ni", rotations[:, 0], rng.uniform(lower, upper, (FRAMES, 3)))
    motion = Motion(np.arange(FRAMES), np.stack([0 * positions, positions], axis=1), rotations)
    return create_detector(name, [Body("a", first), Body("b", second)]).detect(motion)


@pytest.mark.parametrize(
    ("name", "exchanged"), [*((name, False) for name in pairs()), ("ball in box", True), ("one ball of two", True)]
)
def test_contained_bodies_are_not_called_contact(name, exchanged):
    """20 random places of the second body within the bounds of the first; truth is the answer of ``exact``."""
    first, second = pairs()[name]
    if exchanged:
        first, second = second, first
    truth, sample = (verdicts(asker, first, second).verdict[:, 0] for asker in ("exact", "image-space"))
    contained = truth == Verdict.CONTAINED
    assert exchanged or contained.sum() > 3
    assert not (sample[contained] == Verdict.CONTACT).any()
    # Rays pass a thin crossing now and then.
    assert ((truth == Verdict.CONTACT) & (sample == Verdict.CONTAINED)).mean() < 0.1


@pytest.mark.parametrize(
    ("mesh", "why"),
    [
        (without_faces(box_mesh(), count=1), "a is open"),
        (merge_meshes(box_mesh(), box_mesh()), "a has faces drawn twice"),
        (
            merge_meshes(box_mesh(), shift_mesh(box_mesh(), [0.5, 0.3, 0.2])),
            "a has faces drawn twice, or parts that cross",
        ),
    ],
)
def test_meshes_without_ray_parity_are_invalid_not_clear(mesh, why):
    """Crossings along a ray tell no inside of an open mesh, or of one that overlaps itself; boxes apart stay CLEAR."""
    answer = verdicts("image-space", mesh, ball_mesh(0.1))
    assert set(answer.verdict[:, 0].tolist()) <= {Verdict.INVALID, Verdict.CLEAR}
    assert (answer.verdict == Verdict.INVALID).any()
    assert all(reason.startswith(why) for reason in answer.reasons.values())
