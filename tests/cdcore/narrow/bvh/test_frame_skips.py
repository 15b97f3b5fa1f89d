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
from cdcore.narrow.bvh.whole_motion import REPEATS, VOLUMES, Poses, SegmentSearch


def next_frame(row, frame, pad, work):
    """The next frame of a pair to be searched after a frame, without the compiler, which takes two seconds."""
    with kernels_in_python():
        return next_frame_to_search(tree_memory.pair_at(row, 0), frame, pad, work)


def gap_is_used_up(row, frame, later, gap):
    """Whether the paths of both bodies from a frame to a later one use up a gap, without the compiler too."""
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
    """The first ``count`` numbers of an array of the search's memory for a body, by the array's name."""
    return np.array((ctypes.c_double * count).from_address(int(search.tracks.rows[name][body])))


def test_path_is_that_of_the_centre_and_of_the_rotation():
    """A cube of 1 m moves by 5 m and turns by 0.1 radians a frame, and rests from frame 11 to 12.

    Its path grows by the way of its centre, and by its radius times the change of rotation: a matrix of a rotation by w
    differs from 1 by 2 sqrt(2) sin(w / 2) in the Frobenius norm.
    """
    frames = np.arange(20)
    steps, centre = frames - (frames >= 12), np.array([2.0, 0.5, -1.0])
    angles, unit_axis = 0.1 * steps, np.array([2, 3, 6]) / 7
    rotations = Rotation.from_rotvec(np.outer(angles, unit_axis)).as_matrix()
    translations = np.outer(steps, [3.0, 4.0, 0.0])
    search = search_of_cubes(np.stack([translations] * 2, axis=1), np.stack([rotations] * 2, axis=1), centre=centre)
    radius = np.sqrt(3.0) / 2
    of_centre = np.linalg.norm(np.diff(rotations @ centre + translations, axis=0), axis=1)
    of_rotation = 2 * np.sqrt(2.0) * np.sin(np.abs(np.diff(angles)) / 2) * radius
    exact = np.cumsum(of_centre + of_rotation)
    start, *path = doubles_in(search, "path", body=0, count=20)
    assert start == 0.0
    assert (exact <= path).all(), "never shorter"
    assert path == pytest.approx(exact, abs=1e-9)


def test_pose_memory_has_centres_and_distances_from_the_origin():
    """A body moves by (3, 4, 0), 5 m a frame, from the origin; the middle of its cube is at (2, 0.5, -1).

    Centres are stored coordinate by coordinate, ``stride`` numbers each; ``away`` is of the body's origin.
    """
    steps, centre = np.arange(20), np.array([2.0, 0.5, -1.0])
    translations = np.outer(steps, [3.0, 4.0, 0.0])
    search = search_of_cubes(np.stack([translations] * 2, axis=1), centre=centre)
    stride = int(search.tracks.rows["stride"][0])
    centres = doubles_in(search, "centres", body=0, count=3 * stride).reshape(3, stride)[:, :20].T
    assert centres == pytest.approx(translations + centre)
    assert doubles_in(search, "away", body=0, count=20) == pytest.approx(5.0 * steps)


def test_facts_of_a_body_are_skew_and_reach():
    """Skew: by how much R^T R of a body's rotations differs from 1; reach: half the diagonal of a cube of 1 m.

    Body 0 has a matrix in frame 2 whose entries are off by up to 0.008; the other's skew is what rounding may hide.
    """
    rotations = np.tile(np.eye(3), (4, 2, 1, 1))
    rotations[2, 0] += 1e-3 * np.arange(9).reshape(3, 3)
    search = search_of_cubes(np.zeros((4, 2, 3)), rotations)
    search.tracks.fill(rotations, np.zeros((4, 2, 3)), np.ones((4, 2), dtype=bool))
    skew, reach = doubles_in(search, "facts", body=0, count=2)
    skew_of_rounding, _reach = doubles_in(search, "facts", body=1, count=2)
    assert skew == pytest.approx(np.linalg.norm(rotations[2, 0].T @ rotations[2, 0] - np.eye(3)))
    assert reach == pytest.approx(np.sqrt(3.0) / 2)
    assert 0.0 < skew_of_rounding < 1e-14


FRAMES = 200
NEARER, AWAY = 0, 1
"""Pairs: a cube at rest with another that comes nearer by 1 cm a frame from 3 m on, and with one that goes away."""


