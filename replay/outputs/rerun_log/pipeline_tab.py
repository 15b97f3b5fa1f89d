"""The tab *Pipeline*: near bodies, one look of the search, the frame in numbers, and both over time."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from replay.outputs.rerun_log.pipeline import budget_words, near_path, pipeline_path, sphere_path, stage_ms
from replay.outputs.rerun_log.pipeline_frame import WIDTH
from replay.outputs.rerun_log.timing import clipped
from replay.outputs.rerun_log.views import PLAIN, faded_meshes, plot, spatial, text_list
from replay.outputs.rerun_log.world import body_path
from replay.outputs.watched_run import ALL, BOXES, WatchedRun
from replay.pipeline.run_result import RunResult

AROUND: Final = 1.0
"""Seconds before and after the cursor in which steps can be read; over a minute they are a carpet."""


def pipeline_tab(result: RunResult, run: WatchedRun, eye: rrb.EyeControls3D, whole: rrb.TimeAxis, name: str) -> Any:
    """The tab of one detector; ``eye``: where no frame matters; ``whole``: the session's time axis."""
    bodies = result.assembly.names
    meshes, spheres = (
        [f"/{body_path(body)}/mesh" for body in bodies],
        [f"/{sphere_path(body, run.label)}" for body in bodies],
    )
    legend = "boxes meet too (blue), only spheres (grey)" if BOXES in run.counts else "spheres meet (grey)"
    tracked = pipeline_path(run.label, "near", "eye")
    if run.moments:
        eye = rrb.EyeControls3D(tracking_entity=f"/{tracked}")
    pairs_near = f"/{near_path(run.label)}/**"
    near = spatial(f"Near: {legend}", [*meshes, *spheres, pairs_near, f"/{tracked}"], eye)
    start, end = (rr.TimeRangeBoundary.cursor_relative(seconds=sign * AROUND) for sign in (-1, 1))
    around = rrb.TimeAxis(view_range=rr.TimeRange(start=start, end=end))
    pairs = int(max(run.counts[ALL], default=0))
    left = f"Pairs left after each stage, of {pairs}    ({2 * AROUND:g} s around the cursor)"
    counts = plot(around, f"/{pipeline_path(run.label, 'pairs')}", left)
    high, slowest, cut = clipped([np.sum(list(stage_ms(run).values()), axis=0)])
    worst = f", worst {slowest:.2f}{cut}" if cut else ""
    added = f"Stages, ms, added up: {budget_words(run)}{worst}"
    times = plot(whole, f"/{pipeline_path(run.label, 'time')}", added, axis_y=rrb.ScalarAxis(range=(0.0, high)))
    work = plot(whole, f"/{pipeline_path(run.label, 'work')}", "Work per frame")
    top, bottom = [near, _frame(run)], [counts, rrb.Tabs(times, work, active_tab=0)]
    if run.moments:
        top.insert(1, _search(result, run, meshes))
        bottom.append(text_list(pipeline_path(run.label, "moments"), "Frames that matter: click the time"))
    pictures = rrb.Horizontal(*top, column_shares=[0.33, 0.38, 0.29][-len(top) :])
    plots = rrb.Horizontal(*bottom, column_shares=[0.33, 0.38, 0.29][: len(bottom)])
    return rrb.Vertical(pictures, plots, row_shares=[0.66, 0.34], name=name)


def _search(result: RunResult, run: WatchedRun, meshes: list[str]) -> Any:
    root = pipeline_path(run.label, "search")
    controls = rrb.EyeControls3D(tracking_entity=f"/{root}/eye")
    name = "Search: yellow = most pheromone, white = best so far, green = confirmed, red = missed"
    parts = [f"/{root}/{part}" for part in ("faces", "centroids", "best", "steps", "end", "words", "leaders", "eye")]
    return spatial(name, [*meshes, *parts], controls, overrides=faded_meshes(result, result.assembly.names))


def _frame(run: WatchedRun) -> Any:
    bounds = rrb.VisualBounds2D(x_range=(-310.0, WIDTH + 330.0), y_range=(-120.0, 960.0))
    origin = f"/{pipeline_path(run.label, 'frame')}"
    return rrb.Spatial2DView(origin=origin, name="This frame", visual_bounds=bounds, background=PLAIN)
