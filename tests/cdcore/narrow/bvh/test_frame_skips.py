"""Paths bound how far a body moves, and frames are skipped until two paths use up the gap of two root boxes."""

import ctypes

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.processes import kernels_in_python
from support.shapes import box_mesh

from cdcore.narrow.bvh import tree_memory
from cdcore.narrow.bvh.box_tree import build_box_trees
from cdcore.narrow.bvh.frame_skips import next_frame_to_search, uses_up
from cdcore.narrow.bvh.tree_memory import BEYOND, COUNTERS, SKIPPED
from cdcore.narrow.bvh.whole_motion import Poses, SegmentSearch


def next_frame(row, frame, pad, work):
    """Without the compiler, which takes two seconds."""
    with kernels_in_python():
        return next_frame_to_search(tree_memory.pair_at(row, 0), frame, pad, work)


def gap_is_used_up(row, frame, later, gap):
    """Without the compiler too."""
    with kernels_in_python():
        return uses_up(tree_memory.pair_at(row, 0), frame, later, gap)


def search_of_cubes(translations, rotations=None, centre=(0.0, 0.0, 0.0), size=1.0):
    """A search of the first of some cubes against the others, at these poses (T, N, 3), (T, N, 3, 3).

    ``centre``: of each cube in its own axes; ``size``: its edge, in metres.
    """
    frames, bodies = translations.shape[:2]
    cube = box_mesh((size,) * 3, centre=centre).triangles
    if rotations is None:
        rotations = np.tile(np.eye(3), (frames, bodies, 1, 1))
    changed = np.ones((frames, bodies), dtype=bool)
    changed[1:] = (np.diff(translations, axis=0) != 0.0).any(axis=2)
    pairs = np.stack([np.zeros(bodies - 1, dtype=np.int64), np.arange(1, bodies)], axis=1)
    search = SegmentSearch(build_box_trees([cube] * bodies), pairs, frames, every=False)
    search.tracks.fill(*Poses(rotations, translations, changed))
    return search


def doubles_in(search, name, body, count):
    """So many numbers of the ``PoseMemory`` of a body."""
    return np.array((ctypes.c_double * count).from_address(int(search.tracks.rows[name][body])))


def test_path_is_that_of_the_centre_and_of_the_rotation():
    """The matrix of a rotation by w about an axis differs from 1 by 2 sqrt(2) sin(w / 2) in the Frobenius norm."""
    steps = np.arange(20) - (np.arange(20) >= 12)  # the body rests between frames 11 and 12
    angles, centre = 0.1 * steps, np.array([2.0, 0.5, -1.0])
    rotations = Rotation.from_rotvec(np.outer(angles, np.array([2, 3, 6]) / 7)).as_matrix()
    translations = np.outer(steps, [3.0, 4.0, 0.0])
    centres = rotations @ centre + translations
    search = search_of_cubes(np.stack([translations] * 2, axis=1), np.stack([rotations] * 2, axis=1), centre=centre)
    half_diagonal = np.sqrt(3.0) / 2
    by_rotation = 2 * np.sqrt(2.0) * np.sin(np.abs(np.diff(angles)) / 2) * half_diagonal
    exact = np.cumsum(np.linalg.norm(np.diff(centres, axis=0), axis=1) + by_rotation)
    path = doubles_in(search, "path", 0, 20)
    assert path[0] == 0.0
    assert (exact <= path[1:]).all()
    assert path[1:] == pytest.approx(exact, abs=1e-9)


def test_pose_memory_has_centres_and_distances_from_the_origin():
    """A row of ``stride`` numbers a coordinate; |(3, 4, 0)| = 5 m a step."""
    steps, centre = np.arange(20), np.array([2.0, 0.5, -1.0])
    translations = np.outer(steps, [3.0, 4.0, 0.0])
    search = search_of_cubes(np.stack([translations] * 2, axis=1), centre=centre)
    stride = int(search.tracks.rows["stride"][0])
    centres = doubles_in(search, "centres", body=0, count=3 * stride).reshape(3, stride)[:, :20].T
    assert centres == pytest.approx(translations + centre)
    assert doubles_in(search, "away", body=0, count=20) == pytest.approx(5.0 * steps)


def test_facts_of_a_body_are_skew_and_reach():
    """Body 0 has a rotation that is 1e-3 off; the reach of a unit cube is half its diagonal."""
    rotations = np.tile(np.eye(3), (4, 2, 1, 1))
    rotations[2, 0] += 1e-3 * np.arange(9).reshape(3, 3)
    search = search_of_cubes(np.zeros((4, 2, 3)), rotations)
    search.tracks.fill(rotations, np.zeros((4, 2, 3)), np.ones((4, 2), dtype=bool))
    skew, reach = doubles_in(search, "facts", 0, 2)
    assert skew == pytest.approx(np.linalg.norm(rotations[2, 0].T @ rotations[2, 0] - np.eye(3)))
    assert reach == pytest.approx(np.sqrt(3.0) / 2)
    assert 0.0 < doubles_in(search, "facts", 1, 2)[0] < 1e-14, "what rounding may hide"


