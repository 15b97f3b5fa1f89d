"""Depth of contacts over time, as the picture shows it."""

import numpy as np
import pytest
from support.small_worlds import cubes

from replay.engine import compute
from replay.show.rerun_log.depth import MOST_CURVES, deepest_pairs, depth_title, depths_over_time


def test_curve_is_zero_beside_a_contact_and_never_within():
    still = [3.0, 3.0, *[0.9] * 30, 0.7, *[0.9] * 9, 3.0, 3.0]
    result = compute(cubes({"a": [0.0] * len(still), "b": still}), detectors="exact,mesh=discrete", oracle="exact")
    depths = depths_over_time(result, 0)
    assert (depths[1], depths[42], depths[32]) == (0.0, 0.0, pytest.approx(0.3))
    assert [*depths] == sorted(depths)
    assert all(depth >= 0.0999 for frame, depth in depths.items() if 2 <= frame <= 41)


def test_title_says_when_pairs_have_no_curve():
    names = {f"b{k}": [9.0, 0.9 - 0.01 * k, 9.0] for k in range(MOST_CURVES + 2)}
    session = cubes({"a": [0.0] * 3, **names})
    result = compute(session, detectors="exact,mesh=discrete", oracle="exact", pairs=[("a", name) for name in names])
    pairs = deepest_pairs(result)
    assert len(pairs) == MOST_CURVES + 2
    assert depth_title(result) == f"Least depth, mm, {MOST_CURVES} of {len(pairs)} pairs; band: noise"
    deepest = [max(result.depth_series[pair].values()) for pair in pairs]
    assert np.all(np.diff(deepest) <= 0)
