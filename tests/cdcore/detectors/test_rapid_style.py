"""``rapid-style`` run to completion loses no face; its first-contact mode lists one."""

from shapes import ball_mesh, still

from cdcore import Body, Verdict, create_detector

BODIES = [Body("a", ball_mesh()), Body("b", ball_mesh())]
MOTION = still(BODIES, [(0, 0, 0), (1.5, 0.1, 0.2)])


def test_run_to_completion_it_lists_every_face_of_the_exact_detector():
    want = create_detector("exact", BODIES).detect(MOTION, faces=True)
    found = create_detector("rapid-style", BODIES).detect(MOTION, faces=True)
    assert found.face_counts[0, 0] > 20
    assert found.faces_digest == want.faces_digest


def test_first_contact_stops_at_one_pair_and_a_budget_of_few_tests_finds_none():
    first = create_detector("rapid-style", BODIES, mode="first").detect(MOTION, faces=True)
    assert first.face_counts.tolist() == [[1]]
    cut = create_detector("rapid-style", BODIES, budget=5).detect(MOTION, faces=True)
    assert cut.verdict.tolist() == [[Verdict.NOT_FOUND]]
    assert cut.work["node_tests"] == 5
