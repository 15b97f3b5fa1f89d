"""No change of meshes or poses that rounds nothing changes a verdict or a face pair of the detector ``exact``."""

import numpy as np
import pytest
from support.random_worlds import KINDS, motion_of
from support.shapes import lab_bodies_and_motion, unrotated_motion

from cdcore import Body, Motion, TriangleMesh, Verdict, create_detector

FRAMES = 24


def bodies_and_motion(kind):
    """Three bodies of a kind of mesh, and 24 frames in which they meet now and then."""
    rng = np.random.default_rng(11)
    if kind == "lab":
        bodies, motion = lab_bodies_and_motion(frames=FRAMES, seed=11)
        return bodies[:3], Motion(
            motion.times, motion.translations[:, :3], motion.rotations[:, :3], motion.valid[:, :3]
        )
    bodies = [body(f"body {k}", KINDS[kind](rng)) for k in range(3)]
    rotation, move = motion_of(kind, rng, FRAMES, bodies=3)
    return bodies, Motion(np.arange(FRAMES) / 90, move, rotation)


def body(name, triangles):
    """A body whose faces are these triangles (n, 3, 3)."""
    return Body(name, TriangleMesh(triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3)))


def exact_detection(bodies, motion, pairs=None):
    """The answer of ``exact``, with faces, and without the question whether a body is inside another."""
    return create_detector("exact", bodies, pairs=pairs, containment=False).detect(motion, faces=True)


each_kind = pytest.mark.parametrize("kind", [*KINDS, "lab"])
"""Kinds of meshes: soups of triangles, on a lattice, degenerate, non-manifold, and bodies of a laboratory."""


@pytest.mark.sampled(10)
@each_kind
@pytest.mark.parametrize("corners", [[1, 2, 0], [2, 1, 0]], ids=["corners turned round", "corners reversed"])
def test_renumbering_vertices_or_reversing_faces_changes_nothing(kind, corners):
    """The vertices of three bodies are numbered anew, at random, and each face lists its three in another order.

    Verdicts and lists of faces stay the same, of which digests are compared; some bodies are in contact.
    """
    bodies, motion = bodies_and_motion(kind)
    rng, changed_bodies = np.random.default_rng(0), []
    for item in bodies:
        order = rng.permutation(len(item.mesh.vertices))
        new_number = np.argsort(order)
        mesh = TriangleMesh(item.mesh.vertices[order], new_number[item.mesh.faces][:, corners])
        changed_bodies.append(Body(item.name, mesh))
    before, after = exact_detection(bodies, motion), exact_detection(changed_bodies, motion)
    assert (before.verdict == Verdict.CONTACT).any()
    assert (before.digest, before.faces_digest) == (after.digest, after.faces_digest)


@each_kind
def test_permuting_faces_permutes_the_face_pairs(kind):
    """The faces of three bodies are numbered anew, at random: those that meet are the same by their new numbers."""
    bodies, motion = bodies_and_motion(kind)
    orders = [np.random.default_rng(k).permutation(len(item.mesh.faces)) for k, item in enumerate(bodies)]
    changed_bodies = [
        Body(item.name, TriangleMesh(item.mesh.vertices, item.mesh.faces[order]))
        for item, order in zip(bodies, orders, strict=True)
    ]
    before, after = exact_detection(bodies, motion), exact_detection(changed_bodies, motion)
    assert before.digest == after.digest
    new_numbers = [np.argsort(order) for order in orders]
    contacts = np.argwhere(before.face_counts > 0).tolist()
    assert contacts
    for frame, pair in contacts:
        first, second = before.pairs[pair].tolist()
        first_faces, second_faces = before.faces(frame, pair).T
        expected = sorted(
            zip(new_numbers[first][first_faces].tolist(), new_numbers[second][second_faces].tolist(), strict=True)
        )
        assert [tuple(faces) for faces in after.faces(frame, pair).tolist()] == expected, (frame, pair)


def split_in_four(solid):
    """The body with each face split in four at the midpoints of its edges."""
    a, b, c = np.moveaxis(solid.mesh.triangles, 1, 0)
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    quarters = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return body(solid.name, np.concatenate([np.stack(corners, axis=1) for corners in quarters]))


@pytest.mark.parametrize(("kind", "spread"), [("lattice", 8), ("degenerate", 4), ("non-manifold", 2)])
def test_splitting_faces_at_dyadic_midpoints_keeps_the_verdicts(kind, spread):
    """Each face of three bodies is split in four; poses round nothing: unrotated, shifted by quarters of a metre.

    So midpoints of edges stay midpoints. ``spread``: the bodies are so many times farther from each other, so that some
    pairs meet and some do not.
    """
    bodies, motion = bodies_and_motion(kind)
    unrotated = unrotated_motion(spread * motion.translations, motion.times)
    before = exact_detection(bodies, unrotated)
    after = exact_detection([split_in_four(solid) for solid in bodies], unrotated)
    assert 0 < (before.verdict == Verdict.CONTACT).mean() < 1
    assert np.array_equal(before.verdict, after.verdict)


@each_kind
def test_pairs_queried_together_equal_pairs_queried_alone(kind):
    """Two pairs of three bodies, by one detector and by one each: verdicts, and how many faces meet in each frame."""
    bodies, motion = bodies_and_motion(kind)
    pairs = [(0, 1), (1, 2)]
    together = exact_detection(bodies, motion, pairs)
    for column, pair in enumerate(pairs):
        alone = exact_detection(bodies, motion, [pair])
        assert np.array_equal(together.verdict[:, [column]], alone.verdict), column
        assert np.array_equal(together.face_counts[:, [column]], alone.face_counts), column


@pytest.mark.parametrize("kind", ["lattice", "degenerate", "non-manifold"])
def test_exchanged_axes_keep_every_face_pair(kind):
    """Three unrotated bodies, and the same world with its axes exchanged and two of them negated, which
    rounds nothing.
    """
    bodies, motion = bodies_and_motion(kind)
    unrotated = unrotated_motion(motion.translations, motion.times)
    exchange = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])
    exchanged = Motion(motion.times, motion.translations @ exchange.T, exchange @ unrotated.rotations)
    before, after = exact_detection(bodies, unrotated), exact_detection(bodies, exchanged)
    assert before.face_counts.any()
    assert before.faces_digest == after.faces_digest


@pytest.mark.parametrize("kind", ["lattice", "degenerate", "non-manifold"])
def test_shifts_by_multiples_of_8_keep_every_face_pair(kind):
    """Three unrotated bodies, and the same world moved by (8, -16, 24) m, which rounds nothing."""
    bodies, motion = bodies_and_motion(kind)
    unrotated = unrotated_motion(motion.translations, motion.times)
    shifted = unrotated_motion(motion.translations + np.array([8.0, -16.0, 24.0]), motion.times)
    before, after = exact_detection(bodies, unrotated), exact_detection(bodies, shifted)
    assert before.face_counts.any()
    assert before.faces_digest == after.faces_digest
