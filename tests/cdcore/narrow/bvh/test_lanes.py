"""A lane is dropped only if its faces are disjoint there; what stays open is decided at the world points.

Boxes, or faces, of two bodies are tested in eight frames at once, a lane each; the answer is an integer, a bit a lane.
"""

import numpy as np
import pytest
from oracles.brute_force import meeting_faces
from support.processes import kernels_in_python
from support.search_scenes import EightFrames
from support.second_opinions import faces_below
from support.shapes import triangle_family

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


@pytest.fixture(scope="module")
def kernels_of_scenes():
    """Kernels that the scenes call are compiled: later the names in their code are those of Python functions."""
    scene = EightFrames(seed=0)
    triangles_intersect(np.stack([scene.meshes[0][:1], scene.meshes[1][:1]], axis=1))


@pytest.fixture(autouse=True)
def without_the_compiler(kernels_of_scenes):
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
    """Two soups of triangles in eight frames; every second box of each tree is tested against those of the other.

    Truth is whether any faces below two boxes meet; more than 30 % of the lanes without contact are dropped.
    """
    scene = EightFrames(seed, size=0.1)
    tree_a, tree_b = scene.trees
    world_of_lane = [scene.world(lane) for lane in range(8)]
    block = block_of(scene, scene.pad)
    dropped = without_contact = 0
    for a in range(1, len(tree_a.boxes), 2):
        for b in range(1, len(tree_b.boxes), 2):
            bits = box_lanes_that_may_meet(block, a, b, ALL_LANES)
            for lane, (faces_a, faces_b) in enumerate(world_of_lane):
                meeting = meeting_faces_exhaustive(faces_a[faces_below(tree_a, a)], faces_b[faces_below(tree_b, b)])
                may_meet = bits >> lane & 1
                assert may_meet or not len(meeting), (a, b, lane)
                without_contact += not len(meeting)
                dropped += not may_meet
    assert dropped > 0.3 * without_contact


def candidate_and_certain_lanes(scene, pad):
    """For each pair of faces, as bits, the lanes in which it may meet, and those in which it certainly does."""
    block = block_of(scene, pad)
    tree_a, tree_b = scene.trees
    may_meet, certain = np.zeros((2, *map(len, scene.meshes)), dtype=int)
    for a in np.flatnonzero(tree_a.child < 0).tolist():
        for b in np.flatnonzero(tree_b.child < 0).tolist():
            lanes = box_lanes_that_may_meet(block, a, b, ALL_LANES)
            count = survivors_of_leaves(block, a, b, lanes) if lanes else 0
            for row_a, row_b, undecided, meets in scene.candidates[: 4 * count].reshape(-1, 4).tolist():
                faces = tree_a.faces[row_a], tree_b.faces[row_b]
                may_meet[faces], certain[faces] = undecided | meets, meets
    return may_meet, certain


@pytest.mark.sampled(3)
@pytest.mark.parametrize("seed", range(3))
def test_meeting_face_pairs_survive_in_their_lanes(seed):
    """Two soups of 40 and 60 faces in eight frames: a pair that meets in a frame has the bit of its lane.

    All of those are certain; at most four times as many pairs keep a bit as meet.
    """
    scene = EightFrames(seed, size=0.6)
    may_meet, certain = candidate_and_certain_lanes(scene, scene.pad)
    meeting = 0
    for lane in range(8):
        first, second = scene.world(lane)
        meets = triangles_intersect(np.array([[a, b] for a in first for b in second])).reshape(40, 60)
        assert (may_meet[meets] >> lane & 1).all(), lane
        assert np.array_equal(certain >> lane & 1, meets), lane
        meeting += meets.sum()
    survived = sum(bits.bit_count() for bits in may_meet.ravel().tolist())
    assert meeting > 10
    assert survived < 4 * meeting


