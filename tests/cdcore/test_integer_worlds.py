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
LATTICE_PAIRS = 60


def lattice_pairs(seed, size):
    """Triangle pairs (n, 2, 3, 3) on a lattice of so many points a side: many touch, some are segments and points."""
    rng = np.random.default_rng(seed)
    return rng.integers(0, size, (LATTICE_PAIRS, 2, 3, 3)).astype(float)


@pytest.mark.parametrize("size", [2, 3, 6])
@pytest.mark.parametrize("scale", [1.0, 1 / 3, 2.0**-400])
def test_two_exact_tests_of_triangles_agree(size, scale):
    """60 random triangle pairs on a lattice of ``size`` points a side, where many touch exactly.

    The oracle of other tests decides in whole numbers (``meet_exactly``), or filters in floats before (``meet``).
    Beside it stand separating axes in integers, which share no code with it.
    """
    pairs = lattice_pairs(seed=size, size=size) * scale
    expected = [bool(meets_by_axes(pair)) for pair in pairs]
    assert 4 < sum(expected) < LATTICE_PAIRS - 2, "some pairs meet and some do not"
    assert meet_exactly(pairs).tolist() == expected
    answers, _count_of_integer_tests = meet(pairs)
    assert answers.tolist() == expected


def test_scaled_integer_triangles_meet_as_the_unscaled():
    """Corners are 0, 1 or 2, and the same times 3^30 = 2e14: doubles hold both exactly, so that only size differs."""
    pairs = lattice_pairs(seed=1, size=3)
    assert meet_exactly(pairs).tolist() == meet_exactly(pairs * 3.0**30).tolist()


def test_exact_detector_finds_faces_given_by_integer_arithmetic():
    """``differences`` lists every answer of a detector, whole motion or frame by frame (``live``), that the integers
    contradict: verdicts, and lists of faces that meet. A seed makes a world of three bodies in four frames.
    """
    for seed in QUICK_SEEDS:
        texts, _count_of_integer_tests = differences(world_of(seed), ["exact"], live=["exact"])
        assert texts == [], seed


@pytest.mark.slow
def test_complete_detectors_find_faces_given_by_integer_arithmetic():
    """155 worlds of three bodies in four frames, and every detector that promises all faces that meet (COMPLETE): the
    integers contradict no answer (``differences``).
    """
    for seed in SLOW_SEEDS:
        texts, _count_of_integer_tests = differences(world_of(seed), COMPLETE, live=["exact"])
        assert texts == [], seed
