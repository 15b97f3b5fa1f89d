"""A lane is dropped only if its faces are disjoint there; what stays open is decided at the world points."""

import numpy as np
import pytest
from oracles.brute_force import meeting_faces
from support.processes import kernels_in_python
from support.search_scenes import EightFrames
from support.second_opinions import faces_below

from cdcore.kernels import memory
from cdcore.narrow.brute_force import meeting_faces_exhaustive
from cdcore.narrow.bvh import tree_memory
from cdcore.narrow.bvh.boxes_and_faces_of_eight_frames import (
    box_lanes_that_may_meet,
    certain_lanes,
    survivors_of_leaves,
)
from cdcore.narrow.bvh.tree_memory import Block
from cdcore.triangles.decide import triangles_intersect
from replay.studies.stress.families import FAMILIES

ALL_LANES = 0b11111111
"""A bit for each of the eight frames."""


@pytest.fixture(autouse=True)
def without_the_compiler():
    """Compiled for these tests alone, the functions would take three seconds."""
    with kernels_in_python():
        yield


def block_of(scene, pad):
    """The eight frames of the scene, as the search reads them."""
    pair = tree_memory.pair_at(memory.integers_of(scene.row), 0)
    return Block(pair, 0, scene.chord, pad, scene.scratch)


@pytest.mark.sampled(3)
@pytest.mark.parametrize("seed", range(3))
def test_no_lane_with_contact_is_dropped_and_many_others_are(seed):
    """Eight frames are a lane each, a bit of ``left``; truth is whether any faces below two boxes meet.

    Every second box of each tree is taken; more than 30 % of the lanes without contact are dropped.
    """
    scene = EightFrames(seed, size=0.1)
    a_tree, b_tree = scene.trees
    worlds = [scene.world(lane) for lane in range(8)]
    block = block_of(scene, scene.pad)
    dropped = clear = 0
    for a in range(1, len(a_tree.boxes), 2):
        for b in range(1, len(b_tree.boxes), 2):
            left = box_lanes_that_may_meet(block, a, b, ALL_LANES)
            below = faces_below(a_tree, a), faces_below(b_tree, b)
            for lane in range(8):
                first, second = worlds[lane][0][below[0]], worlds[lane][1][below[1]]
                meets = len(meeting_faces_exhaustive(first, second)) > 0
                assert not meets or left >> lane & 1
                clear += not meets
                dropped += not left >> lane & 1
    assert dropped > 0.3 * clear


def faces_left(scene, pad):
    """Face pairs of all leaves that are not certainly apart: face, face, lanes to ask, lanes that certainly meet."""
    block = block_of(scene, pad)
    a_tree, b_tree = scene.trees
    for a in np.flatnonzero(a_tree.child < 0).tolist():
        for b in np.flatnonzero(b_tree.child < 0).tolist():
            lanes = box_lanes_that_may_meet(block, a, b, ALL_LANES)
            count = survivors_of_leaves(block, a, b, lanes) if lanes else 0
            for face_a, face_b, possible, meet in scene.candidates[: 4 * count].reshape(-1, 4).tolist():
                yield a_tree.faces[face_a], b_tree.faces[face_b], possible, meet


@pytest.mark.sampled(3)
@pytest.mark.parametrize("seed", range(3))
def test_meeting_face_pairs_survive_in_their_lanes(seed):
    """Bit k of a face pair is frame k of eight; at most four times as many pairs survive as meet."""
    scene = EightFrames(seed, size=0.6)
    lanes, certain = np.zeros((2, *map(len, scene.meshes)), dtype=int)
    for face_a, face_b, possible, meet in faces_left(scene, scene.pad):
        lanes[face_a, face_b], certain[face_a, face_b] = possible | meet, meet
    meeting = 0
    for lane in range(8):
        first, second = scene.world(lane)
        pairs = np.array([[x, y] for x in first for y in second])
        meets = triangles_intersect(pairs).reshape(40, 60)
        assert (lanes[meets] >> lane & 1).all()
        assert np.array_equal(certain >> lane & 1, meets)
        meeting += meets.sum()
    survived = sum(bin(left).count("1") for left in lanes.ravel())
    assert meeting > 10
    assert survived < 4 * meeting


@pytest.mark.parametrize(("pad", "grains"), [(1e-3, False), (0.3, False), (0.03, True)])
def test_certain_face_pairs_meet_wherever_rounding_may_have_moved_them(pad, grains):
    """A pad is how far a triangle may really lie from its rounded place.

    One mesh is shifted by almost the pad in 14 directions: faces that meet after some shift must be candidates, and
    faces called certain must meet after every shift.
    """
    scene = EightFrames(seed=1, size=0.6, grains=grains)
    shape = [len(mesh) for mesh in scene.meshes]
    lanes, certain = np.zeros((2, *shape), dtype=int)
    for face_a, face_b, possible, meet in faces_left(scene, pad):
        lanes[face_a, face_b], certain[face_a, face_b] = possible | meet, meet
    signs = np.array([[x, y, z] for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1)])[::2]  # axes and corners
    shifts = 0.999 * pad * signs / np.maximum(1.0, np.linalg.norm(signs, axis=1, keepdims=True))
    lane = 7
    first, second = scene.world(lane)
    some, every = np.zeros(shape, dtype=bool), np.ones(shape, dtype=bool)
    for shift in shifts:
        meets = np.zeros(shape, dtype=bool)
        meets[tuple(meeting_faces(first + shift, second).T)] = True
        some, every = some | meets, every & meets
    assert (lanes[some] >> lane & 1).all()
    assert every[certain >> lane & 1 == 1].all()
    assert some.sum() > 5


@pytest.mark.sampled(4)
@pytest.mark.parametrize("pad", [1e-15, 1e-3])
@pytest.mark.parametrize("number", range(1, len(FAMILIES) + 1))
def test_certain_lanes_hold_wherever_the_corners_are_within_the_pad(number, pad):
    """255 is certain contact in all eight lanes, 255 << 8 certain separation, 0 neither."""
    rng, sure = np.random.default_rng(number), 0
    for pair in FAMILIES[number - 1].pairs(12, seed=7):
        pair = (pair - pair.mean(axis=(0, 1))) / max(np.abs(pair).max(), 1e-300)
        near = np.repeat(pair[None], 8, axis=0)
        near[1:] += rng.uniform(-1, 1, (7, 2, 3, 3)) * pad / 4
        size = float(np.linalg.norm(near, axis=3).max())
        # the kernel sees one pair in all lanes, the truth is asked at others within the pad of it
        moving = np.repeat(near[0, 0].reshape(9, 1), 8, axis=1).ravel()
        answer = certain_lanes(
            memory.doubles_of(moving), memory.doubles_of(near[0, 1].ravel()), 0, size, pad, ALL_LANES
        )
        assert answer in (0, 255, 255 << 8)
        truth = triangles_intersect(near)
        assert answer == 0 or (truth == (answer == 255)).all()
        sure += answer > 0
    assert pad > 1e-6 or number > 1 or sure > 6, "of 12 generic pairs most are certain within a small pad"
