"""Depth of contacts over time, as the picture shows it."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.small_worlds import unit_cubes_on_x

from replay.engine import compute
from replay.show.rerun_log.depth import MOST_CURVES, deepest_pairs, depth_title, depths_over_time, log_depths


def test_depth_curve_is_zero_beside_a_contact_and_never_within():
    """Unit cubes at distance 0.9 overlap by 0.1 m in frames 2 to 41, at 0.7 by 0.3 m in frame 32, at 3.0 not at all."""
    still = [3.0, 3.0, *[0.9] * 30, 0.7, *[0.9] * 9, 3.0, 3.0]
    result = compute(
        unit_cubes_on_x({"a": [0.0] * len(still), "b": still}), detectors="exact,mesh=discrete", oracle="exact"
    )
    depths = depths_over_time(result, 0)
    assert (depths[1], depths[42], depths[32]) == (0.0, 0.0, pytest.approx(0.3))
    assert [*depths] == sorted(depths)
    assert all(depth >= 0.0999 for frame, depth in depths.items() if 2 <= frame <= 41)


def run_of_overlapping_pairs(pair_count):
    """A run of three frames: unit cubes b0, b1, ... overlap cube ``a`` in frame 1, each 1 cm deeper than the last."""
    positions = {f"b{k}": [9.0, 0.9 - 0.01 * k, 9.0] for k in range(pair_count)}
    pairs = [("a", name) for name in positions]
    return compute(
        unit_cubes_on_x({"a": [0.0] * 3, **positions}), detectors="exact,mesh=discrete", oracle="exact", pairs=pairs
    )


def test_depth_plot_title_counts_drawn_pairs_when_some_are_not():
    """At most MOST_CURVES pairs, the deepest, get a curve in the plot."""
    pair_count = MOST_CURVES + 2
    title = depth_title(run_of_overlapping_pairs(pair_count))
    assert title == f"Least depth, mm, {MOST_CURVES} of {pair_count} pairs; band: noise"


def test_pairs_of_the_depth_plot_are_sorted_deepest_first():
    """b0, b1 and b2 overlap a by 10, 11 and 12 cm."""
    result = run_of_overlapping_pairs(pair_count=3)
    names = [result.assembly.pair_name(pair) for pair in deepest_pairs(result)]
    assert names == ["a-b2", "a-b1", "a-b0"]


def test_depth_has_the_noise_of_trackers_and_zero_has_none():
    """Two trackers of 0.3 mm each, of which a third of the variance lies along a direction: 0.24 mm."""
    rows = {}
    writer = SimpleNamespace(
        static=lambda path, style: None, rows=lambda path, frames, columns: rows.update(drawn=columns)
    )
    result = SimpleNamespace(
        oracle="exact",
        depth_series={0: {4: 0.002}},
        episodes={"exact": [SimpleNamespace(pair=0, first=4, last=4)]},
        assembly=SimpleNamespace(motion=range(9), pair_name=lambda pair: "a-b"),
    )
    log_depths(writer, result)
    values, variances = (np.array(column.as_arrow_array().to_pylist()).ravel() for column in rows["drawn"])
    assert values == pytest.approx([0.0, 2.0, 0.0])
    assert variances == pytest.approx([0.0, 0.3**2 * 2 / 3, 0.0])
