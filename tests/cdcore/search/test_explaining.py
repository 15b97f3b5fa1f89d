"""A detector says which of its stages lost a contact, and searches again only what has changed."""

import numpy as np
import pytest
from support.search_scenes import ball_of
from support.shapes import box_mesh, lab_bodies_and_motion, unrotated_motion

from cdcore import Body, Motion, TriangleMesh, Verdict, create_detector
from cdcore.protocol import Explains, Explanation
from cdcore.search.features import features_of, sample_of
from cdcore.search.search_settings import SearchSettings
from cdcore.search.stage import SearchStage

BOXES_MEET = {"qaco": None, "hybrid-qaco": False}
"""The answer about cubes whose spheres overlap alone; ``qaco`` tests no boxes."""

NO_FACES = np.zeros((0, 2), dtype=np.int64)


def misses_explained(name, **settings):
    """Bodies and motion, and what a detector says of each contact there that it misses, by frame and pair."""
    bodies, motion = lab_bodies_and_motion(frames=60)
    detector = create_detector(name, bodies, **settings)
    exact = create_detector("exact", bodies).detect(motion, faces=True)
    missed = np.argwhere((exact.face_counts > 0) & (detector.detect(motion).verdict != Verdict.CONTACT)).tolist()
    reported = {(t, p): detector.explain(motion, t, p, exact.faces(t, p)) for t, p in missed}
    return bodies, motion, reported


@pytest.mark.parametrize("name", ["qaco", "hybrid-qaco"])
def test_explanation_names_spheres_samples_and_budget(name):
    """Explained are frame and pair with the faces that really meet; without faces nothing can be said of samples."""
    bodies = [Body("a", box_mesh()), Body("b", box_mesh())]
    positions = np.zeros((3, 2, 3))
    positions[:, 1, 0] = [0.9, 1.2, 9.0]  # cubes of 1 m: they overlap; only their spheres do; far apart
    motion = Motion([0.0, 1.0, 2.0], positions, np.broadcast_to(np.eye(3), (3, 2, 3, 3)))
    detector = create_detector(name, bodies)
    assert isinstance(detector, Explains)
    faces = create_detector("exact", bodies).detect(motion, faces=True)
    meeting = faces.faces(0, 0)
    met = detector.explain(motion, frame=0, pair=0, faces=meeting)
    assert met.spheres_meet and met.sample_meets and met.found_with_more
    beside = detector.explain(motion, frame=1, pair=0, faces=NO_FACES)
    assert beside.spheres_meet and beside.boxes_meet == BOXES_MEET[name]
    distant = detector.explain(motion, frame=2, pair=0, faces=meeting)
    assert vars(distant) == {**vars(Explanation()), "spheres_meet": False}, "no other stage ran"
    inside = detector.explain(motion, frame=0, pair=0, faces=NO_FACES)
    assert inside.sample_meets is None and inside.found_with_more is None


def test_where_meshes_decide_no_search_is_to_blame():
    """Both answers are None: neither the sample of faces nor the budget was asked about."""
    bodies, motion = lab_bodies_and_motion(frames=2)
    detector = create_detector("hybrid-qaco", bodies, decide="mesh")
    reported = detector.explain(motion, frame=0, pair=0, faces=np.zeros((1, 2), dtype=np.int64))
    assert reported.found_with_more is None and reported.sample_meets is None


@pytest.mark.slow
@pytest.mark.parametrize("name", ["qaco", "hybrid-qaco"])
def test_missing_sample_pairs_are_reported_exactly(name):
    """A search of 20 faces a body misses contacts of others; made into meshes, these faces are decided by ``exact``."""
    bodies, motion, reported = misses_explained(name, samples=20)
    assert {item.sample_meets for item in reported.values()} >= {False} and len(reported) > 10, "20 faces miss many"
    # the same draw, made into meshes of their own, which the exact detector decides
    components = []
    for body in bodies:
        features = features_of(body.mesh)
        faces = features.face[sample_of(features, size=20, seed=0, name=body.name).pick]
        components.append(Body(body.name, TriangleMesh(body.mesh.vertices, body.mesh.faces[faces])))
    left = create_detector("exact", components).detect(motion, faces=True).face_counts
    for (frame, pair), item in reported.items():
        assert item.sample_meets == (left[frame, pair] > 0)
        assert (item.found_with_more is None) == (not item.sample_meets)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("settings", "more"),
    [
        ({"budget": 20, "warm_start": False}, {"budget": 200}),
        ({"variant": "local", "budget": 5, "warm_start": False}, {"budget": 50}),
        ({"budget": 10}, {"budget": 100}),
    ],
)
def test_spent_budget_differs_from_a_failed_search(settings, more):
    """``more``: ten times the budget, which a miss is said to need or not."""
    bodies, motion, reported = misses_explained("hybrid-qaco", **settings)
    assert {item.found_with_more for item in reported.values()} == {True, False}
    assert all(item.sample_meets for item in reported.values())
    pairs = create_detector("hybrid-qaco", bodies).pairs
    patient = [create_detector("hybrid-qaco", bodies, pairs=pairs[[pair]], **(settings | more)) for pair in range(10)]
    again = [item.detect(motion).verdict[:, 0] == Verdict.CONTACT for item in patient]
    agree = [again[pair][frame] == item.found_with_more for (frame, pair), item in reported.items()]
    # A search that starts warm depends on those of the frames before, which differ here; a cold one does not.
    assert np.mean(agree) > (0.8 if settings.get("warm_start", True) else 0.999)


FIRST_AND_SECOND = np.array([[0, 1]])
FRAMES = 60


def two_balls():
    """Two balls of 2000 faces."""
    return [Body("a", ball_of(faces=2000)), Body("b", ball_of(faces=2000))]


def approach_of_two_balls(frames=FRAMES):
    """Balls of radius 1 whose centres are 2.3 and, at last, 1.7 apart."""
    position = np.zeros((frames, 2, 3))
    position[:, 0, 0] = np.linspace(2.3, 1.7, frames)
    position[:, 0, 1] = 0.1
    return unrotated_motion(position)


def every_frame_requested(motion):
    """A mask (T, 1) of all frames of the only pair."""
    return np.ones((len(motion), 1), dtype=bool)


def search_answer(motion, faces=False, **settings):
    """The answer of a search of two balls that has every frame."""
    stage = SearchStage(two_balls(), FIRST_AND_SECOND, SearchSettings(**settings))
    return stage.decide(motion, every_frame_requested(motion), stage.fresh_memory(), faces=faces)


@pytest.mark.slow
def test_budget_is_spent_on_further_curves_after_a_hit():
    """A search that goes on after its first hit evaluates as many pairs as it may in every frame."""
    budget, motion = 3000, approach_of_two_balls()
    stopped, gone_on = (search_answer(motion, faces=True, budget=budget, stop_first=stop) for stop in (True, False))
    assert stopped.hits.any() and np.array_equal(stopped.hits, gone_on.hits)
    assert gone_on.work["evaluations"] == budget * FRAMES
    assert stopped.work["evaluations"] < gone_on.work["evaluations"]
