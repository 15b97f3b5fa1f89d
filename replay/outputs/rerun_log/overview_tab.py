"""The tab *Overview*: the ranking, where and how the moment in focus looks, lanes and times of all detectors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import rerun as rr
import rerun.blueprint as rrb

from replay.outputs.rerun_log.findings import state_view
from replay.outputs.rerun_log.overview import EYE, MOMENTS, NOTE, SPACE, OverviewLanes
from replay.outputs.rerun_log.views import spatial, text_list

RANKING: Final = "ranking"
TAB: Final = "All detectors"

AROUND: Final = 2.0
"""Seconds before and after the cursor in the lanes of the pair in focus."""

SHARES: Final = (0.42, 0.32, 0.26)
"""Heights of pictures, lanes and times: four lanes are whole at 800 lines."""


def overview_tab(
    lanes: OverviewLanes,
    contents: Sequence[str],
    eye: rrb.EyeControls3D,
    faded: Any,
    legend: str,
    whole: rrb.TimeAxis,
    timing: Any,
) -> Any:
    """The tab; ``contents``: of the room; ``eye``: on all of it; ``faded``: overrides of the close-up."""
    ranking = rrb.TextDocumentView(origin=f"/{RANKING}", name="Ranking")
    where = spatial("Where: red = missed, yellow = false", [*contents, f"- /{EYE}"], eye)
    controls = rrb.EyeControls3D(tracking_entity=f"/{EYE}")
    hidden = [f"- /{SPACE}/{part}" for part in ("pins", "flag", "pole")]
    close = spatial("Close-up: the moment nearest to the cursor", [*contents, *hidden], controls, overrides=faded)
    start, end = (rr.TimeRangeBoundary.cursor_relative(seconds=sign * AROUND) for sign in (-1, 1))
    around = rrb.TimeAxis(view_range=rr.TimeRange(start=start, end=end))
    near = state_view("focus/pair", f"The pair in focus    {legend}    grey: true", around, lanes.near)
    every = state_view("focus/all", "All pairs, whole session: red numbers are misses", whole, lanes.whole)
    bottom = [
        timing,
        text_list(MOMENTS, "Moments: click the time"),
        rrb.TextDocumentView(origin=f"/{NOTE}", name="The moment in the close-up"),
    ]
    rows = [
        rrb.Horizontal(ranking, where, close, column_shares=[0.37, 0.315, 0.315]),
        rrb.Horizontal(near, every, column_shares=[0.55, 0.45]),
        rrb.Horizontal(*bottom, column_shares=[0.40, 0.34, 0.26]),
    ]
    return rrb.Vertical(*rows, row_shares=list(SHARES), name=TAB)
