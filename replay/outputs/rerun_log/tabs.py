"""The tabs *Answer*, on all detectors at the moment in focus, and *Pipeline*, on one of them at its work."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import rerun.blueprint as rrb

from replay.comparison.outcome import Outcome
from replay.outputs.rerun_log import views
from replay.outputs.rerun_log.layout import LANE_POINTS, LOW_POINTS, RULER_POINTS, BlueprintInput
from replay.outputs.rerun_log.overview import ANSWER, EYE, MOMENTS, NOTE, ON_POLES, SPACE, OverviewLanes
from replay.outputs.rerun_log.pipeline import budget_words, near_path, pipeline_path, sphere_path, stage_ms
from replay.outputs.rerun_log.pipeline_frame import WIDTH
from replay.outputs.rerun_log.timing import clipped, timing_view
from replay.outputs.rerun_log.world import body_path
from replay.outputs.watched_run import ALL, BOXES, WatchedRun
from replay.outputs.words import lane_legend

ANSWER_TAB: Final = "Answer"

AROUND: Final = 2.0
"""Seconds before and after the cursor in the lanes of the pair in focus."""

BOTTOM: Final = 0.235
"""Share of times, moments and words."""

IN_LEGEND: Final = frozenset({Outcome.MISSED, Outcome.INVENTED, Outcome.BOTH, Outcome.HELD})
"""Outcomes that the legend of the pair in focus names; for more there is no room."""

STEPS_AROUND: Final = 1.0
"""Seconds before and after the cursor in which steps can be read; over a minute they are a carpet."""


def answer_tab(layout: BlueprintInput, lanes: OverviewLanes) -> Any:
    """The ranking, where and how the moment in focus looks, lanes and times of all detectors."""
    contents = ["/world/**", *layout.crowding, *(f"- /{one.missed}/**" for one in layout.subjects)]
    answer = views.text_view(ANSWER, "Answer: what is wrong, why, and what being right costs")
    where = views.spatial("Where: red missed, pink in part, yellow false", [*contents, f"- /{EYE}"], layout.eye)
    hidden = [f"- /{SPACE}/{part}" for part in ON_POLES]
    wires = f"wires: what {next(iter(layout.solids))} asks" if layout.solids else ""
    name = f"Close-up    {wires}" if wires else "Close-up: the moment nearest to the cursor"
    close = views.spatial(name, [*contents, *hidden], EYE, overrides=layout.faded)
    there = {code for one in layout.result.comparisons.values() for code in np.flatnonzero(one.counts).tolist()}
    legend = f"The pair in focus    {lane_legend(there & IN_LEGEND)}    grey: true"
    near = views.state_view("focus/pair", legend, views.around_cursor(AROUND), lanes.near)
    every = views.state_view("", "When    red numbers: misses", layout.whole, [*lanes.whole, *lanes.doing])
    bottom = [
        timing_view(layout.costs, layout.whole, short=True),
        views.text_list(MOMENTS, "Moments: click the time"),
        views.text_view(NOTE, "The moment in the close-up"),
    ]
    rows = [
        rrb.Horizontal(answer, where, close, column_shares=[0.37, 0.315, 0.315]),
        rrb.Horizontal(near, every, column_shares=[0.55, 0.45]),
        rrb.Horizontal(*bottom, column_shares=[0.40, 0.34, 0.26]),
    ]
    # As high as its lanes, and no higher: what is left shows the answer.
    most = max(len(lanes.near), len(lanes.whole) + len(lanes.doing))
    middle = (RULER_POINTS + LANE_POINTS * most) / LOW_POINTS
    return rrb.Vertical(*rows, row_shares=[1.0 - middle - BOTTOM, middle, BOTTOM], name=ANSWER_TAB)


def pipeline_tab(layout: BlueprintInput, run: WatchedRun, name: str) -> Any:
    """Near bodies, one look of the search, the frame in numbers, and both over time."""
    bodies, whole = layout.result.assembly.names, layout.whole
    meshes = [f"/{body_path(body)}/mesh" for body in bodies]
    spheres = [f"/{sphere_path(body, run.label)}" for body in bodies]
    legend = "boxes meet too (blue), only spheres (grey)" if BOXES in run.counts else "spheres meet (grey)"
    tracked = pipeline_path(run.label, "near", "eye")
    near_contents = [*meshes, *spheres, f"/{near_path(run.label)}/**", f"/{tracked}"]
    near = views.spatial(f"Near: {legend}", near_contents, tracked if run.moments else layout.eye)
    pairs = int(max(run.counts[ALL], default=0))
    left = f"Pairs left after each stage, of {pairs}    ({2 * STEPS_AROUND:g} s around the cursor)"
    counts = views.plot(views.around_cursor(STEPS_AROUND), f"/{pipeline_path(run.label, 'pairs')}", left)
    high, slowest, cut = clipped([np.sum(list(stage_ms(run).values()), axis=0)])
    added = f"Stages, ms, added up: {budget_words(run)}{f', worst {slowest:.2f}{cut}' if cut else ''}"
    times = views.plot(whole, f"/{pipeline_path(run.label, 'time')}", added, axis_y=rrb.ScalarAxis(range=(0.0, high)))
    work = views.plot(whole, f"/{pipeline_path(run.label, 'work')}", "Work per frame")
    top, bottom = [near, _frame(run)], [counts, rrb.Tabs(times, work, active_tab=0)]
    if run.moments:
        top.insert(1, _search(layout, run, meshes))
        bottom.append(views.text_list(pipeline_path(run.label, "moments"), "Frames that matter: click the time"))
    pictures = rrb.Horizontal(*top, column_shares=[0.33, 0.38, 0.29][-len(top) :])
    plots = rrb.Horizontal(*bottom, column_shares=[0.33, 0.38, 0.29][: len(bottom)])
    return rrb.Vertical(pictures, plots, row_shares=[0.66, 0.34], name=name)


def _search(layout: BlueprintInput, run: WatchedRun, meshes: list[str]) -> Any:
    root, result = pipeline_path(run.label, "search"), layout.result
    name = "Search: yellow = most pheromone, white = best so far, green = confirmed, red = missed"
    parts = [f"/{root}/{part}" for part in ("faces", "centroids", "best", "steps", "end", "words", "leaders", "eye")]
    faded = views.faded_meshes(result, result.assembly.names)
    return views.spatial(name, [*meshes, *parts], f"{root}/eye", overrides=faded)


def _frame(run: WatchedRun) -> Any:
    bounds = rrb.VisualBounds2D(x_range=(-310.0, WIDTH + 330.0), y_range=(-120.0, 960.0))
    origin = f"/{pipeline_path(run.label, 'frame')}"
    return rrb.Spatial2DView(origin=origin, name="This frame", visual_bounds=bounds, background=views.PLAIN)