FRAMES = 200
NEARER, AWAY = 0, 1
"""Pairs: a cube at rest with another that comes nearer by 1 cm a frame from 3 m on, and with one that goes away."""


@pytest.fixture(scope="module")
def two_pairs():
    """The search of both pairs; the cube that comes nearer rests from frame 49 to 59."""
    steps = np.arange(FRAMES) - np.clip(np.arange(FRAMES) - 49, 0, 10)
    translations = np.zeros((FRAMES, 3, 3))
    translations[:, 1, 0] = 3.0 - 0.01 * steps
    translations[:, 2, 0] = 3.0 + 0.01 * np.arange(FRAMES)
    return search_of_cubes(translations)


@pytest.mark.parametrize(
    ("pair", "frame", "following"),
    [
        # gap of a box and the ball around the other: 3 - 1/2 - sqrt(3)/2 = 1.634 m, 163.4 steps; 10 frames of rest
        (NEARER, 0, 174),
        (NEARER, 100, 174),
        (NEARER, 170, 174),
        (NEARER, 171, 171),  # fewer than four frames are not skipped
        (NEARER, 180, 180),
        (NEARER, 55, 56),  # repeats the frame before
        (AWAY, 0, 164),  # a path has no direction
        (AWAY, 100, FRAMES),
        (AWAY, 198, FRAMES),
    ],
)
def test_frames_are_skipped_until_paths_use_up_the_gap(two_pairs, pair, frame, following):
    """``following``: the next frame to search; what is between is counted as skipped, but for a repeated frame."""
    work = np.zeros(len(COUNTERS), dtype=np.int64)
    repeats = (pair, frame) == (NEARER, 55)
    assert next_frame(two_pairs.rows[pair], frame, pad=1e-13, work=work) == following
    assert two_pairs.marks[pair, 2, frame] == repeats
    assert work[SKIPPED] == (0 if repeats else following - frame)


def test_larger_pad_leaves_less_of_the_gap(two_pairs):
    """Size S = 3 m + sqrt(3) m: the gap is 1.634 m - S / 100, of which both paths may use 98 %: 155.5 steps."""
    work = np.zeros(len(COUNTERS), dtype=np.int64)
    assert next_frame(two_pairs.rows[NEARER], frame=0, pad=0.01, work=work) == 156 + 10


def test_paths_as_long_as_the_gap_use_it_up():
    """The bodies move by 1 and 3 m a frame, 20 m in the five frames from 5 to 10."""
    translations = np.zeros((12, 2, 3))
    translations[:, :, 0] = np.outer(np.arange(12.0), [1.0, -3.0])
    search = search_of_cubes(translations)
    moved = sum(path[10] - path[5] for path in (doubles_in(search, "path", body, 12) for body in (0, 1)))
    assert moved == pytest.approx(5 * (1 + 3))
    assert gap_is_used_up(search.rows[0], 5, 10, moved)
    assert not gap_is_used_up(search.rows[0], 5, 10, moved * (1 + 1e-11))


@pytest.mark.parametrize(
    ("size", "positions", "scaling", "verdict"),
    [
        (1.0, (0.0, 0.0), 1.0, 0),
        (1.0, (3.0, 0.0), 1.0, 0),
        (1.0, (0.0, 1e80), 1.0, BEYOND),
        (1.0, (1e80, 1e80), 1.0, BEYOND),
        (1e-120, (0.0, 0.0), 1.0, BEYOND),
        (1.0, (0.0, np.nan), 1.0, BEYOND),
        (1.0, (0.0, 3.0), 1.00001, BEYOND),
    ],
)
def test_extreme_sizes_and_skewed_rotations_are_beyond_the_kernels(size, positions, scaling, verdict):
    """Cubes of edge ``size`` at ``positions`` on x, with rotation matrices times ``scaling``.

    A frame that kernels cannot decide is marked BEYOND, and the next one follows.
    """
    translations = np.zeros((2, 2, 3))
    translations[:, :, 0] = positions
    rotations = np.tile(np.eye(3) * scaling, (2, 2, 1, 1))
    search = search_of_cubes(translations, rotations, size=size)
    following = next_frame(search.rows[0], frame=0, pad=1e-13, work=np.zeros(len(COUNTERS), dtype=np.int64))
    assert search.marks[0, 1, 0] == verdict
    assert (following == 1) == (verdict == BEYOND)
