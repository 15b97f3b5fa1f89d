import numpy as np
import pytest
from shapes import box_mesh, lab

from cdcore import Body, Motion, create_detector
from cdcore.protocol import Explains

NOTHING = np.zeros((0, 2), dtype=np.int64)


@pytest.mark.parametrize("name", ["qaco", "hybrid-qaco"])
def test_what_was_found_is_found_again_with_more_budget_and_spheres_that_part_say_so(name):
    bodies = [Body("a", box_mesh()), Body("b", box_mesh())]
    places = np.zeros((3, 2, 3))
    places[:, 1, 0] = [0.9, 1.2, 9.0]
    motion = Motion([0.0, 1.0, 2.0], places, np.broadcast_to(np.eye(3), (3, 2, 3, 3)))
    detector = create_detector(name, bodies)
    assert isinstance(detector, Explains)
    faces = create_detector("exact", bodies).detect(motion, faces=True)
    met = detector.explain(motion, 0, 0, faces.faces(0, 0))
    assert met.spheres_meet and met.sample_meets and met.found_with_more
    assert detector.explain(motion, 2, 0, faces.faces(0, 0)).spheres_meet is False
    inside = detector.explain(motion, 0, 0, NOTHING)
    assert inside.sample_meets is None and inside.found_with_more is None


def test_ten_times_one_evaluation_is_still_too_little_where_few_faces_meet():
    bodies, motion = lab(60)
    detector = create_detector("qaco", bodies, budget=1, variant="random", warm_start=False)
    exact = create_detector("exact", bodies).detect(motion, faces=True)
    missed = np.argwhere((exact.face_counts > 0) & (detector.detect(motion).verdict != 1)).tolist()
    told = [detector.explain(motion, t, p, exact.faces(t, p)).found_with_more for t, p in missed]
    assert len(told) > 10 and not all(told)


def test_where_meshes_decide_no_search_is_to_blame():
    bodies, motion = lab(2)
    told = create_detector("hybrid-qaco", bodies, decide="mesh").explain(motion, 0, 0, np.zeros((1, 2), dtype=np.int64))
    assert told.found_with_more is None and told.sample_meets is None