@pytest.mark.parametrize(
    ("pad", "grains"),
    [
        pytest.param(1e-4, False, id="soups, 0.1 mm"),
        pytest.param(0.3, False, id="soups, 0.3 m"),
        pytest.param(0.03, True, id="large faces and bunches of tiny ones, 3 cm"),
    ],
)
def test_certain_face_pairs_meet_wherever_rounding_may_have_moved_them(pad, grains):
    """A pad is how far a triangle may really lie from its rounded place, metres.

    One mesh is shifted by almost the pad in 14 directions: faces that meet after some shift must be candidates, and
    faces called certain must meet after every shift. Some are certain with the smallest pad alone.
    """
    scene = EightFrames(seed=1, size=0.6, grains=grains, faces=(25, 30))
    may_meet, certain = candidate_and_certain_lanes(scene, pad)
    signs = np.array([[x, y, z] for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1)])[::2]  # axes and corners
    shifts = 0.999 * pad * signs / np.maximum(1.0, np.linalg.norm(signs, axis=1, keepdims=True))
    lane = 7  # any of the eight
    first, second = scene.world(lane)
    after_some_shift, after_every_shift = np.zeros(may_meet.shape, dtype=bool), np.ones(may_meet.shape, dtype=bool)
    for shift in shifts:
        meets = np.zeros(may_meet.shape, dtype=bool)
        meets[tuple(meeting_faces(first + shift, second).T)] = True
        after_some_shift |= meets
        after_every_shift &= meets
    assert after_some_shift.sum() > 5
    assert (may_meet[after_some_shift] >> lane & 1).all()
    is_certain = certain >> lane & 1 == 1
    assert is_certain.any() == (pad == 1e-4)
    assert after_every_shift[is_certain].all()


CERTAIN_CONTACT, CERTAIN_SEPARATION, NEITHER = ALL_LANES, ALL_LANES << 8, 0


def certainty_of(pair, pad):
    """The answer for a pair of triangles, the same in all eight lanes, whose corners may be off by the pad."""
    first, second = pair
    in_all_lanes = np.repeat(first.reshape(9, 1), 8, axis=1).ravel()
    size = float(np.linalg.norm(pair, axis=2).max()) + pad
    return certain_lanes(memory.doubles_of(in_all_lanes), memory.doubles_of(second.ravel()), 0, size, pad, ALL_LANES)


def centred_pairs(family):
    """Twelve random pairs of triangles of a family, each about the origin and as large as 1 m."""
    pairs = family.pairs(12, seed=7)
    centred = pairs - pairs.mean(axis=(1, 2), keepdims=True)
    return centred / np.maximum(np.abs(pairs).max(axis=(1, 2, 3), keepdims=True), 1e-300)


@pytest.mark.sampled(4)
@pytest.mark.parametrize("pad", [1e-15, 1e-3])
@pytest.mark.parametrize("family", FAMILIES, ids=lambda family: family.name)
def test_certain_lanes_hold_wherever_the_corners_are_within_the_pad(family, pad):
    """Twelve pairs of triangles that are hard to decide, in the way the family's name says; the pad is in metres.

    What is certain of a pair is so of seven copies whose coordinates are off by up to a quarter of the pad.
    """
    rng = np.random.default_rng(FAMILIES.index(family))
    for pair in centred_pairs(family):
        copies = pair + rng.uniform(-1, 1, (7, 2, 3, 3)) * pad / 4
        answer = certainty_of(pair, pad)
        assert answer in (CERTAIN_CONTACT, CERTAIN_SEPARATION, NEITHER)
        if answer != NEITHER:
            meets = answer == CERTAIN_CONTACT
            assert (triangles_intersect([pair, *copies]) == meets).all()


def test_generic_pairs_are_mostly_certain_within_a_small_pad():
    """More than half of 12 ordinary pairs, where corners may be off by 1e-15 m."""
    answers = [certainty_of(pair, pad=1e-15) for pair in centred_pairs(triangle_family("generic control"))]
    assert sum(answer != NEITHER for answer in answers) > 6
