"""Detectors asked in batches; one that raises has refused that pair alone."""

import numpy as np
import pytest
from support.shapes import triangle_family

from cdcore import Verdict
from cdcore.errors import CollisionCoreError
from cdcore.triangles.decide import triangles_intersect
from replay.studies.stress import triangle_pairs
from replay.studies.stress.triangle_pairs import verdicts_of


@pytest.mark.sampled(3)
@pytest.mark.parametrize(
    "family",
    [
        "generic control",
        "coplanar oblique",
        "collinear against proper",
        "far from the origin",
        "products underflow",
        "products overflow",
        "lattice",
    ],
)
def test_exact_in_batches_equals_the_predicate(family, monkeypatch):
    """40 pairs of a family, as bodies of one face each, are asked in calls of 16, 16 and 8."""
    monkeypatch.setattr(triangle_pairs, "PAIRS_PER_CALL", 16)
    pairs = triangle_family(family).pairs(40)
    assert np.array_equal(verdicts_of("exact", pairs) == Verdict.CONTACT, triangles_intersect(pairs))


def test_no_triangle_pairs_have_no_verdicts():
    """The detector exact is asked about an array without a row."""
    assert verdicts_of("exact", np.zeros((0, 2, 3, 3))).shape == (0,)


def test_refused_triangle_pair_does_not_affect_other_pairs(monkeypatch):
    """Nine pairs share a vertex each and so meet; a detector that raises an error about the fifth is asked for all."""
    pairs, fifth = triangle_family("shared vertex").pairs(9), 4
    create = triangle_pairs.create_detector

    def refuse_fifth(name, bodies, **settings):
        if any((body.mesh.triangles[0] == pairs[fifth, 0]).all() for body in bodies):
            raise CollisionCoreError("not this one")
        return create(name, bodies, **settings)

    monkeypatch.setattr(triangle_pairs, "create_detector", refuse_fifth)
    expected = [Verdict.CONTACT] * 4 + [Verdict.INVALID] + [Verdict.CONTACT] * 4
    assert verdicts_of("exact", pairs).tolist() == expected


@pytest.mark.slow
@pytest.mark.parametrize("detector", ["discrete", "sphere"])
def test_the_cheaper_settings_change_no_verdict(detector, monkeypatch):
    """60 pairs with CHEAPER_SETTINGS, which spare questions of containment and fitted spheres, and without them."""
    pairs = triangle_family("generic control").pairs(60)
    with_cheaper_settings = verdicts_of(detector, pairs)
    monkeypatch.setattr(triangle_pairs, "CHEAPER_SETTINGS", {})
    assert np.array_equal(verdicts_of(detector, pairs), with_cheaper_settings)


def test_sphere_answers_by_its_own_smallest_sphere():
    """Two needles of 1 m lie 0.1 m apart on a line: their smallest spheres, of radius 0.5 m, do not meet.

    A sphere about the mean of the corners (sphere=paper) reaches 2/3 m from there, and meets the other: a candidate.
    """
    needle = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.01, 0.0]])
    pairs = np.array([[needle, needle + np.array([1.1, 0.0, 0.0])]])
    assert verdicts_of("sphere", pairs).tolist() == [Verdict.CLEAR]
    assert verdicts_of("sphere[sphere=paper]", pairs).tolist() == [Verdict.CANDIDATE]
