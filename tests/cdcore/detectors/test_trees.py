"""Each tree detector asks what its broad phase leaves; what ``image-space`` calls contact is one."""

import numpy as np
import pytest
from support.shapes import ball_mesh, box_mesh, lab, still, without_faces

from cdcore import Body, Verdict, create_detector, join
from cdcore.protocol import counts_as_contact

TREES = ["aabb", "obb", "rapid-style", "solid-style"]
BALLS = [Body("a", ball_mesh()), Body("b", ball_mesh())]
MEETING = still(BALLS, [(0, 0, 0), (1.5, 0.1, 0.2)])
FAR = still(BALLS, [(0, 0, 0), (5, 0, 0)], frames=4)


@pytest.mark.parametrize("name", TREES)
def test_run_to_completion_it_lists_every_face_of_the_exact_detector(name):
    want = create_detector("exact", BALLS).detect(MEETING, faces=True)
    found = create_detector(name, BALLS).detect(MEETING, faces=True)
    assert found.face_counts[0, 0] > 20
    assert found.faces_digest == want.faces_digest


@pytest.mark.parametrize("name", TREES)
def test_the_first_hit_is_one_pair_and_a_budget_of_few_tests_finds_none(name):
    first = create_detector(name, BALLS, mode="first").detect(MEETING, faces=True)
    assert first.face_counts.tolist() == [[1]]
    cut = create_detector(name, BALLS, budget=5).detect(MEETING, faces=True)
    assert cut.verdict.tolist() == [[Verdict.NOT_FOUND]]
    assert cut.work["node_tests"] == 5


def test_a_broad_phase_keeps_bodies_apart_from_the_trees_of_aabb_and_solid():
    spheres = create_detector("aabb", BALLS).detect(FAR)
    assert (spheres.verdict == Verdict.CLEAR).all()
    assert spheres.work["sphere_tests"] + spheres.work["skipped"] == 4
    assert spheres.work["boxes_fitted"] == spheres.work["node_tests"] == 0
    sweep = create_detector("solid-style", BALLS).detect(FAR)
    assert (sweep.verdict == Verdict.CLEAR).all()
    assert sweep.work["node_tests"] == 0


def test_bodies_far_apart_cost_obb_one_test_a_pose_and_none_while_they_stand_still():
    work = create_detector("obb", BALLS).detect(FAR).work
    assert (work["node_tests"], work["leaf_tests"], work["tree_queries"], work["reused"]) == (1, 0, 1, 3)


def test_oriented_boxes_need_fewer_node_tests_than_world_boxes_on_turned_bodies():
    bodies, motion = lab(60)
    work = {name: create_detector(name, bodies).detect(motion, faces=True).work for name in ("aabb", "obb")}
    assert work["obb"]["node_tests"] < work["aabb"]["node_tests"]


def test_solid_hits_its_cache_and_asks_every_meeting_pair_exactly():
    work = create_detector("solid-style", BALLS).detect(MEETING, faces=True).work
    assert 0 < work["cache_hits"] < work["leaf_tests"]
    assert work["exact_tests"] > 20


def test_a_stream_sweeps_as_the_whole_does():
    bodies, motion = lab(60)
    detector = create_detector("solid-style", bodies)
    whole, parts = detector.detect(motion), join(detector.stream(motion.blocks(9)))
    assert parts.digest == whole.digest
    assert np.array_equal(parts.verdict, whole.verdict)
    assert parts.work["swaps"] == whole.work["swaps"] > 0


def test_it_invents_nothing_and_finds_most_of_what_overlaps():
    bodies, motion = lab(80)
    truth = counts_as_contact(create_detector("exact", bodies).detect(motion).verdict)
    detection = create_detector("image-space", bodies).detect(motion)
    found = counts_as_contact(detection.verdict)
    assert detection.approximate and not (found & ~truth).any()
    decided = ~np.isin(detection.verdict, [Verdict.INVALID, Verdict.NO_POSE])
    assert found.sum() > 0.8 * (truth & decided).sum() > 0


def test_an_open_mesh_is_invalid_where_boxes_overlap_with_a_reason_and_clear_where_they_do_not():
    bodies = [Body("bowl", without_faces(ball_mesh(), 9)), Body("box", box_mesh())]
    near = create_detector("image-space", bodies).detect(still(bodies, [(0, 0, 0), (1, 0, 0)]))
    assert near.verdict.tolist() == [[Verdict.INVALID]]
    assert near.reasons == {(0, 0): "bowl is open: it has no inside to overlap"}
    far = create_detector("image-space", bodies).detect(still(bodies, [(0, 0, 0), (9, 0, 0)]))
    assert far.verdict.tolist() == [[Verdict.CLEAR]] and far.reasons == {}


def test_volumes_come_per_pair_and_frame():
    bodies = [Body("a", box_mesh()), Body("b", box_mesh()), Body("open", without_faces(ball_mesh(), 9))]
    motion = still(bodies, [(0, 0, 0), (0.5, 0, 0), (0.2, 0, 0)], frames=3)
    detector = create_detector("image-space", bodies)
    volumes = detector.overlap_volumes(motion)
    assert volumes[:, 0] == pytest.approx([0.5] * 3, rel=1e-6)
    assert np.isnan(volumes[:, 1:]).all()
    assert detector.detect(motion).work["images"] == 3


def test_a_ball_in_a_box_is_contained_and_bodies_that_only_touch_are_not_found():
    bodies = [Body("box", box_mesh()), Body("ball", ball_mesh(0.2))]
    detector = create_detector("image-space", bodies)
    assert detector.detect(still(bodies, [(0, 0, 0), (0.1, 0, 0)])).verdict.tolist() == [[Verdict.CONTAINED]]
    assert detector.detect(still(bodies, [(0, 0, 0), (0.5, 0, 0)])).verdict.tolist() == [[Verdict.CONTACT]]
    boxes = [Body("a", box_mesh()), Body("b", box_mesh())]
    touching = create_detector("image-space", boxes).detect(still(boxes, [(0, 0, 0), (1, 0, 0)]))
    assert touching.verdict.tolist() == [[Verdict.NOT_FOUND]]
