"""A traced search is the search of the run: it evaluates as much and ends with the same pair of faces.

``watch`` runs a detector over a motion and notes each of its searches by frame and pair (``noted``); ``trace`` runs one
of them again and lists its evaluations, a row each.
"""

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


def watched_laboratory(name="qaco", frames=40, **settings):
    """A detector of five bodies of a laboratory, their motion, and what watching it notes."""
    bodies, motion = lab_bodies_and_motion(frames=frames)
    detector = create_detector(name, bodies, **{"budget": 500, **settings})
    return detector, motion, detector.watch(motion)


def hits_and_failures(noted, count=3):
    """Frames and pairs of some searches with a hit, and of some without, at most so many of each."""
    hits = [key for key, query in noted.items() if query.result.hit is not None]
    failures = [key for key, query in noted.items() if query.result.hit is None]
    return [*hits[:: max(1, len(hits) // count)][:count], *failures[:: max(1, len(failures) // count)][:count]]


def placed(motion, frame, body, points):
    """Points of a body in the world."""
    return points @ motion.rotations[frame, body].T + motion.translations[frame, body]


@pytest.mark.slow
@pytest.mark.parametrize("settings", SETTINGS, ids=str)
def test_traced_search_equals_the_untraced_search(settings):
    """Bodies of a laboratory in 40 frames: searches are noted, and some of them are run again, step by step ("traced").

    A trace has the same result, a row for each evaluation, and a hit where the detector says contact. Rows by the
    paper's own equations ("printed") do not say the last iteration.
    """
    detector, motion, watched = watched_laboratory(**settings)
    detection, noted = detector.detect(motion), watched.search.noted
    assert sum(query.result.evaluations for query in noted.values()) == detection.work["evaluations"]
    for frame, pair in hits_and_failures(noted):
        query, trace = noted[frame, pair], watched.search.trace(motion, frame, pair)
        assert trace.result == query.result, (frame, pair)
        assert len(trace.distance) == query.result.evaluations, (frame, pair)
        assert (query.result.hit is not None) == (detection.verdict[frame, pair] == Verdict.CONTACT), (frame, pair)
        if settings.get("variant") != "printed":
            assert trace.iteration.max() == query.result.iterations, (frame, pair)


def test_search_starts_at_the_last_best_pair():
    """A search of two bodies begins with the faces that met, or came closest, in their search before; the first with
    none.
    """
    last_best = {}
    _detector, _motion, watched = watched_laboratory()
    for (_frame, pair), query in sorted(watched.search.noted.items()):
        assert query.start == last_best.get(pair)
        last_best[pair] = query.result.hit or query.result.closest
    assert last_best


@pytest.mark.sampled(8)
@pytest.mark.parametrize("name", ["qaco", "hybrid-qaco"])
@pytest.mark.parametrize("settings", [{}, {"samples": 50}, {"rest": 0.1}, {"stop_first": False}], ids=str)
def test_failed_live_searches_are_noted_without_searching_again(name, settings, monkeypatch):
    """Bodies of a laboratory in 40 frames: their motion is watched, then detected live and watched again, with the same
    notes and faces.

    The second time only the searches that hit are run again, for their faces; some searches hit and some do not.
    """
    detector, motion, first_watched = watched_laboratory(name, **settings)
    detect_live(detector, motion)
    searches_run, search_from = [], PairSearch.search_from

    def counted_search(*arguments, **options):
        searches_run.append(arguments)
        return search_from(*arguments, **options)

    monkeypatch.setattr(PairSearch, "search_from", counted_search)
    watched = detector.watch(motion)
    first_notes, notes = (
        {key: (query.result, query.start, query.budget) for key, query in item.search.noted.items()}
        for item in (first_watched, watched)
    )
    assert notes == first_notes
    for field in ("frame", "pair", "start", "stop", "faces"):
        assert np.array_equal(getattr(watched.face_sets, field), getattr(first_watched.face_sets, field)), field
    hits = sum(query.result.hit is not None for query in watched.search.noted.values())
    assert 0 < hits < len(notes)
    assert len(searches_run) == hits


def test_traced_distances_equal_distances_of_face_centroids():
    """A row of a trace has a pair of faces, and the distance of their centroids in the world."""
    detector, motion, watched = watched_laboratory()
    for frame, pair in hits_and_failures(watched.search.noted):
        trace = watched.search.trace(motion, frame, pair)
        first, second = (
            placed(motion, frame, body, detector.bodies[body].mesh.triangles[trace.faces[:, side]].mean(axis=1))
            for side, body in enumerate(detector.pairs[pair].tolist())
        )
        assert np.allclose(np.linalg.norm(first - second, axis=1), trace.distance, atol=1e-12), (frame, pair)


def test_best_rows_of_a_trace_come_closer_until_the_hit():
    """``best``: rows that are closer than all before, and at last the hit, a pair of faces that really meets."""
    detector, motion, watched = watched_laboratory()
    hits = 0
    for frame, pair in hits_and_failures(watched.search.noted):
        trace = watched.search.trace(motion, frame, pair)
        rows = trace.best()
        assert (np.diff(trace.distance[rows][:-1]) < 0).all(), (frame, pair)
        if trace.result.hit is None:
            continue
        hits += 1
        bodies, poses = detector.pairs[pair].tolist(), [np.eye(4), np.eye(4)]
        for pose, body in zip(poses, bodies, strict=True):
            pose[:3, :3], pose[:3, 3] = motion.rotations[frame, body], motion.translations[frame, body]
        meeting = intersecting_faces(*(detector.bodies[body].mesh for body in bodies), *poses)
        assert trace.faces[rows[-1]].tolist() in meeting.tolist(), (frame, pair)
    assert hits > 0


def test_only_ants_have_pheromone_within_the_clamp():
    """Rows of a trace are of ants or of local search; pheromone, from 0.001 to 10, is a number for ants alone."""
    _detector, motion, watched = watched_laboratory()
    first_search = next(iter(watched.search.noted))
    trace = watched.search.trace(motion, *first_search)
    ants = trace.source == "ant"
    assert ants.any()
    assert (trace.source == "local search").any()
    assert np.array_equal(np.isfinite(trace.pheromone), ants)
    assert trace.pheromone[ants].min() >= 1e-3
    assert trace.pheromone[ants].max() <= 10.0


@pytest.mark.parametrize("name", ["qaco", "hybrid-qaco"])
def test_each_stage_passes_a_subset_of_the_previous(name):
    """Frames and pairs in which spheres overlap, of these those in which boxes do, and of these those searched.

    The work of the detector counts as many searches, and ``hybrid-qaco`` a box test where spheres overlap.
    """
    detector, motion, watched = watched_laboratory(name)
    assert isinstance(detector, Watchable)
    work = detector.detect(motion).work
    assert not watched.spheres.all()
    assert watched.spheres[watched.boxes].all()
    assert watched.boxes[watched.searched].all()
    assert watched.searched.sum() == work["looks"] > 0
    if name == "hybrid-qaco":
        assert watched.spheres.sum() == work["box_tests"]
