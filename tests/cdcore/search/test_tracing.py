"""A traced look is the look of the run: it evaluates as much, ends with the same pair, and invents no face."""

import numpy as np
import pytest
from support.shapes import lab

from cdcore import create_detector, intersecting_faces
from cdcore.protocol import detect_live
from cdcore.search.pair_search import PairSearch
from cdcore.search.tracing import Watchable

SETTINGS = [
    {}, {"variant": "corrected"}, {"variant": "local"}, {"variant": "random"}, {"variant": "printed", "budget": 200},
    {"samples": 50}, {"rest": 0.1}, {"without_equation": 15},
]  # fmt: skip


def watch(name="qaco", frames=60, **settings):
    bodies, motion = lab(frames)
    detector = create_detector(name, bodies, **{"budget": 500, **settings})
    return detector, motion, detector.watch(motion)


def some(noted, count=3):
    """Looks that found a pair and looks that did not, as many of each."""
    hits = [place for place, look in noted.items() if look.result.hit is not None]
    others = [place for place, look in noted.items() if look.result.hit is None]
    return [*hits[:: max(1, len(hits) // count)][:count], *others[:: max(1, len(others) // count)][:count]]


def placed(motion, frame, body, points):
    return points @ motion.rotations[frame, body].T + motion.translations[frame, body]


@pytest.mark.slow
@pytest.mark.parametrize("settings", SETTINGS, ids=str)
def test_a_traced_look_counts_the_same_and_ends_as_the_run_did(settings):
    detector, motion, seen = watch(**settings)
    detection, noted = detector.detect(motion), seen.search.noted
    assert sum(look.result.evaluations for look in noted.values()) == detection.work["evaluations"]
    for frame, column in some(noted):
        look, trace = noted[frame, column], seen.search.trace(motion, frame, column)
        assert trace.result == look.result
        assert len(trace.distance) == look.result.evaluations
        assert (look.result.hit is not None) == (detection.verdict[frame, column] == 1)
        assert settings.get("variant") == "printed" or trace.iteration.max() == look.result.iterations


def test_a_look_starts_at_the_pair_that_met_or_came_closest_in_the_look_before():
    started = {}
    for (_, column), look in sorted(watch()[2].search.noted.items()):
        assert look.start == started.get(column)
        started[column] = look.result.hit or look.result.closest
    assert started


@pytest.mark.parametrize("name", ["qaco", "hybrid-qaco"])
@pytest.mark.parametrize("settings", [{}, {"samples": 50}, {"rest": 0.1}, {"stop_first": False}], ids=str)
def test_what_a_live_run_looked_at_in_vain_is_noted_alike_without_a_second_search(name, settings, monkeypatch):
    detector, motion, alone = watch(name, **settings)
    detect_live(detector, motion)
    searched, look = [], PairSearch.search_from
    monkeypatch.setattr(PairSearch, "search_from", lambda *asked, **more: searched.append(1) or look(*asked, **more))
    again = detector.watch(motion)
    notes = [
        {place: (look.result, look.start, look.budget) for place, look in noted.items()}
        for noted in (alone.search.noted, again.search.noted)
    ]
    assert notes[0] == notes[1]
    for field in ("frame", "pair", "start", "stop", "faces"):
        assert np.array_equal(getattr(alone.face_sets, field), getattr(again.face_sets, field))
    hits = sum(look.result.hit is not None for look in again.search.noted.values())
    assert 0 < hits < len(notes[0]) == len(searched) + len(notes[0]) - hits


def test_distances_are_those_of_the_faces_and_the_last_pair_of_a_hit_meets():
    detector, motion, seen = watch()
    hits = 0
    for frame, column in some(seen.search.noted):
        trace = seen.search.trace(motion, frame, column)
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


def test_every_ant_has_pheromone_within_its_clamp_and_nobody_else_has():
    _, motion, seen = watch()
    cold = seen.search.trace(motion, *next(iter(seen.search.noted)))
    ants = cold.asked_by == "ant"
    assert ants.any() and (cold.asked_by == "walk").any()
    assert (np.isfinite(cold.pheromone) == ants).all()
    assert (cold.pheromone[ants] >= 1e-3).all() and (cold.pheromone[ants] <= 10.0).all()


@pytest.mark.parametrize("name", ["qaco", "hybrid-qaco"])
def test_each_stage_lets_through_a_part_of_what_the_one_before_did(name):
    detector, motion, seen = watch(name)
    assert isinstance(detector, Watchable)
    work = detector.detect(motion).work
    assert seen.searched.sum() == work["looks"] <= seen.boxes.sum() <= seen.spheres.sum() < seen.spheres.size
    assert (seen.searched <= seen.boxes).all() and (seen.boxes <= seen.spheres).all()
    if name == "hybrid-qaco":
        assert seen.spheres.sum() == work["box_tests"]
