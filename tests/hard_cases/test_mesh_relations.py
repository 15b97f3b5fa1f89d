"""At mesh level no exact relation changes a body verdict or a face pair of the exact detector, bit for bit."""

import numpy as np
import pytest
from support.motions import KINDS, motion_of
from support.shapes import lab

from cdcore import Body, Motion, TriangleMesh, Verdict, create_detector

FRAMES = 40


def scene(kind):
    rng = np.random.default_rng(11)
    if kind == "lab":
        bodies, motion = lab(FRAMES, seed=11)
        return bodies[:3], Motion(
            motion.times, motion.translations[:, :3], motion.rotations[:, :3], motion.valid[:, :3]
        )
    bodies = [body(f"body {k}", KINDS[kind](rng)) for k in range(3)]
    turn, move = motion_of(kind, rng, FRAMES, 3)
    return bodies, Motion(np.arange(FRAMES) / 90, move, turn)


def body(name, triangles):
    return Body(name, TriangleMesh(triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3)))


def asked(bodies, motion):
    return create_detector("exact", bodies, containment=False).detect(motion, faces=True)


def remade(bodies, change):
    return [Body(one.name, change(one.mesh)) for one in bodies]


@pytest.mark.parametrize("kind", [*KINDS, "lab"])
@pytest.mark.parametrize("corners", [[1, 2, 0], [2, 1, 0]], ids=["turned round", "reversed"])
def test_renumbering_vertices_and_turning_corners_round_or_reversing_them_changes_nothing(kind, corners):
    bodies, motion = scene(kind)
    rng = np.random.default_rng(0)

    def change(mesh):
        order = rng.permutation(len(mesh.vertices))
        number = np.argsort(order)
        return TriangleMesh(mesh.vertices[order], number[mesh.faces][:, corners])

    before, after = asked(bodies, motion), asked(remade(bodies, change), motion)
    assert (before.digest, before.faces_digest) == (after.digest, after.faces_digest)
    assert (before.verdict == Verdict.CONTACT).any()


@pytest.mark.parametrize("relation", ["axes", "shift"])
@pytest.mark.parametrize("kind", ["lattice", "degenerate", "non-manifold"])
def test_turning_the_world_by_signed_axes_or_shifting_it_by_eights_keeps_every_face_pair(kind, relation):
    bodies, motion = scene(kind)
    turn, move = np.tile(np.eye(3), (FRAMES, 3, 1, 1)), motion.translations
    before = asked(bodies, Motion(motion.times, move, turn))
    if relation == "axes":
        quarter = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])
        after = asked(bodies, Motion(motion.times, move @ quarter.T, quarter @ turn))
    else:
        after = asked(bodies, Motion(motion.times, move + np.array([8.0, -16.0, 24.0]), turn))
    assert before.faces_digest == after.faces_digest
