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
    """40 pairs of each family, 16 a call."""
    monkeypatch.setattr(triangle_pairs, "PAIRS_PER_CALL", 16)
    pairs = triangle_family(family).pairs(40)
    assert np.array_equal(verdicts_of("exact", pairs) == Verdict.CONTACT, triangles_intersect(pairs))
    assert verdicts_of("exact", pairs[:0]).shape == (0,)


def test_refused_triangle_pair_does_not_affect_other_pairs(monkeypatch):
    """The fifth of nine pairs is refused."""
    pairs = triangle_family("shared vertex").pairs(9)
    create = triangle_pairs.create_detector

    def picky(name, bodies, **settings):
        if any((body.mesh.triangles[0] == pairs[4, 0]).all() for body in bodies):
            raise CollisionCoreError("not this one")
        return create(name, bodies, **settings)

    monkeypatch.setattr(triangle_pairs, "create_detector", picky)
    expected = [Verdict.CONTACT] * 4 + [Verdict.INVALID] + [Verdict.CONTACT] * 4
    assert verdicts_of("exact", pairs).tolist() == expected


@pytest.mark.slow
@pytest.mark.parametrize("detector", ["discrete", "sphere"])
def test_the_cheaper_settings_change_no_verdict(detector, monkeypatch):
    """60 pairs, with the settings that spare work and without them."""
    pairs = triangle_family("generic control").pairs(60)
    cheap = verdicts_of(detector, pairs)
    monkeypatch.setattr(triangle_pairs, "CHEAPER_SETTINGS", {})
    assert np.array_equal(verdicts_of(detector, pairs), cheap)


def test_sphere_answers_by_its_own_smallest_sphere():
    """Two needles of 1 m lie 0.1 m apart on a line; a sphere about the mean of the corners would reach 2/3 m."""
    needle = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.01, 0.0]])
    pairs = np.array([[needle, needle + np.array([1.1, 0.0, 0.0])]])
    assert verdicts_of("sphere", pairs).tolist() == [Verdict.CLEAR]
    assert verdicts_of("sphere[sphere=paper]", pairs).tolist() == [Verdict.CANDIDATE]
