"""At mesh level no exact relation changes a body verdict or a face pair of the exact detector, bit for bit."""

import numpy as np
import pytest
from support.random_worlds import KINDS, motion_of
from support.shapes import lab_bodies_and_motion, unrotated_motion

from cdcore import Body, Motion, TriangleMesh, Verdict, create_detector

FRAMES = 24


def scene(kind):
    """Three bodies of a kind of mesh, and a motion in which they meet now and then."""
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
    """The answer of ``exact`` for surfaces alone, with faces."""
    return create_detector("exact", bodies, pairs=pairs, containment=False).detect(motion, faces=True)


def remade(bodies, change):
    """The same bodies with changed meshes."""
    return [Body(item.name, change(item.mesh)) for item in bodies]


def same_faces(before, after, names=lambda faces: faces):
    """Fails unless both detections list the same faces, under other names."""
    for frame, pair in np.argwhere(before.face_counts > 0).tolist():
        want = names(before.faces(frame, pair))
        assert np.array_equal(after.faces(frame, pair), want[np.lexsort((want[:, 1], want[:, 0]))])


by_kind = pytest.mark.parametrize("kind", [*KINDS, "lab"])


@pytest.mark.sampled(10)
@by_kind
@pytest.mark.parametrize("corners", [[1, 2, 0], [2, 1, 0]], ids=["turned round", "reversed"])
def test_renumbering_vertices_or_reversing_faces_changes_nothing(kind, corners):
    """Corners: the order in which a face lists its three vertices afterwards."""
    bodies, motion = scene(kind)
    rng = np.random.default_rng(0)

    def change(mesh):
        order = rng.permutation(len(mesh.vertices))
        number = np.argsort(order)
        return TriangleMesh(mesh.vertices[order], number[mesh.faces][:, corners])

    before, after = exact_detection(bodies, motion), exact_detection(remade(bodies, change), motion)
    assert (before.digest, before.faces_digest) == (after.digest, after.faces_digest)
    assert (before.verdict == Verdict.CONTACT).any()


@by_kind
def test_permuting_faces_permutes_the_face_pairs(kind):
    """Faces are numbered anew, and those that meet get their new numbers."""
    bodies, motion = scene(kind)
    orders = [np.random.default_rng(k).permutation(len(item.mesh.faces)) for k, item in enumerate(bodies)]
    changed = [
        Body(item.name, TriangleMesh(item.mesh.vertices, item.mesh.faces[order]))
        for item, order in zip(bodies, orders, strict=True)
    ]
    before, after = exact_detection(bodies, motion, [(0, 1)]), exact_detection(changed, motion, [(0, 1)])
    assert before.digest == after.digest
    numbers = [np.argsort(order) for order in orders]
    same_faces(before, after, lambda faces: np.stack([numbers[0][faces[:, 0]], numbers[1][faces[:, 1]]], axis=1))


@pytest.mark.parametrize(("kind", "spread"), [("lattice", 8), ("degenerate", 4), ("non-manifold", 2)])
def test_splitting_faces_at_dyadic_midpoints_keeps_the_verdicts(kind, spread):
    """Poses round nothing: unrotated, shifted by quarters of a metre, where midpoints of edges stay midpoints.

    ``spread``: the bodies are so many times farther from each other, so that some pairs meet and some do not.
    """
    bodies, motion = scene(kind)
    unrotated = unrotated_motion(spread * motion.translations, motion.times)

    def four(solid):
        t = solid.mesh.triangles
        a, b, c = t[:, 0], t[:, 1], t[:, 2]
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        pieces = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        return body(solid.name, np.concatenate([np.stack(piece, axis=1) for piece in pieces]))

    before, after = exact_detection(bodies, unrotated), exact_detection([four(solid) for solid in bodies], unrotated)
    assert np.array_equal(before.verdict, after.verdict)
    assert 0 < (before.verdict == Verdict.CONTACT).mean() < 1


@by_kind
def test_pairs_queried_together_equal_pairs_queried_alone(kind):
    """Verdicts and numbers of meeting faces of two pairs of three bodies."""
    bodies, motion = scene(kind)
    both = exact_detection(bodies, motion, [(0, 1), (1, 2)])
    pieces = [exact_detection(bodies, motion, [pair]) for pair in ((0, 1), (1, 2))]
    assert np.array_equal(both.verdict, np.concatenate([piece.verdict for piece in pieces], axis=1))
    for column, piece in enumerate(pieces):
        assert np.array_equal(both.face_counts[:, column], piece.face_counts[:, 0])


@pytest.mark.parametrize("relation", ["axes", "shift"])
@pytest.mark.parametrize("kind", ["lattice", "degenerate", "non-manifold"])
def test_signed_axis_rotations_and_shifts_keep_every_face_pair(kind, relation):
    """Coordinates are only exchanged, negated or moved by multiples of 8, so that nothing is rounded."""
    bodies, motion = scene(kind)
    rotation, move = np.tile(np.eye(3), (FRAMES, 3, 1, 1)), motion.translations
    before = exact_detection(bodies, Motion(motion.times, move, rotation))
    if relation == "axes":
        quarter = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])
        after = exact_detection(bodies, Motion(motion.times, move @ quarter.T, quarter @ rotation))
    else:
        after = exact_detection(bodies, Motion(motion.times, move + np.array([8.0, -16.0, 24.0]), rotation))
    assert before.faces_digest == after.faces_digest
