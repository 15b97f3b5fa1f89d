"""The layout: one tab per question, titles that are headlines, nothing on screen that is not data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import rerun as rr
import rerun.blueprint as rrb
from rerun.blueprint.encodings import TextLogColumn, TimelineColumn

from replay.outputs.palette import BACKGROUND
from replay.outputs.words import LANE_LEGEND
from replay.rerun_log.camera import Eye
from replay.rerun_log.columns import FRAME, SESSION
from replay.rerun_log.effects import EffectViews
from replay.rerun_log.findings import finding_tab
from replay.rerun_log.subject import Subject, lanes_in_view
from replay.rerun_log.tradeoff import curve_tab
from replay.tradeoff.clocks import BUDGET_MS

AROUND: Final = 0.6
"""Seconds before and after the cursor in the lanes beside the close-up."""

LANE_POINTS: Final = 40
RULER_POINTS: Final = 64
"""Heights of a lane, and of title and ruler together, in points: the viewer does not let us choose."""

BOTTOM_POINTS: Final = 200
"""Height of the timing plot and of the words about a miss."""

BUDGET_SHOWN: Final = 0.25
"""Share of the budget from which its line is in the plot of the audit."""

EFFECT_PLOTS: Final = 5
"""Plots of effects, one per unit; more would be too flat to read."""

SCREEN_POINTS: Final = 980
"""Height the tabs share on a 1080-line screen."""


@dataclass(frozen=True)
class Layout:
    """What the layout needs to know of a recording."""

    title: str
    eye: Eye
    subjects: tuple[Subject, ...]
    totals: tuple[str, ...]
    """Timing entities of the totals of detectors that were timed frame by frame."""
    stages: Mapping[str, tuple[str, ...]]
    """Label -> timing entities of its stages."""
    arrows: tuple[str, ...]
    """Entities of the contact normals: in the recording, but not in the views, where they hide what they stand on."""
    detector_lanes: bool
    finding_lanes: tuple[str, ...] | None
    """Lanes of poses in doubt; without any the findings are a list only; ``None``: the session was not examined."""
    slowest_ms: float
    """Milliseconds of the slowest look of all detectors."""
    start: float
    end: float
    """Seconds at which the time axes start and end; left alone, the viewer shows one minute around the cursor."""
    effects: EffectViews | None = None
    tradeoff: bool = False
    """Whether the curve is in the recording."""


def build_blueprint(layout: Layout) -> rrb.Blueprint:
    """The blueprint that is embedded in the recording; it opens on the tab that answers what was asked for."""
    tabs: list[Any] = []
    for number, subject in enumerate(layout.subjects):
        tabs.append(_audit(layout, subject, "Audit" if number == 0 else f"Audit: {subject.label}"))
    if not tabs:
        tabs.append(_plain(layout))
    first = 0
    if layout.tradeoff:
        first = len(tabs)
        tabs.append(curve_tab())
    tabs.append(_costs(layout, "Time per frame" if layout.tradeoff else "What accuracy costs"))
    if layout.effects is not None:
        first = first if layout.subjects or layout.tradeoff else len(tabs)
        tabs.append(_effects(layout, layout.effects))
    if layout.detector_lanes:
        tabs.append(_detectors(layout))
    if layout.finding_lanes is not None:
        tabs.append(finding_tab(layout.finding_lanes, _whole(layout)))
    return rrb.Blueprint(
        rrb.Tabs(*tabs, active_tab=first),
        rrb.TimePanel(timeline=SESSION, state="collapsed", playback_speed=0.25, play_state="paused"),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="hidden"),
        auto_views=False,
        auto_layout=False,
    )


def _audit(layout: Layout, subject: Subject, name: str) -> Any:
    lanes = lanes_in_view(subject)
    lane_share = RULER_POINTS + LANE_POINTS * max(2, len(lanes))
    shares = [max(300, SCREEN_POINTS - lane_share - BOTTOM_POINTS), lane_share, BOTTOM_POINTS]
    beside = [_close_up(layout, subject)] if subject.camera else []
    pictures = rrb.Horizontal(
        _space(layout, subject),
        *beside,
        _words(subject),
        column_shares=[0.42, 0.26, 0.32] if beside else [0.66, 0.34],
    )
    rows = [pictures, _lanes(layout, subject, lanes)]
    bottom = [*([_timing(layout)] if layout.totals else []), *([_note(subject)] if subject.camera else [])]
    if bottom:
        rows.append(rrb.Horizontal(*bottom, column_shares=[0.7, 0.3][: len(bottom)]))
    return rrb.Vertical(*rows, row_shares=shares[: len(rows)], name=name)


def _words(subject: Subject) -> Any:
    lists = [_list(subject.listing, "All" if subject.clusters else subject.headline)]
    if subject.clusters:
        lists.insert(0, _list(subject.clusters, subject.headline))
    worst = rrb.TextDocumentView(origin=f"/{subject.worst}", name="Longest cuts")
    report = rrb.TextDocumentView(origin="/report", contents=["/report"], name="Report")
    return rrb.Tabs(*lists, worst, report, active_tab=0)


def _list(path: str, name: str) -> Any:
    return rrb.TextLogView(
        origin=f"/{path}",
        name=name,
        columns=rrb.TextLogColumns(
            timeline_columns=[TimelineColumn(SESSION), TimelineColumn(FRAME, visible=False)],
            text_log_columns=[TextLogColumn("body")],
        ),
        format_options=rrb.TextLogFormat(monospace_body=True),
    )


def _note(subject: Subject) -> Any:
    return rrb.TextDocumentView(origin=f"/{subject.note}", name="The miss in the close-up")


def _contents(layout: Layout, subject: Subject, *hidden: str) -> list[str]:
    """Everything in space but arrows, what is ``hidden``, and what belongs to another audited detector."""
    others = [one for one in layout.subjects if one is not subject]
    foreign = [f"/{one.missed}/**" for one in others] + [f"/{path}" for one in others for path in one.face_entities]
    arrows = [f"/{path}" for path in layout.arrows]
    return ["/world/**", *(f"- {path}" for path in [*arrows, *hidden, *foreign])]


def _space(layout: Layout, subject: Subject) -> Any:
    contents = _contents(layout, subject, f"/{subject.missed}/eye")
    return rrb.Spatial3DView(
        origin="/world",
        contents=contents,
        name=f"Where: red dots are contacts missed by {subject.label}",
        eye_controls=_eye_controls(layout.eye),
        background=rrb.Background(color=BACKGROUND[:3], kind=rrb.BackgroundKind.SolidColor),
        line_grid=rrb.LineGrid3D(visible=False),
    )


def _close_up(layout: Layout, subject: Subject) -> Any:
    return rrb.Spatial3DView(
        origin="/world",
        contents=_contents(layout, subject, *(f"/{subject.missed}/{part}" for part in ("pins", "numbers", "flag/**"))),
        name="Close-up: the miss nearest to the cursor",
        eye_controls=rrb.EyeControls3D(tracking_entity=f"/{subject.camera}"),
        background=rrb.Background(color=BACKGROUND[:3], kind=rrb.BackgroundKind.SolidColor),
        line_grid=rrb.LineGrid3D(visible=False),
    )


def _eye_controls(eye: Eye) -> rrb.EyeControls3D:
    return rrb.EyeControls3D(
        kind=rrb.Eye3DKind.Orbital, position=eye.position, look_target=eye.target, eye_up=(0.0, 1.0, 0.0)
    )


def _lanes(layout: Layout, subject: Subject, lanes: Sequence[str]) -> Any:
    root = lanes[0].rpartition("/")[0]
    name = f"When and which pair    {LANE_LEGEND.format(subject.label)}"
    whole = rrb.StateTimelineView(
        origin=f"/{root}", contents=[f"/{lane}" for lane in lanes], name=name, time_view=_whole(layout)
    )
    if len(lanes) < 2:
        return whole
    near = rrb.StateTimelineView(
        origin=f"/{root}",
        contents=[f"/{lane}" for lane in lanes[1:]],
        name=f"{AROUND} s around the cursor",
        time_view=rrb.TimeAxis(view_range=_around()),
    )
    return rrb.Horizontal(whole, near, column_shares=[0.7, 0.3])


def _whole(layout: Layout) -> rrb.TimeAxis:
    """The whole session, from side to side; zooming stays possible."""
    ends = (rr.TimeRangeBoundary.absolute(seconds=layout.start), rr.TimeRangeBoundary.absolute(seconds=layout.end))
    return rrb.TimeAxis(view_range=rr.TimeRange(start=ends[0], end=ends[1]))


def _around() -> rr.TimeRange:
    return rr.TimeRange(
        start=rr.TimeRangeBoundary.cursor_relative(seconds=-AROUND),
        end=rr.TimeRangeBoundary.cursor_relative(seconds=AROUND),
    )


def _timing(layout: Layout) -> Any:
    # A budget far above everything would press the curves to the floor: then the title says how far.
    share = layout.slowest_ms / BUDGET_MS
    budget = ["/timing/budget"] if share > BUDGET_SHOWN else []
    worst = f"worst {layout.slowest_ms:.2f}: {share:.0%} of a frame at 90 Hz ({BUDGET_MS:.1f} ms)"
    return rrb.TimeSeriesView(
        origin="/timing",
        contents=[*budget, *(f"/{path}" for path in layout.totals)],
        name=f"Time per frame, ms    {worst}",
        axis_y=rrb.ScalarAxis(range=(0.0, 1.15 * max(layout.slowest_ms, BUDGET_MS if budget else 0.0))),
        axis_x=_whole(layout),
        plot_legend=rrb.PlotLegend(rrb.Corner2D.LeftTop),
    )


def _plain(layout: Layout) -> Any:
    """Without anything to compare: the session, and what the one detector found."""
    report = rrb.TextDocumentView(origin="/report", contents=["/report"], name="Report")
    return rrb.Horizontal(_room(layout), report, column_shares=[0.7, 0.3], name="Session")


def _room(layout: Layout) -> Any:
    return rrb.Spatial3DView(
        origin="/world",
        contents=["/world/**", *(f"- /{path}" for path in layout.arrows)],
        name=layout.title,
        eye_controls=_eye_controls(layout.eye),
        background=rrb.Background(color=BACKGROUND[:3], kind=rrb.BackgroundKind.SolidColor),
        line_grid=rrb.LineGrid3D(visible=False),
    )


def _costs(layout: Layout, name: str) -> Any:
    table = rrb.TextDocumentView(origin="/tradeoff/table", name="What each detector costs")
    plots = [
        rrb.TimeSeriesView(
            origin="/timing",
            contents=[f"/{path}" for path in paths],
            name=f"{label}: ms per frame by stage",
            axis_x=_whole(layout),
            plot_legend=rrb.PlotLegend(rrb.Corner2D.LeftTop),
        )
        for label, paths in layout.stages.items()
        if paths
    ]
    beside = [rrb.Vertical(*plots)] if plots else []
    return rrb.Horizontal(*beside, table, column_shares=[0.62, 0.38] if plots else [1.0], name=name)


def _effects(layout: Layout, views: EffectViews) -> Any:
    """What happened in the room, when, and in numbers."""
    rows: list[Any] = []
    plots = list(views.plots.items())[:EFFECT_PLOTS]
    shares = [SCREEN_POINTS / max(1, len(plots))] * len(plots)
    if views.lanes:
        # As high as its lanes, or the lower ones would be cut off; what is left is for the plots.
        high = min(RULER_POINTS + LANE_POINTS * len(views.lanes), SCREEN_POINTS // 2)
        shares = [high, *((SCREEN_POINTS - high) / len(plots) for _ in plots)]
        lanes = [f"/{path}" for path in views.lanes]
        rows.append(rrb.StateTimelineView(origin="/effects", contents=lanes, name="When", time_view=_whole(layout)))
    for unit, paths in plots:
        rows.append(
            rrb.TimeSeriesView(
                origin="/effects",
                contents=[f"/{path}" for path in paths],
                name=unit or "numbers",
                axis_x=_whole(layout),
                plot_legend=rrb.PlotLegend(rrb.Corner2D.LeftTop),
            )
        )
    words = rrb.TextLogView(origin="/effects", contents=[f"/{path}" for path in views.events], name="What happened")
    left = rrb.Vertical(_room(layout), words, row_shares=[0.68, 0.32])
    return rrb.Horizontal(left, *([rrb.Vertical(*rows, row_shares=shares)] if rows else []), name="Effects")


def _detectors(layout: Layout) -> Any:
    words = "What each detector said of each pair (no colour: CLEAR)"
    lanes = rrb.StateTimelineView(origin="/detectors", name=words, time_view=_whole(layout))
    return rrb.Horizontal(lanes, name="Detectors")
