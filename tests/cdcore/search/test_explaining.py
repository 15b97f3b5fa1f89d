"""A detector says which of its stages lost a contact: spheres, boxes, the sample of faces, or the budget of its search.

``qaco`` searches where spheres overlap, ``hybrid-qaco`` where boxes do too.
"""

import numpy as np
import pytest
from support.search_scenes import ball_of
from support.shapes import box_mesh, lab_bodies_and_motion, motion_at_rest, unrotated_motion

from cdcore import Body, TriangleMesh, Verdict, create_detector
from cdcore.protocol import Explains, Explanation
from cdcore.search.features import features_of, sample_of
from cdcore.search.search_settings import SearchSettings
from cdcore.search.stage import SearchStage

NO_FACES = np.zeros((0, 2), dtype=np.int64)


def misses_explained(name, **settings):
    """Bodies of a laboratory in 60 frames, and what a detector explains of each contact that it misses there.

    Misses are by frame and pair; the faces that really meet are told to the detector.
    """
    bodies, motion = lab_bodies_and_motion(frames=60)
    detector = create_detector(name, bodies, **settings)
    exact = create_detector("exact", bodies).detect(motion, faces=True)
    missed = np.argwhere((exact.face_counts > 0) & (detector.detect(motion).verdict != Verdict.CONTACT)).tolist()
    explanations = {
        (frame, pair): detector.explain(motion, frame, pair, exact.faces(frame, pair)) for frame, pair in missed
    }
    return bodies, motion, explanations


def explained_cubes(name, x, faces):
    """The explanation by a detector of two cubes of 1 m whose middles are so far from each other along x."""
    bodies = [Body("a", box_mesh()), Body("b", box_mesh())]
    detector = create_detector(name, bodies)
    assert isinstance(detector, Explains)
    return detector.explain(motion_at_rest(bodies, [[0, 0, 0], [x, 0, 0]]), frame=0, pair=0, faces=faces)


def meeting_faces_of_cubes(x):
    """Face pairs of both cubes that meet at this distance."""
    bodies = [Body("a", box_mesh()), Body("b", box_mesh())]
    motion = motion_at_rest(bodies, [[0, 0, 0], [x, 0, 0]])
    return create_detector("exact", bodies).detect(motion, faces=True).faces(frame=0, pair=0)


@pytest.mark.parametrize("name", ["qaco", "hybrid-qaco"])
def test_explanation_of_a_contact_names_spheres_sample_and_budget(name):
    """Cubes of 1 m, 0.9 m from each other: spheres overlap, faces that meet are in the sample, and a
    search finds them.
    """
    explanation = explained_cubes(name, x=0.9, faces=meeting_faces_of_cubes(x=0.9))
    assert explanation.spheres_meet
    assert explanation.sample_meets
    assert explanation.found_with_more


@pytest.mark.parametrize("name", ["qaco", "hybrid-qaco"])
def test_explanation_without_faces_says_nothing_of_sample_and_budget(name):
    """Cubes of 1 m overlap, 0.9 m from each other; the detector is not told which faces meet: both answers are
    ``None``.
    """
    explanation = explained_cubes(name, x=0.9, faces=NO_FACES)
    assert explanation.sample_meets is None
    assert explanation.found_with_more is None


@pytest.mark.parametrize(("name", "boxes_meet"), [("qaco", None), ("hybrid-qaco", False)])
def test_explanation_tells_spheres_from_boxes(name, boxes_meet):
    """Cubes of 1 m, 1.2 m from each other: only their spheres, of radius 0.87 m, overlap; ``qaco`` tests no boxes."""
    explanation = explained_cubes(name, x=1.2, faces=NO_FACES)
    assert explanation.spheres_meet
    assert explanation.boxes_meet == boxes_meet


@pytest.mark.parametrize("name", ["qaco", "hybrid-qaco"])
def test_explanation_ends_with_the_stage_that_cleared_the_pair(name):
    """Cubes of 1 m, 9 m from each other: spheres do not overlap, and no other stage ran, although faces are named as
    well.
    """
    explanation = explained_cubes(name, x=9.0, faces=meeting_faces_of_cubes(x=0.9))
    assert vars(explanation) == {**vars(Explanation()), "spheres_meet": False}


