"""A detector says which of its stages lost a contact, and searches again only what has changed."""

import numpy as np
import pytest
from support.search_scenes import ball_of
from support.shapes import box_mesh, lab, unturned

from cdcore import Body, Motion, TriangleMesh, Verdict, create_detector
from cdcore.protocol import Explains
from cdcore.search.features import features_of
from cdcore.search.samples import sample_of
from cdcore.search.search_settings import SearchSettings
from cdcore.search.stage import SearchStage

NOTHING = np.zeros((0, 2), dtype=np.int64)


def stages_that_failed(name, **settings):
    """The misses of a detector in ``lab``, and what it says of each."""
    bodies, motion = lab(120)
    detector = create_detector(name, bodies, **settings)
    exact = create_detector("exact", bodies).detect(motion, faces=True)
    missed = np.argwhere((exact.face_counts > 0) & (detector.detect(motion).verdict != 1)).tolist()
    told = {(t, p): detector.explain(motion, t, p, exact.faces(t, p)) for t, p in missed}
    return bodies, motion, told


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


def test_where_meshes_decide_no_search_is_to_blame():
    bodies, motion = lab(2)
    told = create_detector("hybrid-qaco", bodies, decide="mesh").explain(motion, 0, 0, np.zeros((1, 2), dtype=np.int64))
    assert told.found_with_more is None and told.sample_meets is None


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
        ({"budget": 10}, {"budget": 100}),
    ],
)
def test_a_budget_that_ran_out_is_told_from_a_search_that_failed_as_a_run_with_ten_times_tells(settings, more):
    bodies, motion, told = stages_that_failed("hybrid-qaco", **settings)
    assert {one.found_with_more for one in told.values()} == {True, False}
    assert all(one.sample_meets for one in told.values())
    pairs = create_detector("hybrid-qaco", bodies).pairs
    patient = [create_detector("hybrid-qaco", bodies, pairs=pairs[[pair]], **(settings | more)) for pair in range(10)]
    again = [one.detect(motion).verdict[:, 0] == Verdict.CONTACT for one in patient]
    agree = [again[pair][frame] == one.found_with_more for (frame, pair), one in told.items()]
    assert np.mean(agree) > (0.8 if settings.get("warm_start", True) else 0.999)


PAIRS = np.array([[0, 1]])


def two_balls():
    return [Body("a", ball_of(2000)), Body("b", ball_of(2000))]


def approach(frames=60):
    place = np.zeros((frames, 2, 3))
    place[:, 0, 0] = np.linspace(2.3, 1.7, frames)
    place[:, 0, 1] = 0.1
    return unturned(place)


def everywhere(motion):
    return np.ones((len(motion), 1), dtype=bool)


def decide(motion, faces=False, **settings):
    stage = SearchStage(two_balls(), PAIRS, SearchSettings(**settings))
    return stage.decide(motion, everywhere(motion), stage.fresh_memory(), faces=faces)


def test_without_stopping_at_the_first_hit_the_budget_is_spent_on_further_curves():
    first, more = (decide(approach(), faces=True, budget=3000, stop_first=stop) for stop in (True, False))
    assert np.array_equal(first.hits, more.hits)
    assert more.work["evaluations"] == 3000 * 60
    assert first.work["evaluations"] < more.work["evaluations"]
