"""Depth of contacts over time, as the picture shows it."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.small_worlds import unit_cubes_on_x

from replay.engine import compute
from replay.show.rerun_log.depth import MOST_CURVES, deepest_pairs, depth_title, depths_over_time, log_depths


def test_depth_curve_is_zero_beside_a_contact_and_never_within():
    """Unit cubes 0.9 m apart overlap by 0.1 m in frames 2 to 41, 0.7 m apart by 0.3 m in frame 32, 3 m apart not.

    The curve of the pair (frame -> metres, in order of frames) is 0 in the frames beside the contact.
    """
    still = [3.0, 3.0, *[0.9] * 30, 0.7, *[0.9] * 9, 3.0, 3.0]
    session = unit_cubes_on_x({"a": [0.0] * len(still), "b": still})
    depths = depths_over_time(compute(session, detectors="exact,mesh=discrete", oracle="exact"), pair=0)
    assert [*depths] == sorted(depths)
    assert (depths[1], depths[42]) == (0.0, 0.0)
    assert depths[32] == pytest.approx(0.3)
    depths_in_contact = [depth for frame, depth in depths.items() if 2 <= frame <= 41]
    assert min(depths_in_contact) == pytest.approx(0.1)


def run_of_overlapping_pairs(pair_count):
    """A run of three frames: unit cubes b0, b1, ... overlap cube ``a`` in frame 1, each 1 cm deeper than the last."""
    positions = {f"b{k}": [9.0, 0.9 - 0.01 * k, 9.0] for k in range(pair_count)}
    pairs = [("a", name) for name in positions]
    return compute(
        unit_cubes_on_x({"a": [0.0] * 3, **positions}), detectors="exact,mesh=discrete", oracle="exact", pairs=pairs
    )


def test_depth_plot_title_counts_drawn_pairs_when_some_are_not():
    """Two pairs of overlapping cubes more than the plot has curves for; the title says how many have one."""
    pair_count = MOST_CURVES + 2
    title = depth_title(run_of_overlapping_pairs(pair_count))
    assert title == f"Least depth, mm, {MOST_CURVES} of {pair_count} pairs; band: noise"


def test_pairs_of_the_depth_plot_are_sorted_deepest_first():
    """Unit cubes b0, b1 and b2 overlap the cube a by 10, 11 and 12 cm."""
    result = run_of_overlapping_pairs(pair_count=3)
    names = [result.assembly.pair_name(pair) for pair in deepest_pairs(result)]
    assert names == ["a-b2", "a-b1", "a-b0"]


def test_depth_has_the_noise_of_trackers_and_zero_has_none():
    """A contact in frame 4, 2 mm deep; in millimetres the curve is 0, 2, 0, with a variance each for a band of noise.

    Trackers of two bodies have an error of 0.3 mm each, of whose variance a third lies along the depth.
    """
    rows = {}
    writer = SimpleNamespace(
        static=lambda path, style: None, rows=lambda path, frames, columns: rows.update(drawn=columns)
    )
    result = SimpleNamespace(
        oracle="exact",
        depth_series={0: {4: 0.002}},  # pair -> frame -> metres
        episodes={"exact": [SimpleNamespace(pair=0, first=4, last=4)]},
        assembly=SimpleNamespace(motion=range(9), pair_name=lambda pair: "a-b"),
    )
    log_depths(writer, result)
    values, variances = (np.array(column.as_arrow_array().to_pylist()).ravel() for column in rows["drawn"])
    assert values == pytest.approx([0.0, 2.0, 0.0])
    assert variances == pytest.approx([0.0, 2 * 0.3**2 / 3, 0.0])
