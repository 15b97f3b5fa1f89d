import numpy as np
import pytest
from support.shapes import box_mesh, lab

from cdcore import Body, Motion, TriangleMesh, create_detector
from cdcore.protocol import Explains
from cdcore.search.features import features_of
from cdcore.search.samples import sample_of

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


def stages_that_failed(name, **settings):
    """The misses of a detector in ``lab``, and what it says of each."""
    bodies, motion = lab(60)
    detector = create_detector(name, bodies, **settings)
    exact = create_detector("exact", bodies).detect(motion, faces=True)
    missed = np.argwhere((exact.face_counts > 0) & (detector.detect(motion).verdict != 1)).tolist()
    told = {(t, p): detector.explain(motion, t, p, exact.faces(t, p)) for t, p in missed}
    return bodies, motion, told


@pytest.mark.parametrize("name", ["qaco", "hybrid-qaco"])
def test_no_pair_in_the_sample_is_said_exactly_where_the_sampled_faces_alone_do_not_meet(name):
    bodies, motion, told = stages_that_failed(name, samples=20)
    assert {one.sample_meets for one in told.values()} >= {False} and len(told) > 20
    # the same draw, made into meshes of their own, which the exact detector decides
    parts = []
    for body in bodies:
        features = features_of(body.mesh)
        faces = features.face[sample_of(features, 20, 0, body.name).pick]
        parts.append(Body(body.name, TriangleMesh(body.mesh.vertices, body.mesh.faces[faces])))
    left = create_detector("exact", parts).detect(motion, faces=True).face_counts
    for (frame, pair), one in told.items():
        assert one.sample_meets == (left[frame, pair] > 0)
        assert (one.found_with_more is None) == (not one.sample_meets)


@pytest.mark.parametrize(
    ("settings", "more"),
    [
        ({"budget": 20, "warm_start": False}, {"budget": 200}),
        ({"variant": "local", "budget": 5, "warm_start": False}, {"budget": 50}),
        ({"samples": "auto", "frame_budget": 60}, {"frame_budget": 600}),
    ],
)
def test_a_budget_that_ran_out_is_told_from_a_search_that_failed_by_searching_ten_times_as_long(settings, more):
    bodies, motion, told = stages_that_failed("hybrid-qaco", **settings)
    assert {one.found_with_more for one in told.values()} == {True, False}
    assert all(one.sample_meets for one in told.values())
    pairs = create_detector("hybrid-qaco", bodies).pairs
    for (frame, pair), one in told.items():
        patient = create_detector("hybrid-qaco", bodies, pairs=pairs[[pair]], **(settings | more))
        again = patient.detect(motion.frames(frame, frame + 1)).verdict[0, 0] == 1
        assert again == one.found_with_more