@pytest.fixture(scope="module")
def search_of_a_nearing_and_a_leaving_cube():
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
        pytest.param(NEARER, 0, 164 + 10, id="nearer, from the start"),
        pytest.param(NEARER, 100, 164 + 10, id="nearer, from frame 100: paths on a line end at the same frame"),
        pytest.param(NEARER, 170, 164 + 10, id="nearer, four frames before"),
        pytest.param(NEARER, 171, 171, id="nearer: fewer than four frames are not skipped"),
        pytest.param(NEARER, 180, 180, id="nearer, past the gap"),
        pytest.param(AWAY, 0, 164, id="away: a path has no direction"),
        pytest.param(AWAY, 100, FRAMES, id="away, from frame 100, to the end"),
        pytest.param(AWAY, 198, FRAMES, id="away, before the end"),
    ],
)
def test_frames_are_skipped_until_paths_use_up_the_gap(search_of_a_nearing_and_a_leaving_cube, pair, frame, following):
    """A cube at rest and one 3 m away, which moves by 1 cm a frame, and in NEARER rests for ten frames.

    ``following``: the next frame to search; those before it are counted as skipped.
    """
    search, work = search_of_a_nearing_and_a_leaving_cube, np.zeros(len(COUNTERS), dtype=np.int64)
    assert next_frame(search.rows[pair], frame, pad=1e-13, work=work) == following
    assert work[SKIPPED] == following - frame
    assert search.marks[pair, REPEATS, frame] == 0


def test_repeated_frame_is_marked_and_not_skipped(search_of_a_nearing_and_a_leaving_cube):
    """In frame 55 both cubes rest: its answer will be that of frame 54, and frame 56 follows."""
    search, work = search_of_a_nearing_and_a_leaving_cube, np.zeros(len(COUNTERS), dtype=np.int64)
    assert next_frame(search.rows[NEARER], frame=55, pad=1e-13, work=work) == 56
    assert search.marks[NEARER, REPEATS, 55] == 1
    assert work[SKIPPED] == 0


def test_larger_pad_leaves_less_of_the_gap(search_of_a_nearing_and_a_leaving_cube):
    """A pad of 1 % of both bodies' size, 3 m of distance and sqrt(3) m of both radii, is taken off the gap of 1.634 m.

    Paths of 1 cm a frame may use up 98 % of the rest: 155.5 frames, and ten of rest.
    """
    gap, size = 3 - 1 / 2 - np.sqrt(3) / 2, 3 + np.sqrt(3)
    steps = int(np.ceil(0.98 * (gap - 0.01 * size) / 0.01))
    work = np.zeros(len(COUNTERS), dtype=np.int64)
    row = search_of_a_nearing_and_a_leaving_cube.rows[NEARER]
    assert next_frame(row, frame=0, pad=0.01, work=work) == steps + 10


def test_paths_as_long_as_the_gap_use_it_up():
    """Two bodies move by 1 and by 3 m a frame: in the five frames from 5 to 10 by 20 m together."""
    translations = np.zeros((12, 2, 3))
    translations[:, :, 0] = np.outer(np.arange(12.0), [1.0, -3.0])
    search = search_of_cubes(translations)
    paths = [doubles_in(search, "path", body, count=12) for body in (0, 1)]
    moved = sum(path[10] - path[5] for path in paths)
    assert moved == pytest.approx(5 * (1 + 3))
    row, a_little_more = search.rows[0], 1 + 1e-11
    assert gap_is_used_up(row, frame=5, later=10, gap=moved)
    assert not gap_is_used_up(row, frame=5, later=10, gap=moved * a_little_more)


@pytest.mark.parametrize(
    ("size", "positions", "scaling", "is_beyond"),
    [
        pytest.param(1.0, (0.0, 0.0), 1.0, False, id="cubes of 1 m in each other"),
        pytest.param(1.0, (3.0, 0.0), 1.0, False, id="cubes of 1 m, 3 m apart"),
        pytest.param(1.0, (0.0, 1e80), 1.0, True, id="one at 1e80 m"),
        pytest.param(1.0, (1e80, 1e80), 1.0, True, id="both at 1e80 m"),
        pytest.param(1e-120, (0.0, 0.0), 1.0, True, id="edges of 1e-120 m"),
        pytest.param(1.0, (0.0, np.nan), 1.0, True, id="position not a number"),
        pytest.param(1.0, (0.0, 3.0), 1.00001, True, id="rotations stretched by 1e-5"),
    ],
)
def test_extreme_sizes_and_skewed_rotations_are_beyond_the_kernels(size, positions, scaling, is_beyond):
    """Two cubes of edge ``size`` at ``positions`` on x, in two equal frames, with rotation matrices times ``scaling``.

    A frame that kernels cannot decide is marked BEYOND, and the next one follows.
    """
    translations = np.zeros((2, 2, 3))
    translations[:, :, 0] = positions
    search = search_of_cubes(translations, np.tile(np.eye(3) * scaling, (2, 2, 1, 1)), size=size)
    following = next_frame(search.rows[0], frame=0, pad=1e-13, work=np.zeros(len(COUNTERS), dtype=np.int64))
    assert search.marks[0, VOLUMES, 0] == (BEYOND if is_beyond else 0)
    assert (following == 1) == is_beyond
