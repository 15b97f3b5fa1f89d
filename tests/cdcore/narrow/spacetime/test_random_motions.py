"""Whole motions drawn at random, short and hard, against every face pair of every frame: equal sets, equal digests.

Bodies share faces, slide along each other, stand still bit for bit, are open, non-manifold, flat or needles, tiny or
huge, and have no pose now and then.
"""

import numpy as np
import pytest
from support.motions import KINDS, grid_plate, motion_of, placed, turned_by
from support.shapes import ball_mesh, box_mesh

from cdcore import Body, Motion, TriangleMesh, Verdict, create_detector
from cdcore.narrow.brute_force import meeting_faces_exhaustive
from cdcore.narrow.spacetime import whole_motion

FRAMES = 13
SCALES = (1.0, 1e-6, 1e6, 2.0**40, 2.0**-60, 2.0**300, 2.0**-320)


def needles(rng, count=12):
    """Faces a billionth as wide as long, some of them without any width."""
    start, along = rng.integers(-2, 3, (2, count, 3)).astype(float)
    tip = start + along / 2 + rng.normal(size=(count, 3)) * 1e-9 * rng.integers(0, 2, (count, 1))
    return np.stack([start, start + along, tip], axis=1)


def open_box(rng):
    """A cube without some of its faces."""
    faces = box_mesh().triangles
    return faces[np.sort(rng.permutation(len(faces))[: rng.integers(3, len(faces))])]


def points_and_segments(rng, count=10):
    corners = rng.integers(-1, 2, (count, 3, 3)).astype(float)
    corners[: count // 2, 1] = corners[: count // 2, 0]
    corners[: count // 4, 2] = corners[: count // 4, 0]
    return corners


SHAPES = {
    **KINDS,
    "needles": needles,
    "open box": open_box,
    "points and segments": points_and_segments,
    "plate": lambda rng: grid_plate(3) - np.array([1.5, 1.5, 0]),
    "cube": lambda rng: box_mesh().triangles,
    "ball": lambda rng: ball_mesh(0.5).triangles,
}


def resting(rng, bodies):
    """Stands still, bit for bit, in one world turned as a whole or not at all; faces flush."""
    turn = np.tile(turned_by(rng, 1, 3.0)[0] if rng.random() < 0.5 else np.eye(3), (FRAMES, bodies, 1, 1))
    place = np.cumsum(rng.integers(-1, 2, (bodies, 3)), axis=0) * rng.choice([0.5, 1.0])
    return turn, np.tile(place @ turn[0, 0].T, (FRAMES, 1, 1))


def sliding(rng, bodies):
    """Moves along a grid's axes in exact steps: faces stay in common planes while they slide."""
    turn = np.tile(np.eye(3), (FRAMES, bodies, 1, 1))
    step = np.zeros((bodies, 3))
    step[np.arange(bodies), rng.integers(0, 3, bodies)] = rng.choice([0.0, 0.125, -0.25], bodies)
    place = rng.integers(-1, 2, (bodies, 3)) * 0.5
    return turn, place + np.arange(FRAMES)[:, None, None] * step


def drifting(rng, bodies):
    return motion_of(rng.choice(["soup", "lattice"]), rng, FRAMES, bodies)


MOVES = (resting, sliding, drifting)


def drawn(seed):
    """Bodies as triangles (f, 3, 3), and a motion of theirs with some poses missing."""
    rng = np.random.default_rng([seed, 20])
    names = rng.choice(list(SHAPES), 3)
    scale = SCALES[rng.integers(len(SCALES))]
    meshes = [SHAPES[name](rng) * scale for name in names]
    turn, move = MOVES[seed % len(MOVES)](rng, len(meshes))
    valid = rng.random((FRAMES, len(meshes))) > (0.15 if rng.random() < 0.5 else 0.0)
    return meshes, Motion(np.arange(FRAMES) / 90, move * scale, turn, valid)


def bodies_of(meshes):
    return [
        Body(f"body {k}", TriangleMesh(some.reshape(-1, 3), np.arange(3 * len(some)).reshape(-1, 3)))
        for k, some in enumerate(meshes)
    ]


def expected(meshes, motion, frame, i, j):
    first, second = (placed(meshes[k], motion.rotations[frame, k], motion.translations[frame, k]) for k in (i, j))
    return meeting_faces_exhaustive(first, second)


def asked(meshes, motion, **settings):
    return create_detector("exact", bodies_of(meshes), containment=False, **settings).detect(motion, faces=True)


def contacts_checked(seed):
    """Check one drawn motion pair-frame by pair-frame; returns how many face pairs met."""
    meshes, motion = drawn(seed)
    found, count = asked(meshes, motion), 0
    for frame in range(FRAMES):
        for column, (i, j) in enumerate(found.pairs.tolist()):
            verdict = found.verdict[frame, column]
            if not (motion.valid[frame, i] and motion.valid[frame, j]):
                assert verdict == Verdict.NO_POSE, (seed, frame, column)
                continue
            want = expected(meshes, motion, frame, i, j)
            assert verdict == (Verdict.CONTACT if len(want) else Verdict.CLEAR), (seed, frame, column)
            assert np.array_equal(found.faces(frame, column), want), (seed, frame, column)
            count += len(want)
    return count


def digests_of(meshes, motion, **settings):
    """Of verdicts and of faces."""
    detection = asked(meshes, motion, **settings)
    return detection.digest, detection.faces_digest


def check_digests(seed, monkeypatch):
    meshes, motion = drawn(seed)
    want = digests_of(meshes, motion)
    turned = np.array([[1, 2], [0, 1], [0, 2]])
    for name, length in (("FRAMES_AT_ONCE", 3), ("FRAMES_PER_TASK", 2)):
        monkeypatch.setattr(whole_motion, name, length)
    assert digests_of(meshes, motion) == want, seed
    assert digests_of(meshes, motion, pairs=turned) == want, seed
    for threads in (2, 3):
        assert digests_of(meshes, motion, threads=threads) == want, seed
    blocks = [motion.take(np.arange(start, min(start + 5, FRAMES))) for start in range(0, FRAMES, 5)]
    detector = create_detector("exact", bodies_of(meshes), containment=False)
    streamed = list(detector.stream(iter(blocks), faces=True))
    whole = asked(meshes, motion)
    assert np.array_equal(np.concatenate([one.verdict for one in streamed]), whole.verdict), seed
    for frame in range(FRAMES):
        for column in range(3):
            assert np.array_equal(streamed[frame // 5].faces(frame % 5, column), whole.faces(frame, column)), seed


@pytest.mark.parametrize("seeds", [range(12), pytest.param(range(12, 40), marks=pytest.mark.slow)], ids=len)
def test_random_motions_equal_the_test_of_all_face_pairs(seeds):
    assert sum(contacts_checked(seed) > 0 for seed in seeds) >= 0.75 * len(seeds), "most of them have contacts"


def test_threads_blocks_and_the_order_of_pairs_change_no_digest(monkeypatch):
    for seed in range(100, 112):
        check_digests(seed, monkeypatch)


@pytest.mark.slow
def test_two_hundred_and_forty_more_random_motions_equal_the_test_of_all_face_pairs():
    seeds = (*range(40, 80), *range(200, 400))
    assert sum(contacts_checked(seed) > 0 for seed in seeds) >= 180
