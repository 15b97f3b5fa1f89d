"""Depth of contacts over time: a curve a pair, with the noise of the trackers as its band."""

from __future__ import annotations

from typing import Final

import numpy as np
import rerun as rr

from replay.document.depth import NOISE_SIGMA_M
from replay.document.run_result import RunResult
from replay.show.palette import SERIES_COLOURS
from replay.show.rerun_log.recording_file import RecordingWriter, drawable, entity, pack_colours
from replay.show.rerun_log.timing import colour_of

DEPTH_ENTITY: Final = "depth"
"""Entity below which the curves stand."""

MOST_CURVES: Final = len(SERIES_COLOURS)
"""Pairs with a curve, the deepest ones: each has a colour of its own."""


def deepest_pairs(result: RunResult) -> list[int]:
    """Return the columns of the pairs that have a curve, the deepest first."""
    series = result.depth_series if result.oracle else {}
    depth_by_pair = {pair: max(depths.values(), default=0.0) for pair, depths in series.items()}
    pairs = [pair for pair, depth in depth_by_pair.items() if depth > 0.0]
    return sorted(pairs, key=lambda pair: (-depth_by_pair[pair], pair))


def depth_title(result: RunResult) -> str:
    """Title of the plot, with the number of pairs that have a curve where others have none."""
    pairs = len(deepest_pairs(result))
    count_text = f", {MOST_CURVES} of {pairs} pairs" if pairs > MOST_CURVES else ""
    return f"Least depth, mm{count_text}; band: noise"


def log_depths(writer: RecordingWriter, result: RunResult) -> None:
    """Send the depth of each pair in every frame of its contacts that was searched; 0 just before and after them."""
    for number, pair in enumerate(deepest_pairs(result)[:MOST_CURVES]):
        name = result.assembly.pair_name(pair)
        depths = depths_over_time(result, pair)
        millimetres = 1e3 * np.array([*depths.values()])
        variances = np.where(millimetres > 0.0, (1e3 * NOISE_SIGMA_M) ** 2, 0.0)
        path = entity(DEPTH_ENTITY, name)
        error_bars = rr.Measurements.from_fields(
            # The viewer would join neighbours into means or maxima, and draw diagonals from one contact to the next.
            aggregation_policy=rr.components.AggregationPolicy.Off,
            units="mm",
            colors=pack_colours([colour_of(number)]),
            widths=1.8,
            names=drawable(name),
        )
        writer.static(path, error_bars)
        writer.rows(path, [*depths], rr.Measurements.columns(values=millimetres, variances=variances))


def depths_over_time(result: RunResult, pair: int) -> dict[int, float]:
    """Return frame -> metres of a pair, in order of time: of every frame searched, and 0 just beside each contact."""
    depths = dict(result.depth_series[pair])
    for contact in result.episodes[result.oracle]:
        if contact.pair == pair:
            frames_beside = (
                frame for frame in (contact.first - 1, contact.last + 1) if 0 <= frame < len(result.assembly.motion)
            )
            for frame in frames_beside:
                depths.setdefault(frame, 0.0)
    return dict(sorted(depths.items()))
