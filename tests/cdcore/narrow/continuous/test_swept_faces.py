"""Faces that are said to stay apart never meet on the way; at rest, faces that are apart are always found so."""

import numpy as np
import pytest
from motions import KINDS

from cdcore.kernels.compiling import kernel
from cdcore.narrow.continuous.swept_faces import faces_stay_apart
from cdcore.narrow.predicates import triangles_intersect


@kernel
def stay_apart(corners, margin):
    return faces_stay_apart(corners, margin, np.empty(32))


def corners_of(before, after, other):
    return np.concatenate([before.ravel(), after.ravel(), other.ravel()])


@pytest.mark.parametrize("kind", KINDS)
def test_faces_said_to_stay_apart_meet_at_no_time(kind):
    rng = np.random.default_rng(5)
    said = 0
    for _ in range(400):
        before, after = KINDS[kind](rng)[rng.integers(0, 12, 2)]
        other = KINDS[kind](rng)[3] + rng.integers(-2, 3, 3)
        if not stay_apart(corners_of(before, after, other), 1e-12):
            continue
        said += 1
        way = np.linspace(0, 1, 33)[:, None, None]
        placed = (1 - way) * before + way * after
        assert not triangles_intersect(np.stack([placed, np.broadcast_to(other, placed.shape)], axis=1)).any()
    assert said > 40


@pytest.mark.parametrize("kind", KINDS)
def test_at_rest_every_pair_of_faces_that_is_apart_is_found_apart(kind):
    rng = np.random.default_rng(6)
    faces, others = (KINDS[kind](rng) * (0.5 if kind == "soup" else 1.0) for _ in (0, 1))
    others = others + rng.integers(-1, 2, (len(others), 1, 3))
    pairs = np.stack(np.broadcast_arrays(faces[:, None], others[None]), axis=2).reshape(-1, 2, 3, 3)
    meets = triangles_intersect(pairs)
    found = [stay_apart(corners_of(a, a, b), 1e-12) for a, b in pairs]
    assert np.array_equal(np.array(found), ~meets)
    assert 0 < meets.sum() < len(meets)


def test_what_may_leave_the_chord_further_than_the_gap_is_not_said_to_stay_apart():
    low = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    high = low + np.array([0, 0, 1e-3])
    assert stay_apart(corners_of(high, high + np.array([5, 5, 0]), low), 0.99e-3)
    assert not stay_apart(corners_of(high, high + np.array([0.1, 0.1, 0]), low), 1.01e-3)


def test_a_face_that_passes_from_one_side_to_the_other_is_not_said_to_stay_apart():
    low = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    up = np.array([0, 0, 1.0])
    assert not stay_apart(corners_of(low + up, low - up, low), 1e-12)
