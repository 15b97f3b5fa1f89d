"""What ``image-space`` calls contact is one, and it says INVALID of open meshes instead of nothing."""

import numpy as np
import pytest
from support.shapes import ball_mesh, box_mesh, lab, still, without_faces

from cdcore import Body, Verdict, create_detector
from cdcore.protocol import counts_as_contact


def test_it_invents_nothing_and_finds_most_of_what_overlaps():
    bodies, motion = lab(200)
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
