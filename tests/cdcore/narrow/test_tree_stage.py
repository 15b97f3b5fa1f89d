"""A hierarchy halves its faces, equals the exhaustive test when run to completion, and admits being cut short."""

import numpy as np
import pytest
from support.random_worlds import bodies_of, cube
from support.shapes import lab_bodies_and_motion, motion_at_rest, unrotated_motion

from cdcore import Verdict, create_detector
from cdcore.narrow.bvh.bounds import LARGEST_SIZE
from cdcore.narrow.tree_stage import TreeSettings, TreeStage

TREES = ["aabb", "obb", "rapid-style", "solid-style"]
"""Detectors that search trees of boxes, each of a kind of its own."""
FIRST_AND_SECOND = np.array([[0, 1]])
"""Bodies of the only pair."""


@pytest.mark.sampled(2)
@pytest.mark.parametrize("name", TREES)
def test_laboratory_agrees_with_the_exact_detector(name):
    """Five bodies of a laboratory in 40 frames: the same verdicts and faces; answers of frames at rest are reused."""
    bodies, motion = lab_bodies_and_motion(frames=40)
    expected = create_detector("exact", bodies).detect(motion, faces=True)
    answer = create_detector(name, bodies).detect(motion, faces=True)
    assert answer.digest == expected.digest
    assert answer.faces_digest == expected.faces_digest
    assert answer.work["reused"] > 0


@pytest.mark.parametrize("name", TREES)
def test_a_contact_has_segments_where_surfaces_cross(name):
    """Two cubes of 1 m, half a metre from each other: segments (n, 2, 3) of two ends each."""
    bodies = bodies_of([cube(), cube()])
    detection = create_detector(name, bodies).detect(motion_at_rest(bodies, [[0, 0, 0], [0.5, 0.4, 0.3]]), faces=True)
    segments = detection.section(frame=0, pair=0)
    assert len(segments) > 0
    assert segments.shape[1:] == (2, 3)


def test_trees_are_cached_per_kind_and_not_per_setting():
    """Two bodies have a tree for each kind; a search with another mode uses the same tree objects."""
    bodies = bodies_of([cube(), cube() / 2])
    trees, trees_of_first_mode = (
        [tree for kind in TREES for tree in TreeStage(bodies, FIRST_AND_SECOND, kind, settings).trees]
        for settings in (TreeSettings(), TreeSettings(mode="first"))
    )
    assert all(tree is other for tree, other in zip(trees, trees_of_first_mode, strict=True))
    assert len({id(tree) for tree in trees}) == 2 * len(TREES)


@pytest.mark.sampled(2)
@pytest.mark.parametrize("name", TREES)
def test_first_mode_keeps_verdicts_with_a_face_pair_each(name):
    """Mode "first" stops at the first pair of faces that meets: one of all, in every contact, after
    fewer leaf tests.
    """
    bodies, motion = lab_bodies_and_motion(frames=40)
    whole = create_detector(name, bodies).detect(motion, faces=True)
    first = create_detector(name, bodies, mode="first").detect(motion, faces=True)
    assert first.digest == whole.digest
    assert np.array_equal(first.face_counts, (whole.face_counts > 0).astype(int))
    frame, pair = np.argwhere(whole.face_counts > 1)[0].tolist()
    assert first.faces(frame, pair).tolist()[0] in whole.faces(frame, pair).tolist()
    assert first.work["leaf_tests"] < whole.work["leaf_tests"]


