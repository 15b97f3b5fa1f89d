"""``obb`` asks every pair-frame from its roots: one node test where bodies are far apart."""

from shapes import ball_mesh, still

from cdcore import Body, Verdict, create_detector


def test_bodies_far_apart_cost_one_test_a_pose_and_none_while_they_stand_still():
    bodies = [Body("a", ball_mesh()), Body("b", ball_mesh())]
    detection = create_detector("obb", bodies).detect(still(bodies, [(0, 0, 0), (5, 0, 0)], frames=4))
    assert (detection.verdict == Verdict.CLEAR).all()
    assert (detection.work["node_tests"], detection.work["leaf_tests"]) == (1, 0)
    assert (detection.work["tree_queries"], detection.work["reused"]) == (1, 3)


def test_oriented_boxes_need_fewer_node_tests_than_world_boxes_on_turned_bodies():
    from shapes import lab

    bodies, motion = lab(60)
    work = {name: create_detector(name, bodies).detect(motion, faces=True).work for name in ("aabb", "obb")}
    assert work["obb"]["node_tests"] < work["aabb"]["node_tests"]
