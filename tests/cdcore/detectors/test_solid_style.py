"""``solid-style`` prunes by sweeping, keeps separating axes, and run to completion loses no face."""

from shapes import ball_mesh, lab, still

from cdcore import Body, Verdict, create_detector, join


def test_run_to_completion_it_lists_every_face_of_the_exact_detector_and_hits_its_cache():
    bodies = [Body("a", ball_mesh()), Body("b", ball_mesh())]
    motion = still(bodies, [(0, 0, 0), (1.5, 0.1, 0.2)])
    want = create_detector("exact", bodies).detect(motion, faces=True)
    found = create_detector("solid-style", bodies).detect(motion, faces=True)
    assert found.faces_digest == want.faces_digest
    assert 0 < found.work["cache_hits"] < found.work["leaf_tests"]
    assert found.work["exact_tests"] >= want.face_counts.sum() > 20


def test_bodies_whose_world_boxes_are_apart_reach_no_tree():
    bodies = [Body("a", ball_mesh()), Body("b", ball_mesh())]
    detection = create_detector("solid-style", bodies).detect(still(bodies, [(0, 0, 0), (5, 0, 0)]))
    assert detection.verdict.tolist() == [[Verdict.CLEAR]]
    assert detection.work["node_tests"] == 0


def test_a_stream_sweeps_as_the_whole_does():
    bodies, motion = lab(60)
    detector = create_detector("solid-style", bodies)
    whole, parts = detector.detect(motion), join(detector.stream(motion.blocks(9)))
    assert parts.digest == whole.digest
    assert parts.work["swaps"] == whole.work["swaps"] > 0
    assert parts.work["pair_events"] == whole.work["pair_events"] > 0
