"""The pad is larger than rounding; no corners are nearer than the gap; the chord is the largest distance."""

from fractions import Fraction

import numpy as np
import pytest
from support.processes import kernels_in_python
from support.search_scenes import EightFrames, row_of_pair
from support.shapes import random_rotations

from cdcore.narrow.bvh import tree_memory
from cdcore.narrow.bvh.bounds import position_pad
from cdcore.narrow.bvh.box_tree import build_box_trees
from cdcore.narrow.bvh.frame_skips import root_gap
from cdcore.poses import place_points


def exact_inverse_times(rotation, vector):
    """R^-1 v in rationals, by Cramer's rule."""
    r = [[Fraction(float(x)) for x in row] for row in rotation]
    v = [Fraction(x) for x in vector]

    def det(m):
        return (
            m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1])
            - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
            + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
        )

    whole = det(r)
    return [det([[v[i] if j == k else r[i][j] for j in range(3)] for i in range(3)]) / whole for k in range(3)]


@pytest.mark.parametrize(("distance", "scaling"), [(0.0, 0.0), (1.0, 0.0), (1e3, 0.0), (1e6, 0.0), (1.0, 1e-9)])
def test_relative_arithmetic_stays_within_the_pad_of_the_reference_vertices(distance, scaling):
    """A corner of a in the axes of b: by doubles and in rationals it differs by less than a tenth of the pad.

    A rotation that also stretches (``scaling``) is inverted only roughly by its transpose.
    """
    rng = np.random.default_rng(int(distance))
    worst = 0.0
    for _ in range(60):
        rotation_a, rotation_b = random_rotations(rng, 2) * (1.0 + scaling)
        corner = rng.normal(size=3)
        move_a = rng.normal(size=3) + distance
        move_b = move_a + rng.normal(size=3)
        world = place_points(corner[None], rotation_a, move_a)[0]
        offset = [Fraction(float(x)) - Fraction(float(t)) for x, t in zip(world, move_b, strict=True)]
        true = np.array([float(x) for x in exact_inverse_times(rotation_b, offset)])
        quick = (rotation_b.T @ rotation_a) @ corner + rotation_b.T @ (move_a - move_b)
        size = np.linalg.norm(corner) + np.linalg.norm(move_a) + np.linalg.norm(move_b)
        skew = sum(
            np.linalg.norm(frame_rotation.T @ frame_rotation - np.eye(3)) for frame_rotation in (rotation_a, rotation_b)
        )
        worst = max(worst, np.linalg.norm(true - quick) / position_pad(size, skew))
    assert 0.0 < worst < 0.1


def gap_of(row, frame, pad):
    """The gap of the root boxes in a frame, without the compiler."""
    with kernels_in_python():
        return root_gap(tree_memory.pair_at(row, 0), frame, pad)


@pytest.mark.sampled(3)
@pytest.mark.parametrize("separation", [0.0, 3.0, 30.0])
def test_no_two_corners_are_nearer_than_the_gap(separation):
    """The gap is a lower bound of the distance; that of bodies 30 m apart is above 20 m."""
    scene = EightFrames(seed=1, separation=separation)
    for frame in range(8):
        gap = gap_of(scene.row, frame, scene.pad)
        first, second = (world.reshape(-1, 3) for world in scene.world(frame))
        assert gap <= np.linalg.norm(first[:, None] - second[None], axis=2).min()
        assert separation < 30 or gap > 20


def test_root_gap_is_between_box_and_ball():
    """The larger of the gaps from either's box to the other's bounding ball, less the pad of 1 mm."""
    rng = np.random.default_rng(3)
    tilt, *rotations = random_rotations(rng, 17)
    rotations = np.reshape(rotations, (8, 2, 3, 3))
    plate = (rng.uniform(-0.5, 0.5, (60, 3, 3)) * [1.0, 0.4, 0.01]) @ tilt
    trees = build_box_trees([plate, plate[:40]])
    moves = rng.normal(size=(8, 2, 3)) * 2.0
    row, _kept = row_of_pair(trees, rotations, moves)
    boxes = [tree.boxes[0] for tree in trees]
    assert np.abs(boxes[0][3:12]).min() > 0.01, "a box along the axes of its body asks half of it only"
    for frame in range(8):
        middles = [rotations[frame, k] @ boxes[k][:3] + moves[frame, k] for k in range(2)]
        gaps = []
        for box, ball in ((0, 1), (1, 0)):
            along = (rotations[frame, box] @ boxes[box][3:12].reshape(3, 3)).T @ (middles[ball] - middles[box])
            gaps.append(np.linalg.norm(np.maximum(np.abs(along) - boxes[box][12:15], 0.0)) - boxes[ball][15])
        assert gap_of(row, frame, 1e-3) == pytest.approx(max(gaps) - 1e-3, abs=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_the_chord_is_the_largest_spectral_distance_from_the_middle(seed):
    """Rotations of eight frames, measured to that of frame 4."""
    scene = EightFrames(seed)
    rotations = scene.relative[:72].reshape(3, 3, 8).transpose(2, 0, 1)
    assert np.array_equal(scene.middle[:9].reshape(3, 3), rotations[4])
    largest = max(np.linalg.norm(frame_rotation - rotations[4], 2) for frame_rotation in rotations)
    assert largest * (1 - 1e-13) <= scene.chord <= largest * (1 + 1e-9) + 1e-15
