"""The pad is larger than rounding; no corners are nearer than the gap; the chord is the largest distance.

A search compares two bodies in the frame of one of them, in floats; the reference is corners placed in the world.
"""

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


@pytest.mark.parametrize(
    ("distance", "scaling"),
    [
        pytest.param(0.0, 0.0, id="at the origin"),
        pytest.param(1.0, 0.0, id="1 m away"),
        pytest.param(1e3, 0.0, id="1 km away"),
        pytest.param(1e6, 0.0, id="1,000 km away"),
        pytest.param(1.0, 1e-9, id="1 m away, rotations stretched by 1e-9"),
    ],
)
def test_relative_arithmetic_stays_within_the_pad_of_the_reference_vertices(distance, scaling):
    """A corner of body A in the axes of B, by products of doubles and, from its place in the world, in rationals.

    They differ by less than a tenth of the pad, also where a rotation stretches, so that its transpose is not quite its
    inverse.
    """
    rng = np.random.default_rng(int(distance))
    largest_fraction = 0.0
    for _ in range(60):
        rotation_a, rotation_b = random_rotations(rng, 2) * (1.0 + scaling)
        corner = rng.normal(size=3)
        move_a = rng.normal(size=3) + distance
        move_b = move_a + rng.normal(size=3)
        (world,) = place_points(corner[None], rotation_a, move_a)
        offset = [Fraction(float(x)) - Fraction(float(t)) for x, t in zip(world, move_b, strict=True)]
        exact = np.array([float(x) for x in exact_inverse_times(rotation_b, offset)])
        in_doubles = (rotation_b.T @ rotation_a) @ corner + rotation_b.T @ (move_a - move_b)
        size = np.linalg.norm(corner) + np.linalg.norm(move_a) + np.linalg.norm(move_b)
        skew = sum(np.linalg.norm(rotation.T @ rotation - np.eye(3)) for rotation in (rotation_a, rotation_b))
        largest_fraction = max(largest_fraction, np.linalg.norm(exact - in_doubles) / position_pad(size, skew))
    assert 0.0 < largest_fraction < 0.1


def gap_of(row, frame, pad):
    """The gap of the root boxes of a pair in a frame, less the pad, without the compiler."""
    with kernels_in_python():
        return root_gap(tree_memory.pair_at(row, 0), frame, pad)


@pytest.mark.sampled(3)
@pytest.mark.parametrize("separation", [0.0, 3.0, 30.0], ids="moved {} m apart".format)
def test_no_two_corners_are_nearer_than_the_gap(separation):
    """Two soups of triangles in eight frames: the gap of their boxes is a lower bound of their distance."""
    scene = EightFrames(seed=1, separation=separation)
    for frame in range(8):
        first, second = (world.reshape(-1, 3) for world in scene.world(frame))
        distance = np.linalg.norm(first[:, None] - second[None], axis=2).min()
        assert gap_of(scene.row, frame, scene.pad) <= distance, frame


def test_gap_of_distant_bodies_is_most_of_their_distance():
    """Two soups of triangles some metres large, 30 m from each other."""
    scene = EightFrames(seed=1, separation=30.0)
    assert min(gap_of(scene.row, frame, scene.pad) for frame in range(8)) > 20


def test_root_gap_is_between_box_and_ball():
    """The larger of the gaps from either's box to the other's bounding ball, less the pad of 1 mm.

    A box is a row of its centre (3), axes (9), half edges (3) and half diagonal, the ball's radius. The plates lie
    askew in their bodies, as a box along the axes of its body would leave half of the formula untested.
    """
    pad, rng = 1e-3, np.random.default_rng(3)
    tilt, *rotations = random_rotations(rng, 17)
    rotations = np.reshape(rotations, (8, 2, 3, 3))
    plate = (rng.uniform(-0.5, 0.5, (60, 3, 3)) * [1.0, 0.4, 0.01]) @ tilt
    trees = build_box_trees([plate, plate[:40]])
    moves = rng.normal(size=(8, 2, 3)) * 2.0
    row, _in_memory = row_of_pair(trees, rotations, moves)
    boxes = [tree.boxes[0] for tree in trees]
    assert np.abs(boxes[0][3:12]).min() > 0.01, "axes are askew"
    for frame in range(8):
        middles = [rotations[frame, k] @ boxes[k][:3] + moves[frame, k] for k in range(2)]
        gaps = []
        for box, ball in ((0, 1), (1, 0)):
            world_axes = rotations[frame, box] @ boxes[box][3:12].reshape(3, 3)
            along_axes = world_axes.T @ (middles[ball] - middles[box])
            distance = np.linalg.norm(np.maximum(np.abs(along_axes) - boxes[box][12:15], 0.0))
            gaps.append(distance - boxes[ball][15])
        assert gap_of(row, frame, pad) == pytest.approx(max(gaps) - pad, abs=1e-9), frame


@pytest.mark.parametrize("seed", range(4))
def test_the_chord_is_the_largest_spectral_distance_from_the_middle(seed):
    """The relative rotations of eight frames are compared with that of frame 4: the largest spectral norm of a
    difference.
    """
    scene = EightFrames(seed)
    rotations = scene.relative[:72].reshape(3, 3, 8).transpose(2, 0, 1)
    middle = scene.middle[:9].reshape(3, 3)
    assert np.array_equal(middle, rotations[4])
    largest = max(np.linalg.norm(rotation - middle, 2) for rotation in rotations)
    assert largest * (1 - 1e-13) <= scene.chord <= largest * (1 + 1e-9) + 1e-15
