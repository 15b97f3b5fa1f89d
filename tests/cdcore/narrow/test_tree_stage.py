"""A hierarchy halves its faces, equals the exhaustive test when run to completion, and admits being cut short."""

import numpy as np
import pytest
from support.random_worlds import bodies_of, cube
from support.shapes import lab_bodies_and_motion, motion_at_rest

from cdcore import Motion, Verdict, create_detector
from cdcore.narrow.bvh.bounds import LARGEST_SIZE
from cdcore.narrow.tree_stage import TreeSettings, TreeStage

TREES = ["aabb", "obb", "rapid-style", "solid-style"]
FIRST_AND_SECOND = np.array([[0, 1]])


@pytest.mark.sampled(2)
@pytest.mark.parametrize("name", TREES)
def test_laboratory_agrees_with_the_exact_detector(name):
    """Verdicts and faces of 40 frames; frames at rest are reused, and a contact has its segments (n, 2, 3)."""
    bodies, motion = lab_bodies_and_motion(frames=40)
    want = create_detector("exact", bodies).detect(motion, faces=True)
    answer = create_detector(name, bodies).detect(motion, faces=True)
    assert answer.digest == want.digest
    assert answer.faces_digest == want.faces_digest
    assert answer.work["reused"] > 0
    assert answer.section(*np.argwhere(answer.face_counts > 0)[0]).shape[1:] == (2, 3)


def test_trees_are_cached_per_kind_and_not_per_setting():
    """Two bodies have a tree for each kind; another search mode uses the same tree objects."""
    bodies = bodies_of([cube(), cube() / 2])
    trees = [TreeStage(bodies, FIRST_AND_SECOND, kind, TreeSettings()).trees for kind in TREES]
    again = [TreeStage(bodies, FIRST_AND_SECOND, kind, TreeSettings(mode="first")).trees for kind in TREES]
    assert all(item[k] is other[k] for item, other in zip(trees, again, strict=True) for k in range(2))
    assert len({id(tree) for some in trees for tree in some}) == 2 * len(TREES)


@pytest.mark.sampled(2)
@pytest.mark.parametrize("name", TREES)
def test_first_mode_keeps_verdicts_with_a_face_pair_each(name):
    """The first mode tests fewer leaves, and the pair that it stops at is one of all that meet."""
    bodies, motion = lab_bodies_and_motion(frames=40)
    every = create_detector(name, bodies).detect(motion, faces=True)
    first = create_detector(name, bodies, mode="first").detect(motion, faces=True)
    assert first.digest == every.digest
    assert np.array_equal(first.face_counts, (every.face_counts > 0).astype(int))
    frame, pair = np.argwhere(every.face_counts > 1)[0].tolist()
    assert tuple(first.faces(frame, pair)[0]) in {tuple(row) for row in every.faces(frame, pair).tolist()}
    assert first.work["leaf_tests"] < every.work["leaf_tests"]


@pytest.mark.sampled(2)
@pytest.mark.parametrize("name", TREES)
def test_stopped_search_reports_not_found_and_no_false_contact(name):
    """``budget``: tests of nodes and faces that a query may make; a million completes it.

    Faces are some of those of the whole search, and a larger budget finds no fewer.
    """
    bodies, motion = lab_bodies_and_motion(frames=40)
    whole = create_detector(name, bodies).detect(motion, faces=True)
    before = np.zeros_like(whole.face_counts)
    for budget in (1, 30, 300, 10**6):
        cut = create_detector(name, bodies, budget=budget).detect(motion, faces=True)
        for frame, pair in np.argwhere(cut.face_counts > 0).tolist():
            answer = {tuple(row) for row in cut.faces(frame, pair).tolist()}
            assert answer <= {tuple(row) for row in whole.faces(frame, pair).tolist()}
        changed = cut.verdict != whole.verdict
        assert (cut.verdict[changed] == Verdict.NOT_FOUND).all()
        assert (cut.face_counts >= before).all()
        before = cut.face_counts
        assert changed.any() == (budget < 10**6)
        assert cut.work["node_tests"] + cut.work["leaf_tests"] <= budget * cut.work["tree_queries"]
    assert np.array_equal(before, whole.face_counts)


@pytest.mark.parametrize("name", TREES)
def test_live_sample_continues_past_faces_decided_by_integers(name):
    """Needles point at the corner of a slope: all but 1 of 400 end so close below it that doubles cannot decide."""
    slope, needle_ends = np.array([[[0.0, 0, 0], [1, 0, 1], [0, 1, 0]]]), [[1.0, 0, -1], [1, 0.1, -1]]
    undecided_by_doubles = [[2e-300, 1e-301, 1e-300], *needle_ends]
    through_the_slope = [[0.2, 0.2, 1.0], *needle_ends]
    needles = np.array([undecided_by_doubles] * 400)
    needles[200] = through_the_slope
    bodies = bodies_of([slope, needles])
    stage = TreeStage(bodies, FIRST_AND_SECOND, name, TreeSettings())
    verdict, is_beyond_margin = stage.decide_now({}, motion_at_rest(bodies, np.zeros((2, 3))), column=0, margin=1e-3)
    assert verdict == Verdict.CONTACT and not is_beyond_margin


@pytest.mark.parametrize(("fraction", "beyond"), [(0.2, False), (0.4, True)])
def test_pair_size_sums_reaches_and_translations(fraction, beyond):
    """Pads hold up to a size; two sheets side by side, where each of the four lengths alone is well within it.

    Together they are 0.8 or 1.6 of it: beyond it faces are tested exhaustively, and no margin is promised.
    """
    far = fraction * LARGEST_SIZE
    sheets = bodies_of([np.array([[[-far, 0, 0], [far, 0, 0], [0, far, 0]]])] * 2)
    stage = TreeStage(sheets, FIRST_AND_SECOND, "obb", TreeSettings())
    motion = Motion([0.0], [[[far, 0, 0], [far, 0, far / 100]]], np.tile(np.eye(3), (1, 2, 1, 1)))
    first = np.zeros(1, dtype=np.int64)
    assert stage.decide(motion, first, first, every=True).work["exhaustive"] == beyond
    assert stage.decide_now({}, motion, 0, far / 1000) == (Verdict.CLEAR, not beyond)


@pytest.mark.parametrize("name", TREES)
def test_cubes_so_small_that_products_vanish_touch(name):
    """Edges of 2^-700 m: the product of two is no double; the cubes touch face to face."""
    bodies = bodies_of([cube() * 2.0**-700, (cube() + np.array([1, 0, 0])) * 2.0**-700])
    verdict = create_detector(name, bodies).detect(motion_at_rest(bodies, np.zeros((2, 3)))).verdict
    assert verdict.tolist() == [[Verdict.CONTACT]]
