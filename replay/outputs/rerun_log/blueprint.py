"""The layout, tab by tab, as the screen shows it: titles that say something, nothing on screen that is not data."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from rerun.blueprint.encodings import TextLogColumn, TimelineColumn

from replay.outputs.camera import Eye
from replay.outputs.moments import FocusMoment
from replay.outputs.palette import BACKGROUND, tags_of
from replay.outputs.rerun_log import flat_plots
from replay.outputs.rerun_log.effects import HAPPENED, effect_views, tab_name
from replay.outputs.rerun_log.lanes import pair_lanes, session_lanes
from replay.outputs.rerun_log.moment_views import (
    ANSWER,
    EYE,
    MOMENTS,
    PINS,
    SPACE,
    CloseUp,
    details_path,
    solid_path,
    with_solids,
)
from replay.outputs.rerun_log.pipeline import moment_words, pipeline_path
from replay.outputs.rerun_log.recording_file import FRAME, SESSION, drawable, entity
from replay.outputs.rerun_log.scene import body_path
from replay.outputs.rerun_log.texts import ACCURACY, SESSION_TEXT
from replay.outputs.rerun_log.timing import BUDGET_LINE, budget_share, ceiling, total_ms, total_path
from replay.outputs.watched_run import ALL, BOXES, WatchedRun
from replay.outputs.words import lane_legend
from replay.pipeline.run_result import RunResult

LANE_POINTS: Final = 40
RULER_POINTS: Final = 64
"""Heights of a lane, and of title and ruler together, in points: the viewer does not let us choose."""

LOW_POINTS: Final = 704
"""Height the tabs share on a screen of 800 lines: shares are relative, so what is whole there is whole on all."""

MOST_LANES: Final = 0.32
"""Share of the height of their tab that lanes of effects take at most."""

EFFECT_PLOTS: Final = 3
"""Plots of effects, one per unit; more would be too narrow to read."""

PLOTS: Final = 0.22
"""Share of the height of their tab that plots of effects take."""

AROUND_MOMENT: Final = 0.5
"""Seconds before and after the worked moment in which steps can be read; over a minute they are a carpet."""


PLAIN: Final = rrb.Background(color=BACKGROUND[:3], kind=rrb.BackgroundKind.SolidColor)


@dataclass(frozen=True, eq=False)
class Picture:
    """What is laid out and sent."""

    result: RunResult
    eye: Eye  # of the room
    views: Mapping[FocusMoment, CloseUp]  # all moments in order of time, and how each is shown
    order: Sequence[str]  # compared detectors, the worst first
    lanes: Sequence[str]  # lanes of the reference and of the worst detectors
    watched: Sequence[WatchedRun]  # detectors that are shown at their work

    @cached_property
    def happened(self) -> bool:
        """Whether there is a tab on what happened."""
        return bool(self.result.effects or session_lanes(self.result))

    @cached_property
    def whole(self) -> rrb.TimeAxis:
        """The whole session; left alone, the viewer shows one minute around the cursor."""
        times = self.result.assembly.motion.times
        start, last = (float(times[0]), float(times[-1])) if len(times) else (0.0, 1.0)
        return seconds_between(start, last)

    @cached_property
    def without_solids(self) -> list[str]:
        """Rules that keep solids out of a view, and what belongs to the moment in focus."""
        bodies = self.result.assembly.names
        solids = [solid_path(body, label) for label in with_solids(self.result) for body in bodies]
        return [f"- /{path}" for path in [*solids, f"{SPACE}/**"]]

    @cached_property
    def high(self) -> float:
        """Milliseconds at which the plot of times of all detectors is cut."""
        return ceiling([total_ms(detection) for detection in self.result.detections.values()])


def build_blueprint(picture: Picture) -> rrb.Blueprint:
    """The blueprint that is embedded in the recording; its first tab is what was asked for."""
    tabs: list[Any] = []
    first = 0
    if picture.order:
        tabs.append(_answer(picture))
    if picture.watched:
        tabs.append(_one_or_tabs([_pipeline(picture, run) for run in picture.watched], "Pipeline"))
    if picture.order:
        first = 0 if picture.result.tradeoff is None else len(tabs)
        tabs.append(_accuracy(picture))
    if picture.happened:
        tabs.append(_happened(picture))
    if not picture.order:
        tabs.append(_session(picture))
    details = [
        _details(picture, label) for label in [*picture.order, *(set(picture.result.detections) - {*picture.order})]
    ]
    if details:
        tabs.append(rrb.Tabs(*details, name="Details", active_tab=0))
    return whole_layout(tabs, first)


def _one_or_tabs(parts: Sequence[Any], name: str) -> Any:
    if len(parts) > 1:
        return rrb.Tabs(*parts, name=name, active_tab=0)
    parts[0].name = name
    return parts[0]


def _answer(picture: Picture) -> Any:
    """What is wrong, the worst moment, where it is; when, and all other moments."""
    result = picture.result
    legend = "blue: right   yellow: false contact   red: missed or late   grey: contact"
    lanes = [*picture.lanes, *session_lanes(result)][:4]
    below = [state_view(f"When   {legend}", picture.whole, lanes)]
    room = spatial("Where", _without(picture, EYE, f"{SPACE}/measure"), picture.eye)
    top, widths = [text_view(ANSWER, "The answer"), room], [0.5, 0.5]
    if picture.views:
        top.insert(1, _close_up(picture))
        widths = [0.43, 0.33, 0.24]
        below.append(text_list(MOMENTS, "Moments: click a time"))
    high = (RULER_POINTS + LANE_POINTS * max(3, len(lanes))) / LOW_POINTS
    rows = [rrb.Horizontal(*top, column_shares=widths), rrb.Horizontal(*below, column_shares=[0.6, 0.4][: len(below)])]
    return rrb.Vertical(*rows, row_shares=[1.0 - high, high], name="Answer")


def _close_up(picture: Picture) -> Any:
    return spatial("Close-up: the nearest moment", _without(picture, PINS), EYE)


def _without(picture: Picture, *parts: str) -> list[str]:
    """The room without these entities, and without a headset, which stands before the bench."""
    result = picture.result
    headsets = [name for name in result.assembly.names if "headset" in tags_of(name, result.session.scene)]
    return ["/world/**", *(f"- /{path}" for path in [*(f"{body_path(name)}/**" for name in headsets), *parts])]


def _pipeline(picture: Picture, run: WatchedRun) -> Any:
    """Volumes of the pair, one look of the search, the frame in numbers; below both over time, and other moments."""
    root, top = pipeline_path(run.label), ceiling([total_ms(run.detection)])
    axis, stages = rrb.ScalarAxis(range=(0.0, top)), entity("timing", run.label, "stages")
    title = f"Time per frame by stage, ms, added up   cut at {top:.2f}: 99.9 % of frames"
    times = plot(picture.whole, "/", title, [f"{stages}/**", f"{root}/mark/**"], axis_y=axis)
    pairs = int(run.counts[ALL].max(initial=0))
    if not run.moments:
        counts = plot(picture.whole, f"/{root}/pairs", f"Pairs left after each stage, of {pairs}")
        return rrb.Vertical(counts, times, name=run.label)
    at = float(run.motion.times[run.worked.frame])
    shapes = "1 spheres (grey), 2 boxes (blue)" if BOXES in run.counts else "1 spheres (grey)"
    bodies = f"/{root}/bodies/**"
    near = spatial(f"At {at:.3f} s   {shapes}", [bodies, f"/{root}/near/eye"], f"{root}/near/eye", f"/{root}")
    name = f"{moment_words(run, run.worked)}   dots: faces of ants   white: best pair"
    contents = [bodies, *_no_volumes(picture, root), f"/{root}/search/**"]
    search = spatial(name, contents, f"{root}/search/eye", f"/{root}")
    frame = text_view(f"{root}/frame", "This frame: pairs left, and the price")
    around = seconds_between(max(0.0, at - AROUND_MOMENT), at + AROUND_MOMENT)
    left = plot(around, f"/{root}/pairs", f"Pairs left, of {pairs}, half a second around {at:.3f} s")
    listed = text_list(f"{root}/moments", "Other moments: click a time")
    return rrb.Vertical(
        rrb.Horizontal(near, search, frame, column_shares=[0.31, 0.40, 0.29]),
        rrb.Horizontal(left, times, listed, column_shares=[0.29, 0.38, 0.33]),
        row_shares=[0.68, 0.32],
        name=run.label,
    )


def _no_volumes(picture: Picture, root: str) -> list[str]:
    bodies = [f"{root}/bodies/{entity(name)}" for name in picture.result.assembly.names]
    return [f"- /{body}/{part}" for body in bodies for part in ("sphere", "box")]


def _accuracy(picture: Picture) -> Any:
    """Both scatters over one axis of cost, what they mean, and the time of every frame."""
    bounds = rrb.VisualBounds2D(x_range=flat_plots.WIDE, y_range=flat_plots.HIGH)
    plots = rrb.Spatial2DView(
        origin=f"/{flat_plots.ACCURACY}", name="Accuracy against cost: one dot a detector", visual_bounds=bounds,
        background=PLAIN,
    )  # fmt: skip
    share = budget_share(picture.high)
    title = f"Time per frame, ms   cut at {picture.high:.2f}: 99.9 % of the slowest detector's frames"
    axis = rrb.ScalarAxis(range=(0.0, max(picture.high, 1.0001 * share)))
    paths = [*(total_path(label) for label in picture.result.detections), BUDGET_LINE]
    times = plot(picture.whole, "/timing", title, paths, axis_y=axis)
    text = text_view(ACCURACY, "What it means")
    right = rrb.Vertical(text, times, row_shares=[0.32, 0.68])
    return rrb.Horizontal(plots, right, column_shares=[0.5, 0.5], name="Accuracy against cost")


def _happened(picture: Picture) -> Any:
    """What happened in the room, what people did there, when, and in numbers."""
    result = picture.result
    found = effect_views(result.effects)
    words = [text_view(HAPPENED, "What happened")]
    if found.events:
        words.append(text_list(found.events[0], "Events: click a time", *found.events[1:]))
    top = [_room(picture), rrb.Vertical(*words, row_shares=[0.4, 0.6][: len(words)])]
    rows = [rrb.Horizontal(*top, column_shares=[0.36, 0.28])]
    shares = [1.0]
    if lanes := [*found.lanes, *session_lanes(result)]:
        rows.append(state_view("When: what the effects found, and what people did", picture.whole, lanes))
        shares.append(min(MOST_LANES, (RULER_POINTS + LANE_POINTS * len(lanes)) / LOW_POINTS))
    if found.plots:
        plots = [*found.plots.items()][:EFFECT_PLOTS]
        rows.append(rrb.Horizontal(*[plot(picture.whole, "/effects", unit, paths) for unit, paths in plots]))
        shares.append(PLOTS)
    shares[0] -= sum(shares[1:])
    name = tab_name(result.effects) if result.effects else "Tasks"
    return rrb.Vertical(*rows, row_shares=shares, name=name)


def _room(picture: Picture) -> Any:
    """The room without contacts and misses: what happened is no matter of detectors."""
    red = [f"- /{body_path(name)}/missed_faces" for name in picture.result.assembly.names]
    contents = ["/world/**", "- /world/contacts/**", *red, *picture.without_solids]
    return spatial(picture.result.session.scene.name or "Session", contents, picture.eye)


def _session(picture: Picture) -> Any:
    """Without anything to compare: the session, and what was replayed."""
    contents = ["/world/**", *picture.without_solids]
    room = spatial(picture.result.session.scene.name or "Session", contents, picture.eye)
    text = text_view(SESSION_TEXT, "What was replayed")
    return rrb.Horizontal(room, text, column_shares=[0.7, 0.3], name="Session")


def _details(picture: Picture, label: str) -> Any:
    """What is wrong with one detector, its moments, its lanes pair by pair, its times by stage and its counters."""
    result, root = picture.result, details_path(label)
    paths = [*pair_lanes(result, label)]
    title = f"What {label} said of each pair"
    if label in result.comparisons:
        there = np.flatnonzero(result.comparisons[label].by_pair.sum(axis=0)).tolist()
        title = f"Pair by pair    {lane_legend(there, label)}"
    text = text_view(f"{root}/text", "Settings, and what each stage takes")
    top, widths = [text], [1.0]
    if any(one.label == label for one in picture.views):
        top += [_close_up(picture), text_list(f"{root}/moments", f"All moments of {label}: click a time")]
        widths = [0.3, 0.36, 0.34]
    stages = plot(picture.whole, f"/{entity('timing', label, 'stages')}", "Time per frame by stage, ms, added up")
    counters = plot(picture.whole, f"/{entity('counters', label)}", "Work per frame")
    when = [state_view(title, picture.whole, paths)] if paths else []
    below = rrb.Horizontal(*when, rrb.Tabs(stages, counters, active_tab=0), column_shares=[0.6, 0.4][-1 - len(when) :])
    return rrb.Vertical(rrb.Horizontal(*top, column_shares=widths), below, row_shares=[0.6, 0.4], name=label)


def whole_layout(tabs: Sequence[Any], first: int = 0) -> rrb.Blueprint:
    """All tabs, the first to be seen by its number; nothing else is on screen, and nothing moves."""
    times = rrb.TimePanel(timeline=SESSION, state="collapsed", playback_speed=0.25, play_state="paused")
    hidden = rrb.SelectionPanel(state="hidden"), rrb.BlueprintPanel(state="hidden")
    return rrb.Blueprint(rrb.Tabs(*tabs, active_tab=first), times, *hidden, auto_views=False, auto_layout=False)


def seconds_between(start: float, end: float) -> rrb.TimeAxis:
    """These seconds, from side to side; zooming stays possible."""
    ends = (rr.TimeRangeBoundary.absolute(seconds=at) for at in (start, end))
    return rrb.TimeAxis(view_range=rr.TimeRange(*ends))


def spatial(name: str, contents: Sequence[str], eye: Eye | str, origin: str = "/world") -> Any:
    """A room, dark and without a grid; ``eye``: where it is seen from first, or the entity that the view follows."""
    controls = rrb.EyeControls3D(tracking_entity=f"/{eye}") if isinstance(eye, str) else _orbit(eye)
    return rrb.Spatial3DView(
        origin=origin, contents=list(contents), name=drawable(name), eye_controls=controls, background=PLAIN,
        line_grid=rrb.LineGrid3D(visible=False),
    )  # fmt: skip


def _orbit(eye: Eye) -> rrb.EyeControls3D:
    return rrb.EyeControls3D(
        kind=rrb.Eye3DKind.Orbital, position=eye.position, look_target=eye.target, eye_up=(0.0, 1.0, 0.0)
    )


def text_view(path: str, name: str) -> Any:
    """One text."""
    return rrb.TextDocumentView(origin=f"/{path}", name=drawable(name))


def text_list(path: str, name: str, *more: str) -> Any:
    """Lines of which a click moves the cursor, of one entity or of several."""
    times = [TimelineColumn(SESSION), TimelineColumn(FRAME, visible=False)]
    columns = rrb.TextLogColumns(timeline_columns=times, text_log_columns=[TextLogColumn("body")])
    one_width = rrb.TextLogFormat(monospace_body=True)
    contents = [f"/{one}" for one in (path, *more)]
    return rrb.TextLogView(
        origin=f"/{path}", contents=contents, name=drawable(name), columns=columns, format_options=one_width
    )


def plot(axis: rrb.TimeAxis, origin: str, name: str, paths: Iterable[str] = (), **more: Any) -> Any:
    """Curves over time: of these entities, or of all below the origin."""
    contents = [f"/{path}" for path in paths] or "$origin/**"
    legend = rrb.PlotLegend(rrb.Corner2D.RightTop)
    return rrb.TimeSeriesView(
        origin=origin, name=drawable(name), axis_x=axis, plot_legend=legend, contents=contents, **more
    )


def state_view(name: str, times: rrb.TimeAxis, lanes: Iterable[str]) -> Any:
    """A view of these lanes."""
    contents = [f"/{lane}" for lane in lanes]
    return rrb.StateTimelineView(origin="/", contents=contents, name=drawable(name), time_view=times)
