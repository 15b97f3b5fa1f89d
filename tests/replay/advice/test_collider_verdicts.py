"""Verdicts that are kept a pair are those of a detector that is asked about all pairs at once."""

from dataclasses import replace

import numpy as np
import pytest

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


def solids(assembly, boxed=()):
    """Hulls, boxes of the bodies that are named."""
    made = {body.name: (box_collider if body.name in boxed else hull_collider)(body.mesh) for body in assembly.bodies}
    return {name: Solids((solid,), solid) for name, solid in made.items()}


def detected(assembly, colliders, settings):
    """The detection of a run whose bodies have these colliders."""
    bodies = tuple(replace(body, colliders=colliders[body.name]) for body in assembly.bodies)
    asked = replace(assembly, bodies=bodies)
    spec = DetectorSpec("it", "collider", {"shape": "shipped", **settings})
    return detect_all(make_detector(spec, asked, 0), asked).verdict


@pytest.mark.parametrize("settings", [{}, {"skin_m": 0.002}])
@pytest.mark.parametrize("rate_hz", [None, 30.0])
def test_cached_collider_verdicts_equal_those_of_the_detector(assembly, settings, rate_hz):
    """Bodies have hulls, or boxes in turn; the detector is asked about all pairs anew each time."""
    verdicts = ColliderVerdicts(assembly, **settings)
    for boxed in ((), ("beaker",), ("beaker", "rod"), ()):
        colliders = solids(assembly, boxed)
        every = verdicts.at_every_frame(colliders)
        assert np.array_equal(every.verdict, detected(assembly, colliders, settings))
        rate = {"rate_hz": rate_hz} if rate_hz else {}
        expected = detected(assembly, colliders, {**settings, **rate})
        assert np.array_equal(sampled_at_rate(every, rate_hz).verdict, expected)


def test_only_pairs_of_changed_bodies_are_detected_again(assembly, monkeypatch):
    """Hulls of all, then the rod as a box, that again, hulls again: two detections, the second of the rod's pairs."""
    pairs = []
    original = collider_verdicts.make_detector
    monkeypatch.setattr(
        collider_verdicts,
        "make_detector",
        lambda spec, seen, seed: pairs.append(seen.pairs.tolist()) or original(spec, seen, seed),
    )
    verdicts = ColliderVerdicts(assembly)
    hulls = solids(assembly)
    with_box = hulls | {"rod": solids(assembly, ["rod"])["rod"]}
    for colliders in (hulls, with_box, with_box, hulls):
        verdicts.at_every_frame(colliders)
    changed = [pair for pair in assembly.pairs.tolist() if assembly.names.index("rod") in pair]
    assert pairs == [assembly.pairs.tolist(), changed]


def test_kept_verdicts_have_a_limit_of_memory(assembly, monkeypatch):
    """With room for a byte only the verdicts of the last colliders stay, one a pair."""
    monkeypatch.setattr(collider_verdicts, "MOST_BYTES", 1)
    verdicts = ColliderVerdicts(assembly)
    for boxed in ((), ("rod",), ("beaker",)):
        colliders = solids(assembly, boxed)
        assert np.array_equal(verdicts.at_every_frame(colliders).verdict, detected(assembly, colliders, {}))
    assert len(verdicts.verdict_by_key) == len(assembly.pairs)
