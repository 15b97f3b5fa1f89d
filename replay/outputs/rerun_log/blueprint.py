"""The layout: one tab per question, titles that are headlines, nothing on screen that is not data."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from replay.comparison.outcome import Outcome
from replay.effects.effects_runner import SKIPPED
from replay.outputs.camera import Eye
from replay.outputs.rerun_log.columns import SESSION
from replay.outputs.rerun_log.contacts import contacts_path
from replay.outputs.rerun_log.effects import HAPPENED, EffectViews, effect_views, tab_name
from replay.outputs.rerun_log.findings import finding_lanes, finding_tab, state_view
from replay.outputs.rerun_log.lanes import noise_lane
from replay.outputs.rerun_log.overview import SPACE, OverviewLanes
from replay.outputs.rerun_log.overview_tab import overview_tab
from replay.outputs.rerun_log.pipeline import sphere_path
from replay.outputs.rerun_log.pipeline_tab import pipeline_tab
from replay.outputs.rerun_log.session_lanes import session_lanes
from replay.outputs.rerun_log.timing import Cost, any_timed, stage_path, timing_view
from replay.outputs.rerun_log.tradeoff import curve_tab
from replay.outputs.rerun_log.views import faded_meshes, plot, spatial, text_list
from replay.outputs.rerun_log.world import body_path
from replay.outputs.watched_run import WatchedRun
from replay.outputs.words import lane_legend
from replay.pipeline.run_result import RunResult

AROUND: Final = 0.6
"""Seconds before and after the cursor in the lanes beside the close-up."""

LANE_POINTS: Final = 40
RULER_POINTS: Final = 64
"""Heights of a lane, and of title and ruler together, in points: the viewer does not let us choose."""

LOW_POINTS: Final = 704
"""Height the tabs share on a screen of 800 lines: shares are relative, so what is whole there is whole on all."""

BOTTOM_POINTS: Final = 165
"""Height of the timing plot and of the words about a miss."""

MOST_LANES: Final = 0.6
"""Share of the height of their tab that lanes of effects take at most."""

EFFECT_PLOTS: Final = 4
"""Plots of effects, one per unit; more would be too flat to read."""

LANES_IN_VIEW: Final = 5
"""Lanes beside the picture, the numbers included: at 40 points each, more would be cut off. All are in the next tab."""


IN_LEGEND: Final = frozenset({Outcome.MISSED, Outcome.INVENTED, Outcome.BOTH, Outcome.HELD})
"""Outcomes that the legend of the pair in focus names; for more there is no room."""


@dataclass(frozen=True)
class Subject:
    """Entities and words of one audited detector; ``headline`` says what it missed.

    Parameters
    ----------
    lanes : paths of its lanes and the pair's column each speaks of, numbers (``None``) first.
    longest : column of the pair of the longest cut that was missed, ``None`` without a miss.
    words : root of its lists: of misses, of clusters where they are ``many``, of the worst, words on the current one.
    missed : root of pins and flags, and of the eye of the close-up.
    faces : its red faces below each body.
    """

    label: str
    headline: str
    lanes: Mapping[str, int | None]
    longest: int | None
    words: str
    many: bool
    missed: str
    faces: str

    @property
    def camera(self) -> str:
        """Entity whose pose is the close-up of the current miss, ``""`` when nothing was missed."""
        return "" if self.longest is None else f"{self.missed}/eye"


def lanes_in_view(subject: Subject, noisy: bool = False) -> list[str]:
    """The numbers, the worst pairs, and the pair of the longest cut, on which the cursor stands first.

    ``noisy``: below each pair what tracker noise leaves of its contacts; there is room for half as many pairs then.
    """
    lanes, room = list(subject.lanes), 1 + (LANES_IN_VIEW - 1) // (1 + noisy)
    worst = [lane for lane in lanes[room:] if subject.lanes[lane] == subject.longest]
    chosen = [*lanes[: room - len(worst)], *worst]
    return [path for lane in chosen for path in (lane, noise_lane(lane))[: 1 + (noisy and lane != lanes[0])]]


@dataclass(frozen=True)
class BlueprintInput:
    """What is laid out.

    Parameters
    ----------
    eye : of the overview.
    costs : label -> what the detector took.
    detector_lanes : whether there are lanes per detector.
    watched : audited detectors that are shown at their work.
    overview : lanes of the screen of all detectors, ``None`` without a moment to show.
    solids : label -> entities of the solids in place of the meshes.
    hiding : bodies that stand before what a close-up shows: translucent there.
    start, end : seconds of the time axes; left alone, the viewer shows one minute around the cursor.
    """

    result: RunResult
    subjects: Sequence[Subject]
    eye: Eye
    costs: Mapping[str, Cost]
    detector_lanes: bool
    start: float
    end: float
    watched: Sequence[WatchedRun] = ()
    overview: OverviewLanes | None = None
    solids: Mapping[str, Sequence[str]] = field(default_factory=dict)
    hiding: Collection[str] = ()

    @property
    def hidden(self) -> list[str]:
        """Rules that keep out of a view what would hide what it stands on: contact normals and bounding spheres."""
        spheres = [sphere_path(body, run.label) for run in self.watched for body in self.result.assembly.names]
        normals = [f"{contacts_path(label)}/normals" for label in self.costs]
        solids = [path for paths in self.solids.values() for path in paths]
        return [f"- /{path}" for path in [*normals, *spheres, *solids, f"{SPACE}/**"]]


def build_blueprint(layout: BlueprintInput) -> rrb.Blueprint:
    """The blueprint that is embedded in the recording; it opens on the tab that answers what was asked for."""
    result = layout.result
    names = ["Audit", *(f"Audit: {subject.label}" for subject in layout.subjects[1:])]
    tabs = [_audit(layout, *one) for one in zip(layout.subjects, names, strict=False)] or [_plain(layout)]
    for k, run in enumerate(layout.watched):
        name = f"Pipeline: {run.label}" if k else "Pipeline"
        tabs.append(pipeline_tab(result, run, _eye_controls(layout.eye), _whole(layout), name))
    first = 0
    if layout.overview is not None:
        tabs.insert(0, _overview(layout, layout.overview))
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
        tabs.append(rrb.Horizontal(state_view("detectors", words, _whole(layout)), name="Detectors"))
    if (lanes := finding_lanes(result)) is not None:
        tabs.append(finding_tab(lanes, _whole(layout)))
    times = rrb.TimePanel(timeline=SESSION, state="collapsed", playback_speed=0.25, play_state="paused")
    hidden = rrb.SelectionPanel(state="hidden"), rrb.BlueprintPanel(state="hidden")
    return rrb.Blueprint(rrb.Tabs(*tabs, active_tab=first), times, *hidden, auto_views=False, auto_layout=False)


def _audit(layout: BlueprintInput, subject: Subject, name: str) -> Any:
    lanes = lanes_in_view(subject, layout.result.noise is not None)
    where = f"Where: red dots are contacts missed by {subject.label}"
    space = spatial(where, _contents(layout, subject, f"/{subject.missed}/eye"), _eye_controls(layout.eye))
    lane_share = RULER_POINTS + LANE_POINTS * max(2, len(lanes))
    shares = [LOW_POINTS - lane_share - BOTTOM_POINTS, lane_share, BOTTOM_POINTS]
    beside = [_close_up(layout, subject)] if subject.camera else []
    widths = [0.42, 0.26, 0.32] if beside else [0.66, 0.34]
    pictures = rrb.Horizontal(space, *beside, _words(subject), column_shares=widths)
    rows = [pictures, _lanes(layout, subject, lanes)]
    note = rrb.TextDocumentView(origin=f"/{subject.words}/nearest_miss", name="The miss in the close-up")
    bottom = [
        *([timing_view(layout.costs, _whole(layout))] if any_timed(layout.costs) else []),
        *([note] if subject.camera else []),
    ]
    if bottom:
        rows.append(rrb.Horizontal(*bottom, column_shares=[0.7, 0.3][: len(bottom)]))
    return rrb.Vertical(*rows, row_shares=shares[: len(rows)], name=name)


def _overview(layout: BlueprintInput, lanes: OverviewLanes) -> Any:
    normals = [f"- /{contacts_path(label)}/normals" for label in layout.costs]
    spheres = [f"- /{sphere_path(body, run.label)}" for run in layout.watched for body in layout.result.assembly.names]
    own = [f"- /{one.missed}/**" for one in layout.subjects]
    contents = ["/world/**", *normals, *spheres, *own]
    times = timing_view(layout.costs, _whole(layout), short=True)
    there = {code for one in layout.result.comparisons.values() for code in np.flatnonzero(one.counts).tolist()}
    faded, legend = faded_meshes(layout.result, layout.hiding), lane_legend(there & IN_LEGEND)
    eye, wires = _eye_controls(layout.eye), [*layout.solids]
    return overview_tab(lanes, contents, eye, faded, legend, _whole(layout), times, wires)


def _words(subject: Subject) -> Any:
    clusters = [text_list(f"{subject.words}/clusters", subject.headline)] if subject.many else []
    listed = text_list(f"{subject.words}/missed", "All" if subject.many else subject.headline)
    worst = rrb.TextDocumentView(origin=f"/{subject.words}/longest_cuts", name="Longest cuts")
    return rrb.Tabs(*clusters, listed, worst, _report(), active_tab=0)


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
    hidden = (f"/{subject.missed}/{part}" for part in ("pins", "numbers", "flag/**"))
    controls = rrb.EyeControls3D(tracking_entity=f"/{subject.camera}")
    contents, faded = _contents(layout, subject, *hidden), faded_meshes(layout.result, layout.hiding)
    return spatial("Close-up: the miss nearest to the cursor", contents, controls, overrides=faded)


def _eye_controls(eye: Eye) -> rrb.EyeControls3D:
    return rrb.EyeControls3D(
        kind=rrb.Eye3DKind.Orbital, position=eye.position, look_target=eye.target, eye_up=(0.0, 1.0, 0.0)
    )


def _lanes(layout: BlueprintInput, subject: Subject, lanes: Sequence[str]) -> Any:
    there = np.flatnonzero(layout.result.comparisons[subject.label].counts).tolist()
    name = f"When and which pair    {lane_legend(there, subject.label)}"
    root = lanes[0].rpartition("/")[0]
    whole = state_view(root, name, _whole(layout), lanes)
    if len(lanes) < 2:
        return whole
    start, end = (rr.TimeRangeBoundary.cursor_relative(seconds=sign * AROUND) for sign in (-1, 1))
    around = rrb.TimeAxis(view_range=rr.TimeRange(start=start, end=end))
    near = state_view(root, f"{AROUND} s around the cursor", around, lanes[1:])
    return rrb.Horizontal(whole, near, column_shares=[0.7, 0.3])


def _whole(layout: BlueprintInput) -> rrb.TimeAxis:
    """The whole session, from side to side; zooming stays possible."""
    start, end = (rr.TimeRangeBoundary.absolute(seconds=at) for at in (layout.start, layout.end))
    return rrb.TimeAxis(view_range=rr.TimeRange(start=start, end=end))


def _plain(layout: BlueprintInput) -> Any:
    """Without anything to compare: the session, and what the one detector found."""
    return rrb.Horizontal(_room(layout), _report(), column_shares=[0.7, 0.3], name="Session")


def _room(layout: BlueprintInput) -> Any:
    name = layout.result.session.scene.name or "Session"
    return spatial(name, ["/world/**", *layout.hidden], _eye_controls(layout.eye))


def _costs(layout: BlueprintInput, name: str) -> list[Any]:
    """The tab of times; none in a run without a detector."""
    if not layout.costs:
        return []
    table = rrb.TextDocumentView(origin="/tradeoff/table", name="What each detector costs")
    stages = {label: [stage_path(label, stage) for stage in cost.stages] for label, cost in layout.costs.items()}
    title = "{}: ms per frame by stage"
    plots = [plot(_whole(layout), "/timing", title.format(label), paths) for label, paths in stages.items() if paths]
    beside = [rrb.Vertical(*plots)] if plots else []
    return [rrb.Horizontal(*beside, table, column_shares=[0.62, 0.38] if plots else [1.0], name=name)]


def _happened(layout: BlueprintInput, views: EffectViews, doing: Sequence[str]) -> Any:
    """What happened in the room, what people did there (lanes of ``doing``), when, and in numbers."""
    rows: list[Any] = []
    plots = list(views.plots.items())[:EFFECT_PLOTS]
    shares = [LOW_POINTS / max(1, len(plots))] * len(plots)
    if lanes := [*doing, *(lane for lane in views.lanes if not lane.endswith(f"/{SKIPPED}"))]:
        # As high as its lanes, or the lower ones would be cut off; what is left is for the plots.
        high = min(RULER_POINTS + LANE_POINTS * len(lanes), MOST_LANES * LOW_POINTS)
        shares = [high, *((LOW_POINTS - high) / len(plots) for _ in plots)]
        rows.append(state_view("", "When: what people did, and what the effects found", _whole(layout), lanes))
    rows += [plot(_whole(layout), "/effects", axis, paths) for axis, paths in plots]
    answer = rrb.TextDocumentView(origin=f"/{HAPPENED}", name="Answer: what happened")
    listed = [text_list(views.events[0], views.headline, *views.events[1:])] if views.events else []
    left = rrb.Vertical(answer, _room(layout), *listed, row_shares=[0.2, 0.56, 0.24][: 2 + len(listed)])
    beside = [rrb.Vertical(*rows, row_shares=shares)] if rows else []
    return rrb.Horizontal(left, *beside, name=tab_name(layout.result.effects) if layout.result.effects else "Tasks")