def test_where_meshes_decide_no_search_is_to_blame():
    """With decide="mesh" neither the sample of faces nor the budget says anything: both are None."""
    bodies, motion = lab_bodies_and_motion(frames=2)
    detector = create_detector("hybrid-qaco", bodies, decide="mesh")
    any_faces = np.zeros((1, 2), dtype=np.int64)
    explanation = detector.explain(motion, frame=0, pair=0, faces=any_faces)
    assert explanation.found_with_more is None
    assert explanation.sample_meets is None


@pytest.mark.slow
@pytest.mark.parametrize("name", ["qaco", "hybrid-qaco"])
def test_missing_sample_pairs_are_reported_exactly(name):
    """A search of 20 faces a body misses contacts of others: of each miss is explained whether sampled faces meet.

    Truth is ``exact`` for meshes of the sampled faces alone. More budget is tried only where they do.
    """
    bodies, motion, explanations = misses_explained(name, samples=20)
    assert len(explanations) > 10
    assert False in {explanation.sample_meets for explanation in explanations.values()}
    sampled_bodies = []
    for body in bodies:
        features = features_of(body.mesh)
        faces = features.face[sample_of(features, size=20, seed=0, name=body.name).pick]
        sampled_bodies.append(Body(body.name, TriangleMesh(body.mesh.vertices, body.mesh.faces[faces])))
    sampled_meetings = create_detector("exact", sampled_bodies).detect(motion, faces=True).face_counts
    for (frame, pair), explanation in explanations.items():
        assert explanation.sample_meets == (sampled_meetings[frame, pair] > 0), (frame, pair)
        assert (explanation.found_with_more is None) == (not explanation.sample_meets), (frame, pair)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("settings", "ten_times_the_budget", "least_agreement"),
    [
        pytest.param({"budget": 20, "warm_start": False}, 200, 0.999, id="memetic"),
        pytest.param({"variant": "local", "budget": 5, "warm_start": False}, 50, 0.999, id="local"),
        pytest.param({"budget": 10}, 100, 0.8, id="starts at the last pair, which differs here"),
    ],
)
def test_spent_budget_differs_from_a_failed_search(settings, ten_times_the_budget, least_agreement):
    """A miss is explained by whether a search with ten times the budget finds the contact; some do, some do not.

    That is what a detector with that budget does, of every miss (above 0.999 of fewer than a thousand); of four in five
    at least where a search starts at the best pair of the frame before, which a larger budget makes another.
    """
    bodies, motion, explanations = misses_explained("hybrid-qaco", **settings)
    assert all(explanation.sample_meets for explanation in explanations.values())
    assert {explanation.found_with_more for explanation in explanations.values()} == {True, False}
    pairs, more = create_detector("hybrid-qaco", bodies).pairs, settings | {"budget": ten_times_the_budget}
    contacts = [
        create_detector("hybrid-qaco", bodies, pairs=pairs[[pair]], **more).detect(motion).verdict[:, 0]
        == Verdict.CONTACT
        for pair in range(len(pairs))
    ]
    agrees = [contacts[pair][frame] == item.found_with_more for (frame, pair), item in explanations.items()]
    assert np.mean(agrees) > least_agreement


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
    """Two balls come into contact in 60 frames. A search that goes on after its first hit has the same hits.

    It evaluates as many face pairs as its budget in every frame; one that stops at the first hit, fewer.
    """
    budget, motion = 3000, approach_of_two_balls()
    stopped, continued = (search_answer(motion, faces=True, budget=budget, stop_first=stop) for stop in (True, False))
    assert stopped.hits.any()
    assert np.array_equal(stopped.hits, continued.hits)
    assert continued.work["evaluations"] == budget * FRAMES
    assert stopped.work["evaluations"] < continued.work["evaluations"]
