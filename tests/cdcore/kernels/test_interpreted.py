"""Kernels that run as plain Python, for a debugger or coverage, give what machine code gives."""

import pytest
from support.processes import script

from cdcore import DETECTORS


@pytest.fixture(scope="module")
def interpreted_worlds():
    return script("interpreted_worlds")


@pytest.mark.slow
def test_interpreted_kernels_give_digests_of_compiled_kernels(interpreted_worlds):
    """World 0 by ``exact`` is one row: compared, equal, finished."""
    comparison = interpreted_worlds.compare_worlds([0], ["exact"])
    assert (comparison.rows, comparison.differing, comparison.unfinished) == (1, [], [])


def test_differing_rows_and_worlds_beyond_the_limit_are_listed(interpreted_worlds):
    """In world 3 two rows are compared, and counters of ``obb`` differ; world 4 takes longer than 0.01 s.

    A row is a detector's digest, digest of faces, and counters.
    """
    comparison = interpreted_worlds.Comparison()
    compiled = {"exact": ["a", "b", "{}"], "obb": ["a", None, "{}"]}
    comparison.add(3, compiled, compiled | {"obb": ["a", None, '{"leaf_tests": 1}']})
    for world, digests in interpreted_worlds.interpreted_digests([4], ["exact"], limit_s=0.01):
        comparison.add(world, compiled, digests)
    assert (comparison.rows, comparison.differing, comparison.unfinished) == (2, [(3, "obb")], [4])


@pytest.mark.slow
def test_interpreted_kernels_agree_on_random_worlds(interpreted_worlds):
    """Every detector in 10 worlds, 21 rows each, some 30 s of processor time; the command compares 200."""
    comparison = interpreted_worlds.compare_worlds(range(10), list(DETECTORS))
    assert (comparison.rows, comparison.differing, comparison.unfinished) == (10 * 21, [], [])
