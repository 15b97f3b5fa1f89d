"""The tab *Overview*: the ranking, where and how the moment in focus looks, lanes and times of all detectors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import rerun as rr
import rerun.blueprint as rrb

from replay.outputs.rerun_log.findings import state_view
from replay.outputs.rerun_log.overview import EYE, MOMENTS, NOTE, SPACE, OverviewLanes
from replay.outputs.rerun_log.views import spatial, text_list

ANSWER: Final = "answer"
TAB: Final = "Answer"

AROUND: Final = 2.0
"""Seconds before and after the cursor in the lanes of the pair in focus."""

HEIGHT: Final = 704
LANES_HEIGHT: Final = (64, 40)
"""Points that the tab has at 800 lines; those of a view of lanes without any, and of each lane: the viewer's own."""

BOTTOM: Final = 0.235
"""Share of times, moments and words."""


def overview_tab(
    lanes: OverviewLanes,
    contents: Sequence[str],
    eye: rrb.EyeControls3D,
    faded: Any,
    legend: str,
    whole: rrb.TimeAxis,
    timing: Any,
    wires: Sequence[str],
) -> Any:
    """The tab; ``contents``: of the room; ``eye``: on all of it; ``faded``: overrides of the close-up.

    ``wires``: detectors whose solids are drawn.
    """
    answer = rrb.TextDocumentView(origin=f"/{ANSWER}", name="Answer: what is wrong, why, and what being right costs")
    where = spatial("Where: red missed, pink in part, yellow false", [*contents, f"- /{EYE}"], eye)
    controls = rrb.EyeControls3D(tracking_entity=f"/{EYE}")
    hidden = [f"- /{SPACE}/{part}" for part in ("pins", "flag", "pole")]
    name = f"Close-up    wires: what {wires[0]} asks" if wires else "Close-up: the moment nearest to the cursor"
    close = spatial(name, [*contents, *hidden], controls, overrides=faded)
    start, end = (rr.TimeRangeBoundary.cursor_relative(seconds=sign * AROUND) for sign in (-1, 1))
    around = rrb.TimeAxis(view_range=rr.TimeRange(start=start, end=end))
    near = state_view("focus/pair", f"The pair in focus    {legend}    grey: true", around, lanes.near)
    every = state_view("", "When    red numbers: misses", whole, [*lanes.whole, *lanes.doing])
    bottom = [
        timing,
        text_list(MOMENTS, "Moments: click the time"),
        rrb.TextDocumentView(origin=f"/{NOTE}", name="The moment in the close-up"),
    ]
    rows = [
        rrb.Horizontal(answer, where, close, column_shares=[0.37, 0.315, 0.315]),
        rrb.Horizontal(near, every, column_shares=[0.55, 0.45]),
        rrb.Horizontal(*bottom, column_shares=[0.40, 0.34, 0.26]),
    ]
    # As high as its lanes, and no higher: what is left shows the answer.
    ruler, lane = LANES_HEIGHT
    middle = (ruler + lane * max(len(lanes.near), len(lanes.whole) + len(lanes.doing))) / HEIGHT
    return rrb.Vertical(*rows, row_shares=[1.0 - middle - BOTTOM, middle, BOTTOM], name=TAB)
