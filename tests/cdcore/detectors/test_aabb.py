"""``aabb`` looks only where spheres overlap, and says what it did."""

import numpy as np
from shapes import ball_mesh, lab, still

from cdcore import Body, Verdict, create_detector


def test_bodies_whose_spheres_are_apart_cost_no_box():
    bodies = [Body("a", ball_mesh()), Body("b", ball_mesh())]
    detection = create_detector("aabb", bodies).detect(still(bodies, [(0, 0, 0), (5, 0, 0)], frames=4))
    assert (detection.verdict == Verdict.CLEAR).all()
    assert detection.work["sphere_tests"] + detection.work["skipped"] == 4
    assert detection.work["boxes_fitted"] == detection.work["node_tests"] == 0


def test_it_agrees_with_exact_wherever_both_have_a_pose():
    bodies, motion = lab(90)
    want = create_detector("exact", bodies).detect(motion).verdict
    assert np.array_equal(create_detector("aabb", bodies).detect(motion).verdict, want)
    assert (want == Verdict.CONTACT).any()
