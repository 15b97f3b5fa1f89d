"""Verdicts that are kept a pair are those of a detector that is asked about all pairs at once."""

from dataclasses import replace

import numpy as np
import pytest
from support.small_worlds import verdict_column

from cdcore.bounding.collider_shapes import box_collider
from cdcore.bounding.hull import hull_collider
from cdcore.protocol import Solids
from replay.advice import collider_verdicts
from replay.advice.collider_verdicts import ColliderVerdicts, sampled_at_rate
from replay.detection.detector_spec import DetectorSpec
from replay.detection.run_detector import detect_all, make_detector
from replay.engine import prepare


@pytest.fixture
def assembly(two_beakers):
    """Two beakers, each with its rod, as a run prepares them."""
    return prepare(two_beakers, pairs=[("beaker", "rod"), ("second", "stirrer")]).assembly


def colliders_of(assembly, boxed=()):
    """Name of each body -> its only collider: its box where it is named, else its hull."""
    made = {body.name: (box_collider if body.name in boxed else hull_collider)(body.mesh) for body in assembly.bodies}
    return {name: Solids((solid,), solid) for name, solid in made.items()}


def detected_anew(assembly, colliders, **settings):
    """Verdicts of a detector of colliders on all pairs at once, whose bodies have these colliders."""
    bodies = tuple(replace(body, colliders=colliders[body.name]) for body in assembly.bodies)
    with_colliders = replace(assembly, bodies=bodies)
    spec = DetectorSpec("it", "collider", {"shape": "shipped", **settings})
    return detect_all(make_detector(spec, with_colliders, 0), with_colliders).verdict


CHANGING_BOXES = ((), ("beaker",), ("beaker", "rod"), ())
"""Bodies that have a box, one after the other; all others have hulls."""


@pytest.mark.parametrize("settings", [pytest.param({}, id="touch"), pytest.param({"skin_m": 0.002}, id="2 mm apart")])
def test_cached_collider_verdicts_equal_those_of_the_detector(assembly, settings):
    """Colliders of two beakers and two rods change from hulls to boxes and back; verdicts of unchanged pairs are kept.

    ``skin_m``: the gap, metres, from which on contact is reported. Each time all pairs are detected anew to compare.
    """
    verdicts = ColliderVerdicts(assembly, **settings)
    for boxed in CHANGING_BOXES:
        colliders = colliders_of(assembly, boxed)
        expected = detected_anew(assembly, colliders, **settings)
        assert np.array_equal(verdicts.at_every_frame(colliders).verdict, expected)


@pytest.mark.parametrize("settings", [pytest.param({}, id="touch"), pytest.param({"skin_m": 0.002}, id="2 mm apart")])
def test_verdicts_sampled_from_the_cache_equal_those_at_30_hz(assembly, settings):
    """A detector at a step rate keeps its answer until its next step: so do verdicts of every frame, sampled at 30 Hz.

    Colliders of two beakers and two rods change from hulls to boxes and back; each time all are detected anew.
    """
    verdicts = ColliderVerdicts(assembly, **settings)
    for boxed in CHANGING_BOXES:
        colliders = colliders_of(assembly, boxed)
        sampled = sampled_at_rate(verdicts.at_every_frame(colliders), 30.0)
        assert np.array_equal(sampled.verdict, detected_anew(assembly, colliders, rate_hz=30.0, **settings))


def test_only_pairs_of_changed_bodies_are_detected_again(assembly, monkeypatch):
    """Hulls of all bodies, then the rod as a box, that again, hulls again: two detections, for the first two.

    The second is of the rod's pairs only.
    """
    detected_pairs = []
    make = collider_verdicts.make_detector
    monkeypatch.setattr(
        collider_verdicts,
        "make_detector",
        lambda spec, subset, seed: detected_pairs.append(subset.pairs.tolist()) or make(spec, subset, seed),
    )
    verdicts = ColliderVerdicts(assembly)
    hulls = colliders_of(assembly)
    rod_as_box = hulls | {"rod": colliders_of(assembly, ["rod"])["rod"]}
    for colliders in (hulls, rod_as_box, rod_as_box, hulls):
        verdicts.at_every_frame(colliders)
    pairs_of_rod = [pair for pair in assembly.pairs.tolist() if assembly.names.index("rod") in pair]
    assert detected_pairs == [assembly.pairs.tolist(), pairs_of_rod]


def test_kept_verdicts_have_a_limit_of_memory(assembly, monkeypatch):
    """Hulls, then the rod as a box, then the beaker: with room for a byte only the last verdicts stay, one a pair.

    They are right all the same, compared with a detection anew.
    """
    monkeypatch.setattr(collider_verdicts, "MOST_BYTES", 1)
    verdicts = ColliderVerdicts(assembly)
    for boxed in ((), ("rod",), ("beaker",)):
        colliders = colliders_of(assembly, boxed)
        assert np.array_equal(verdicts.at_every_frame(colliders).verdict, detected_anew(assembly, colliders))
    assert len(verdicts.verdict_by_key) == len(assembly.pairs)


def test_sample_is_held_over_frames_without_a_sample():
    """At 100 Hz, sampled at 50: frames 0, 2 and 4. Frame 2 has no pose, so that frame 3 repeats what frame 0 said."""
    sampled = sampled_at_rate(verdict_column("C.-.C."), rate_hz=50.0)
    assert np.array_equal(sampled.verdict, verdict_column("CC-CCC").verdict)
