"""Kernels that run as plain Python, for a debugger or coverage, give what machine code gives."""

import pytest
from support.processes import script

from cdcore import DETECTORS


@pytest.fixture(scope="module")
def interpreted_worlds():
    """The script of that name in ``.ci``: runs detectors with kernels as Python and compares digests of answers."""
    return script("interpreted_worlds")


@pytest.mark.slow
def test_interpreted_kernels_give_digests_of_compiled_kernels(interpreted_worlds):
    """World 0, three small bodies in three frames, by ``exact``: one row is compared, none differs, all
    are finished.
    """
    comparison = interpreted_worlds.compare_worlds([0], ["exact"])
    assert comparison.rows == 1
    assert comparison.differing == []
    assert comparison.unfinished == []


def test_rows_with_other_counters_are_listed(interpreted_worlds):
    """Two detectors are compared in world 3, by digest of verdicts, digest of faces, and counters of work.

    Only the counters of ``obb`` differ.
    """
    comparison = interpreted_worlds.Comparison()
    compiled = {"exact": ["a", "b", "{}"], "obb": ["a", None, "{}"]}
    interpreted = compiled | {"obb": ["a", None, '{"leaf_tests": 1}']}
    comparison.add(3, compiled, interpreted)
    assert comparison.rows == 2
    assert comparison.differing == [(3, "obb")]
    assert comparison.unfinished == []


def test_worlds_beyond_the_time_limit_are_listed(interpreted_worlds):
    """World 4 takes longer than 0.01 s with kernels as Python."""
    comparison = interpreted_worlds.Comparison()
    for world, digests in interpreted_worlds.interpreted_digests([4], ["exact"], limit_s=0.01):
        comparison.add(world, {"exact": ["a", "b", "{}"]}, digests)
    assert comparison.unfinished == [4]
    assert comparison.rows == 0


@pytest.mark.slow
def test_interpreted_kernels_agree_on_random_worlds(interpreted_worlds):
    """Every detector, some with several settings, 21 rows, in 10 small worlds, some 30 s of processor time.

    The command of the script compares 200 worlds.
    """
    comparison = interpreted_worlds.compare_worlds(range(10), list(DETECTORS))
    assert comparison.rows == 10 * 21
    assert comparison.differing == []
    assert comparison.unfinished == []
