"""Detectors give the face pairs that integers give; the integer test is right on triangles of every degeneracy.

The command ``python tests/oracles/integer_worlds.py --count 20000`` asks that many worlds, in 14 minutes of processor
time.
"""

import numpy as np
import pytest
from oracles.integer_worlds import COMPLETE, differences, meet, meet_exactly, world_of
from oracles.separating_axes import meets_by_axes

QUICK_SEEDS = range(5)
SLOW_SEEDS = range(5, 160)
LATTICE_PAIRS = 120


def lattice_pairs(seed, size):
    """Triangle pairs (n, 2, 3, 3) on a lattice of so many points a side: many touch, some are segments and points."""
    rng = np.random.default_rng(seed)
    return rng.integers(0, size, (LATTICE_PAIRS, 2, 3, 3)).astype(float)


@pytest.mark.parametrize("size", [2, 3, 6])
@pytest.mark.parametrize("scale", [1.0, 1 / 3, 2.0**-400])
def test_reference_agrees_with_scalar_separating_axes(size, scale):
    """Triangles have corners at whole numbers up to the size, so that many touch exactly."""
    pairs = lattice_pairs(seed=size, size=size) * scale
    expected = [bool(meets_by_axes(pair)) for pair in pairs]
    assert 8 < sum(expected) < LATTICE_PAIRS - 2
    assert meet_exactly(pairs).tolist() == expected
    assert meet(pairs)[0].tolist() == expected


def test_scaled_integer_triangles_meet_as_the_unscaled():
    """Coordinates from 0 to 2, and times 3^30, which doubles hold exactly."""
    pairs = lattice_pairs(seed=1, size=3)
    assert meet_exactly(pairs).tolist() == meet_exactly(pairs * 3.0**30).tolist()


def test_exact_detector_finds_faces_given_by_integer_arithmetic():
    """Whole motions, with faces and without, and frame by frame; ``differences`` lists what integers deny."""
    for seed in QUICK_SEEDS:
        assert differences(world_of(seed), ["exact"], live=["exact"])[0] == [], seed


@pytest.mark.slow
def test_complete_detectors_find_faces_given_by_integer_arithmetic():
    """COMPLETE: detectors that miss no contact; whole motions with faces and without, ``exact`` live too."""
    for seed in SLOW_SEEDS:
        assert differences(world_of(seed), COMPLETE, live=["exact"])[0] == [], seed