@pytest.mark.sampled(2)
@pytest.mark.parametrize("name", TREES)
def test_stopped_search_reports_not_found_and_no_false_contact(name):
    """``budget``: tests of nodes and faces that a query may make; 300 are too few for some, a million completes all.

    A verdict that is not that of the whole search is NOT_FOUND; faces are some of those of the whole search, and a
    larger budget lists no fewer.
    """
    bodies, motion = lab_bodies_and_motion(frames=40)
    whole = create_detector(name, bodies).detect(motion, faces=True)
    counts_of_smaller_budget = np.zeros_like(whole.face_counts)
    for budget in (1, 30, 300, 10**6):
        stopped = create_detector(name, bodies, budget=budget).detect(motion, faces=True)
        assert stopped.work["node_tests"] + stopped.work["leaf_tests"] <= budget * stopped.work["tree_queries"], budget
        differs = stopped.verdict != whole.verdict
        assert differs.any() == (budget < 10**6), budget
        assert (stopped.verdict[differs] == Verdict.NOT_FOUND).all(), budget
        for frame, pair in np.argwhere(stopped.face_counts > 0).tolist():
            whole_faces = whole.faces(frame, pair).tolist()
            assert all(faces in whole_faces for faces in stopped.faces(frame, pair).tolist()), (budget, frame, pair)
        assert (stopped.face_counts >= counts_of_smaller_budget).all(), budget
        counts_of_smaller_budget = stopped.face_counts
    assert np.array_equal(stopped.face_counts, whole.face_counts)


@pytest.mark.parametrize("name", TREES)
def test_live_sample_continues_past_faces_decided_by_integers(name):
    """400 needles point at the corner of a slope, which the 201st goes through; no faces are known to have met before.

    All others end so close below it that doubles cannot decide, and integers say that they do not meet. A live sample
    that stopped at the first of them would call the pair clear; 200 stand before, so that every tree comes to some.
    """
    slope, needle_ends = np.array([[[0.0, 0, 0], [1, 0, 1], [0, 1, 0]]]), [[1.0, 0, -1], [1, 0.1, -1]]
    undecided_by_doubles = [[2e-300, 1e-301, 1e-300], *needle_ends]
    through_the_slope = [[0.2, 0.2, 1.0], *needle_ends]
    needles = np.array([undecided_by_doubles] * 400)
    needles[200] = through_the_slope
    bodies = bodies_of([slope, needles])
    stage = TreeStage(bodies, FIRST_AND_SECOND, name, TreeSettings())
    faces_met_before = {}
    sample = motion_at_rest(bodies, np.zeros((2, 3)))
    verdict, is_beyond_margin = stage.decide_now(faces_met_before, sample, column=0, margin=1e-3)
    assert verdict == Verdict.CONTACT
    assert not is_beyond_margin


@pytest.mark.parametrize(
    ("fraction", "is_beyond"), [pytest.param(0.2, False, id="0.8 of the size"), pytest.param(0.4, True, id="1.6 of it")]
)
def test_pair_size_sums_reaches_and_translations(fraction, is_beyond):
    """Pads hold up to a size, LARGEST_SIZE; two sheets side by side reach ``fraction`` of it from origins as far away.

    The four lengths together are 0.8 or 1.6 of it: beyond it faces are tested exhaustively, and no margin is promised.
    """
    far = fraction * LARGEST_SIZE
    sheets = bodies_of([np.array([[[-far, 0, 0], [far, 0, 0], [0, far, 0]]])] * 2)
    stage = TreeStage(sheets, FIRST_AND_SECOND, "obb", TreeSettings())
    gap = far / 100
    motion = unrotated_motion([[[far, 0, 0], [far, 0, gap]]])
    frames = columns = np.zeros(1, dtype=np.int64)
    assert stage.decide(motion, frames, columns, every=True).work["exhaustive"] == is_beyond
    faces_met_before = {}
    verdict, is_beyond_margin = stage.decide_now(faces_met_before, motion, column=0, margin=gap / 10)
    assert verdict == Verdict.CLEAR
    assert is_beyond_margin == (not is_beyond)


@pytest.mark.parametrize("name", TREES)
def test_cubes_so_small_that_products_vanish_touch(name):
    """Edges of 2^-700 m: the product of two is no double; the cubes touch side to side."""
    bodies = bodies_of([cube() * 2.0**-700, (cube() + np.array([1, 0, 0])) * 2.0**-700])
    verdict = create_detector(name, bodies).detect(motion_at_rest(bodies, np.zeros((2, 3)))).verdict
    assert verdict.tolist() == [[Verdict.CONTACT]]
