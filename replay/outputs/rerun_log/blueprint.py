"""The layout: one tab per question, titles that are headlines, nothing on screen that is not data."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
import rerun.blueprint as rrb

from replay.outputs.rerun_log.effects import HAPPENED, EffectViews, effect_views, tab_name
from replay.outputs.rerun_log.findings import finding_lanes, finding_tab
from replay.outputs.rerun_log.lanes import session_lanes
from replay.outputs.rerun_log.layout import (
    LANE_POINTS,
    LOW_POINTS,
    RULER_POINTS,
    BlueprintInput,
    Subject,
    lanes_in_view,
)
from replay.outputs.rerun_log.overview import ON_POLES
from replay.outputs.rerun_log.tabs import answer_tab, pipeline_tab
from replay.outputs.rerun_log.timing import stage_path, timing_view
from replay.outputs.rerun_log.tradeoff import curve_tab
from replay.outputs.rerun_log.views import around_cursor, plot, spatial, state_view, text_list, text_view, whole_layout
from replay.outputs.rerun_log.world import body_path
from replay.outputs.words import lane_legend

AROUND: Final = 0.6
"""Seconds before and after the cursor in the lanes beside the close-up."""

BOTTOM_POINTS: Final = 165
"""Height of the timing plot and of the words about a miss."""

MOST_LANES: Final = 0.6
"""Share of the height of their tab that lanes of effects take at most."""

EFFECT_PLOTS: Final = 4
"""Plots of effects, one per unit; more would be too flat to read."""


def build_blueprint(layout: BlueprintInput) -> rrb.Blueprint:
    """The blueprint that is embedded in the recording; it opens on the tab that answers what was asked for."""
    result = layout.result
    several = len(layout.subjects) > 1
    tabs = [_audit(layout, one, f"Audit: {one.label}" if several else "Audit") for one in layout.subjects]
    # Without anything to compare: the session, and what the one detector found.
    tabs = tabs or [rrb.Horizontal(_room(layout), _report(), column_shares=[0.7, 0.3], name="Session")]
    tabs += [pipeline_tab(layout, run, f"Pipeline: {run.label}" if k else "Pipeline")
             for k, run in enumerate(layout.watched)]  # fmt: skip
    first = 0
    if layout.overview is not None:
        tabs.insert(0, answer_tab(layout, layout.overview))
    if result.tradeoff is not None:
        first = len(tabs)
        tabs.append(curve_tab())
    tabs += _costs(layout, "What accuracy costs" if result.tradeoff is None else "Time per frame")
    doing = tuple(session_lanes(result))
    if result.effects or doing:
        if result.effects and not layout.subjects and result.tradeoff is None:
            first = len(tabs)
        tabs.append(_happened(layout, effect_views(result.effects), doing))
    if layout.detector_lanes:
        words = "What each detector said of each pair (no colour: CLEAR)"
        tabs.append(rrb.Horizontal(state_view("detectors", words, layout.whole), name="Detectors"))
    if (lanes := finding_lanes(result)) is not None:
        tabs.append(finding_tab(lanes, layout.whole))
    return whole_layout(tabs, first)


def _audit(layout: BlueprintInput, subject: Subject, name: str) -> Any:
    lanes = lanes_in_view(subject, layout.result.noise is not None)
    where = f"Where: red missed by {subject.label}, pink in part"
    space = spatial(where, _contents(layout, subject, f"/{subject.missed}/eye"), layout.eye)
    lane_share = RULER_POINTS + LANE_POINTS * max(2, len(lanes))
    shares = [LOW_POINTS - lane_share - BOTTOM_POINTS, lane_share, BOTTOM_POINTS]
    beside = [_close_up(layout, subject)] if subject.camera else []
    widths = [0.42, 0.26, 0.32] if beside else [0.66, 0.34]
    rows = [rrb.Horizontal(space, *beside, _words(subject), column_shares=widths), _lanes(layout, subject, lanes)]
    timed = any(cost.per_frame is not None for cost in layout.costs.values())
    bottom = [timing_view(layout.costs, layout.whole)] if timed else []
    bottom += [text_view(f"{subject.words}/nearest_miss", "The miss in the close-up")] if beside else []
    if bottom:
        rows.append(rrb.Horizontal(*bottom, column_shares=[0.7, 0.3][: len(bottom)]))
    return rrb.Vertical(*rows, row_shares=shares[: len(rows)], name=name)


def _words(subject: Subject) -> Any:
    clusters = [text_list(f"{subject.words}/clusters", subject.headline)] if subject.many else []
    listed = text_list(f"{subject.words}/missed", "All" if subject.many else subject.headline)
    return rrb.Tabs(*clusters, listed, _report(), active_tab=0)


def _report() -> Any:
    return rrb.TextDocumentView(origin="/report", contents=["/report"], name="Report")


def _contents(layout: BlueprintInput, subject: Subject, *hidden: str) -> list[str]:
    """Everything in space but arrows, what is ``hidden``, and what belongs to another audited detector."""
    others = [one for one in layout.subjects if one is not subject]
    bodies = [body_path(name) for name in layout.result.assembly.names]
    foreign = [f"/{one.missed}/**" for one in others] + [f"/{body}/{one.faces}" for one in others for body in bodies]
    own = [f"- /{path}" for path in layout.solids.get(subject.label, ())]
    shown = [rule for rule in layout.hidden if rule not in own]
    return ["/world/**", *shown, *(f"- {path}" for path in [*hidden, *foreign])]


def _close_up(layout: BlueprintInput, subject: Subject) -> Any:
    hidden = (f"/{subject.missed}/{part}" for part in ON_POLES)
    contents = _contents(layout, subject, *hidden)
    return spatial("Close-up: the nearest miss", contents, subject.camera, overrides=layout.faded)


def _lanes(layout: BlueprintInput, subject: Subject, lanes: Sequence[str]) -> Any:
    there = np.flatnonzero(layout.result.comparisons[subject.label].counts).tolist()
    name = f"When and which pair    {lane_legend(there, subject.label)}"
    root = lanes[0].rpartition("/")[0]
    whole = state_view(root, name, layout.whole, lanes)
    if len(lanes) < 2:
        return whole
    near = state_view(root, f"{AROUND} s around the cursor", around_cursor(AROUND), lanes[1:])
    return rrb.Horizontal(whole, near, column_shares=[0.7, 0.3])


def _room(layout: BlueprintInput) -> Any:
    return spatial(layout.result.session.scene.name or "Session", ["/world/**", *layout.hidden], layout.eye)


def _costs(layout: BlueprintInput, name: str) -> list[Any]:
    """The tab of times; none in a run without a detector."""
    if not layout.costs:
        return []
    table = text_view("tradeoff/table", "What each detector costs")
    stages = {label: [stage_path(label, stage) for stage in cost.stages] for label, cost in layout.costs.items()}
    title = "{}: ms per frame by stage"
    plots = [plot(layout.whole, "/timing", title.format(label), paths) for label, paths in stages.items() if paths]
    beside = [rrb.Vertical(*plots)] if plots else []
    return [rrb.Horizontal(*beside, table, column_shares=[0.62, 0.38] if plots else [1.0], name=name)]


def _happened(layout: BlueprintInput, views: EffectViews, doing: Sequence[str]) -> Any:
    """What happened in the room, what people did there (lanes of ``doing``), when, and in numbers."""
    rows: list[Any] = []
    plots = list(views.plots.items())[:EFFECT_PLOTS]
    shares = [LOW_POINTS / max(1, len(plots))] * len(plots)
    if lanes := [*doing, *views.lanes]:
        # As high as its lanes, or the lower ones would be cut off; what is left is for the plots.
        high = min(RULER_POINTS + LANE_POINTS * len(lanes), MOST_LANES * LOW_POINTS)
        shares = [high, *((LOW_POINTS - high) / len(plots) for _ in plots)]
        rows.append(state_view("", "When: what people did, and what the effects found", layout.whole, lanes))
    rows += [plot(layout.whole, "/effects", axis, paths) for axis, paths in plots]
    answer = text_view(HAPPENED, "Answer: what happened")
    listed = [text_list(views.events[0], views.headline, *views.events[1:])] if views.events else []
    left = rrb.Vertical(answer, _room(layout), *listed, row_shares=[0.2, 0.56, 0.24][: 2 + len(listed)])
    beside = [rrb.Vertical(*rows, row_shares=shares)] if rows else []
    return rrb.Horizontal(left, *beside, name=tab_name(layout.result.effects) if layout.result.effects else "Tasks")
