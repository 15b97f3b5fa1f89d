"""A traced look is the look of the run: it evaluates as much, ends with the same pair, and invents no face."""

import numpy as np
import pytest
from support.shapes import lab_bodies_and_motion

from cdcore import Verdict, create_detector, intersecting_faces
from cdcore.protocol import detect_live
from cdcore.search.pair_search import PairSearch
from cdcore.search.tracing import Watchable

SETTINGS = [
    {}, {"variant": "corrected"}, {"variant": "local"}, {"variant": "random"}, {"variant": "printed", "budget": 200},
    {"samples": 50}, {"rest": 0.1}, {"without_equation": 15},
]  # fmt: skip


def traced_search(name="qaco", frames=40, **settings):
    """A detector, the motion of the laboratory, and a trace of its search."""
    bodies, motion = lab_bodies_and_motion(frames=frames)
    detector = create_detector(name, bodies, **{"budget": 500, **settings})
    return detector, motion, detector.watch(motion)


def some(noted, count=3):
    """Looks that found a pair and looks that did not, as many of each."""
    hits = [position for position, query in noted.items() if query.result.hit is not None]
    others = [position for position, query in noted.items() if query.result.hit is None]
    return [*hits[:: max(1, len(hits) // count)][:count], *others[:: max(1, len(others) // count)][:count]]


def placed(motion, frame, body, points):
    """Points of a body in the world."""
    return points @ motion.rotations[frame, body].T + motion.translations[frame, body]


@pytest.mark.slow
@pytest.mark.parametrize("settings", SETTINGS, ids=str)
def test_traced_search_equals_the_untraced_search(settings):
    """``noted``: results of the run's searches, by frame and pair; ``trace`` runs one again, one evaluation a row."""
    detector, motion, sample = traced_search(**settings)
    detection, noted = detector.detect(motion), sample.search.noted
    assert sum(query.result.evaluations for query in noted.values()) == detection.work["evaluations"]
    for frame, column in some(noted):
        query, trace = noted[frame, column], sample.search.trace(motion, frame, column)
        assert trace.result == query.result
        assert len(trace.distance) == query.result.evaluations
        assert (query.result.hit is not None) == (detection.verdict[frame, column] == Verdict.CONTACT)
        assert settings.get("variant") == "printed" or trace.iteration.max() == query.result.iterations


def test_search_starts_at_the_last_best_pair():
    """A search of two bodies begins with the faces that met, or came closest, in their search before."""
    started = {}
    _, _, sample = traced_search()
    for (_, column), query in sorted(sample.search.noted.items()):
        assert query.start == started.get(column)
        started[column] = query.result.hit or query.result.closest
    assert started


@pytest.mark.sampled(8)
@pytest.mark.parametrize("name", ["qaco", "hybrid-qaco"])
@pytest.mark.parametrize("settings", [{}, {"samples": 50}, {"rest": 0.1}, {"stop_first": False}], ids=str)
def test_failed_live_searches_are_noted_without_searching_again(name, settings, monkeypatch):
    """Only the searches that hit are run again when the motion is watched."""
    detector, motion, alone = traced_search(name, **settings)
    detect_live(detector, motion)
    searched, query = [], PairSearch.search_from
    monkeypatch.setattr(
        PairSearch, "search_from", lambda *requested, **more: searched.append(1) or query(*requested, **more)
    )
    again = detector.watch(motion)
    notes = [
        {position: (query.result, query.start, query.budget) for position, query in noted.items()}
        for noted in (alone.search.noted, again.search.noted)
    ]
    assert notes[0] == notes[1]
    for field in ("frame", "pair", "start", "stop", "faces"):
        assert np.array_equal(getattr(alone.face_sets, field), getattr(again.face_sets, field))
    hits = sum(query.result.hit is not None for query in again.search.noted.values())
    assert 0 < hits < len(notes[0])
    assert len(searched) == hits


def test_traced_distances_equal_distances_of_face_centroids():
    """Each step of a trace names a pair of faces; a search that ended in a hit ends at faces that really meet."""
    detector, motion, sample = traced_search()
    hits = 0
    for frame, column in some(sample.search.noted):
        trace = sample.search.trace(motion, frame, column)
        bodies = detector.pairs[column].tolist()
        a, b = (
            placed(motion, frame, body, detector.bodies[body].mesh.triangles[trace.faces[:, side]].mean(axis=1))
            for side, body in enumerate(bodies)
        )
        assert np.allclose(np.linalg.norm(a - b, axis=1), trace.distance, atol=1e-12)
        path = trace.best()
        assert (np.diff(trace.distance[path][:-1]) < 0).all()
        if trace.result.hit is not None:
            hits += 1
            poses = [np.eye(4), np.eye(4)]
            for pose, body in zip(poses, bodies, strict=True):
                pose[:3, :3], pose[:3, 3] = motion.rotations[frame, body], motion.translations[frame, body]
            truth = intersecting_faces(*(detector.bodies[body].mesh for body in bodies), *poses)
            assert trace.faces[path[-1]].tolist() in truth.tolist()
    assert hits > 0


def test_only_ants_have_pheromone_within_the_clamp():
    """Pheromone is clamped to 0.001 to 10."""
    _, motion, sample = traced_search()
    cold = sample.search.trace(motion, *next(iter(sample.search.noted)))
    ants = cold.source == "ant"
    assert ants.any() and (cold.source == "local search").any()
    assert (np.isfinite(cold.pheromone) == ants).all()
    assert (cold.pheromone[ants] >= 1e-3).all() and (cold.pheromone[ants] <= 10.0).all()


@pytest.mark.parametrize("name", ["qaco", "hybrid-qaco"])
def test_each_stage_passes_a_subset_of_the_previous(name):
    """Pairs are searched where boxes overlap, and boxes are asked where spheres do; the work counts as many."""
    detector, motion, sample = traced_search(name)
    assert isinstance(detector, Watchable)
    work = detector.detect(motion).work
    assert sample.searched.sum() == work["looks"] <= sample.boxes.sum() <= sample.spheres.sum() < sample.spheres.size
    assert (sample.searched <= sample.boxes).all() and (sample.boxes <= sample.spheres).all()
    if name == "hybrid-qaco":
        assert sample.spheres.sum() == work["box_tests"]
