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
from replay.outputs.rerun_log import timing
from replay.outputs.rerun_log.effects import HAPPENED, effect_lanes, effect_plots, event_paths, tab_name
from replay.outputs.rerun_log.lanes import pair_lanes, session_lanes
from replay.outputs.rerun_log.moment_views import ANSWER, EYE, MOMENTS, PINS, SPACE, CloseUp, details_path
from replay.outputs.rerun_log.pipeline import moment_words, pipeline_path
from replay.outputs.rerun_log.recording_file import FRAME, SESSION, drawable, entity
from replay.outputs.rerun_log.scene import body_path
from replay.outputs.rerun_log.texts import ACCURACY, SESSION_TEXT
from replay.outputs.watched_run import ALL, BOXES, WatchedRun
from replay.outputs.words import lane_legend
from replay.pipeline.run_result import RunResult

LANE_POINTS: Final = 40
RULER_POINTS: Final = 64
"""Heights of a lane, and of title and ruler together, in points: the viewer does not let us choose."""

LOW_POINTS: Final = 704
"""Height the tabs share on a screen of 800 lines: shares are relative, so what is whole there is whole on all."""

MOST_LANES: Final = 4
"""Lanes of the answer at most."""

MOST_HEIGHT: Final = 0.32
"""Share of the height of their tab that lanes of effects take at most."""

EFFECT_PLOTS: Final = 3
PLOTS: Final = 0.22
"""Plots of effects, one per unit, more would be too narrow to read; and their share of the height of their tab."""

AROUND_MOMENT: Final = 0.5
"""Seconds before and after the worked moment in which steps can be read; over a minute they are a carpet."""

LEGEND: Final = "blue: right   yellow: false contact   red: missed or late   grey: contact"
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
    def doing(self) -> Sequence[str]:
        """Lanes of what people did."""
        return [*session_lanes(self.result)]

    @cached_property
    def whole(self) -> rrb.TimeAxis:
        """The whole session; left alone, the viewer shows one minute around the cursor."""
        times = self.result.assembly.motion.times
        return _seconds(*((float(times[0]), float(times[-1])) if len(times) else (0.0, 1.0)))


def build_blueprint(picture: Picture) -> rrb.Blueprint:
    """The blueprint that is embedded in the recording; its first tab is what was asked for."""
    result, first = picture.result, 0
    tabs = [_answer(picture)] if picture.order else []
    if picture.watched:
        tabs.append(_one_or_tabs([_pipeline(picture, run) for run in picture.watched], "Pipeline"))
    if picture.order:
        first = 0 if result.tradeoff is None else len(tabs)
        tabs.append(_accuracy(picture))
    if result.effects or picture.doing:
        tabs.append(_happened(picture))
    if not picture.order:
        tabs.append(_session(picture))
    if result.detections:
        details = [_details(picture, label) for label in dict.fromkeys([*picture.order, *result.detections])]
        tabs.append(rrb.Tabs(*details, name="Details", active_tab=0))
    times = rrb.TimePanel(timeline=SESSION, state="collapsed", playback_speed=0.25, play_state="paused")
    hidden = rrb.SelectionPanel(state="hidden"), rrb.BlueprintPanel(state="hidden")
    return rrb.Blueprint(rrb.Tabs(*tabs, active_tab=first), times, *hidden, auto_views=False, auto_layout=False)


def _one_or_tabs(parts: Sequence[Any], name: str) -> Any:
    if len(parts) > 1:
        return rrb.Tabs(*parts, name=name, active_tab=0)
    parts[0].name = name
    return parts[0]


def _answer(picture: Picture) -> Any:
    """What is wrong, the worst moment, where it is; when, and all other moments."""
    lanes = [*picture.lanes, *picture.doing][:MOST_LANES]
    high = _height(max(3, len(lanes)))
    room = _spatial("Where", _room(picture, EYE, f"{SPACE}/lines"), picture.eye)
    top = _row((_text(ANSWER, "The answer"), 0.43), (_close_up(picture, picture.views), 0.33), (room, 0.24))
    moments = _list([MOMENTS] if picture.views else [], "Moments: click a time")
    below = _row((_states(picture, f"When   {LEGEND}", lanes), 0.6), (moments, 0.4))
    return _column((top, 1.0 - high), (below, high), name="Answer")


def _pipeline(picture: Picture, run: WatchedRun) -> Any:
    """Volumes of the pair, one look of the search, the frame in numbers; below both over time, and other moments."""
    root, top = pipeline_path(run.label), timing.ceiling([timing.total_ms(run.detection)])
    pairs, axis = int(run.counts[ALL].max(initial=0)), rrb.ScalarAxis(range=(0.0, top))
    title = f"Time per frame by stage, ms, added up   cut at {top:.2f}: 99.9 % of frames"
    times = _plot(picture.whole, f"/{entity('timing', run.label, 'stages')}", title, axis_y=axis)
    if not run.moments:
        counts = _plot(picture.whole, f"/{root}/pairs", f"Pairs left after each stage, of {pairs}")
        return rrb.Vertical(counts, times, name=run.label)
    at = float(run.motion.times[run.worked.frame])
    shapes = "1 spheres (grey), 2 boxes (blue)" if BOXES in run.counts else "1 spheres (grey)"
    near = _spatial(
        f"At {at:.3f} s   {shapes}", [f"/{root}/bodies/**", f"/{root}/near/eye"], f"{root}/near/eye", f"/{root}"
    )
    bodies = [pipeline_path(run.label, "bodies", name) for name in picture.result.assembly.names]
    volumes = [f"- /{body}/{volume}" for body in bodies for volume in ("sphere", "box")]
    name = f"{moment_words(run, run.worked)}   dots: faces of ants   white: best pair"
    search = _spatial(name, [f"/{root}/bodies/**", f"/{root}/search/**", *volumes], f"{root}/search/eye", f"/{root}")
    frame = _text(f"{root}/frame", "This frame: pairs left, and the price")
    around = _seconds(max(0.0, at - AROUND_MOMENT), at + AROUND_MOMENT)
    left = _plot(around, f"/{root}/pairs", f"Pairs left, of {pairs}, half a second around {at:.3f} s")
    moments = _list([f"{root}/moments"], "Other moments: click a time")
    return _column(
        (_row((near, 0.31), (search, 0.40), (frame, 0.29)), 0.68),
        (_row((left, 0.29), (times, 0.38), (moments, 0.33)), 0.32),
        name=run.label,
    )


def _accuracy(picture: Picture) -> Any:
    """Both scatters over one axis of cost, what they mean, and the time of every frame."""
    bounds = rrb.VisualBounds2D(x_range=timing.WIDE, y_range=timing.HIGH)
    name = "Accuracy against cost: one dot a detector"
    dots = rrb.Spatial2DView(origin=f"/{timing.SCATTERS}", name=name, visual_bounds=bounds, background=PLAIN)
    detections = picture.result.detections
    high = timing.ceiling([timing.total_ms(detection) for detection in detections.values()])
    title = f"Time per frame, ms   cut at {high:.2f}: 99.9 % of the slowest detector's frames"
    axis = rrb.ScalarAxis(range=(0.0, max(high, 1.0001 * timing.budget_share(high))))
    paths = [*(timing.total_path(label) for label in detections), timing.BUDGET_LINE]
    times = _plot(picture.whole, "/timing", title, paths, axis_y=axis)
    right = _column((_text(ACCURACY, "What it means"), 0.32), (times, 0.68))
    return _row((dots, 0.5), (right, 0.5), name="Accuracy against cost")


def _happened(picture: Picture) -> Any:
    """What happened in the room, what people did there, when, and in numbers: no matter of detectors."""
    result, effects = picture.result, picture.result.effects
    bodies = [f"/{body_path(name)}/{part}" for name in result.assembly.names for part in ("mesh", "liquid")]
    room = _spatial(_name(result), ["/world/effects/**", *bodies], picture.eye)
    events = _list(event_paths(effects), "Events: click a time")
    words = _column((_text(HAPPENED, "What happened"), 0.4), (events, 0.6))
    lanes = [*effect_lanes(effects), *picture.doing]
    when = _states(picture, "When: what the effects found, and what people did", lanes)
    plots = [_plot(picture.whole, "/effects", unit, paths) for unit, paths in effect_plots(effects)[:EFFECT_PLOTS]]
    high, low = min(MOST_HEIGHT, _height(len(lanes))), PLOTS if plots else 0.0
    return _column(
        (_row((room, 0.36), (words, 0.28)), 1.0 - high - low),
        (when, high),
        (rrb.Horizontal(*plots) if plots else None, low),
        name=tab_name(effects) if effects else "Tasks",
    )


def _session(picture: Picture) -> Any:
    """Without anything to compare: the session, and what was replayed."""
    room = _spatial(_name(picture.result), ["/world/**"], picture.eye)
    return _row((room, 0.7), (_text(SESSION_TEXT, "What was replayed"), 0.3), name="Session")


def _details(picture: Picture, label: str) -> Any:
    """What is wrong with one detector, its moments, its lanes pair by pair, its times by stage and its counters."""
    result = picture.result
    title = f"What {label} said of each pair"
    if label in result.comparisons:
        there = np.flatnonzero(result.comparisons[label].by_pair.sum(axis=0)).tolist()
        title = f"Pair by pair    {lane_legend(there, label)}"
    moments = [moment for moment in picture.views if moment.label == label]
    listed = _list([details_path(label, "moments")] if moments else [], f"All moments of {label}: click a time")
    text = _text(details_path(label, "text"), "Settings, and what each stage takes")
    stages = _plot(picture.whole, f"/{entity('timing', label, 'stages')}", "Time per frame by stage, ms, added up")
    counters = _plot(picture.whole, f"/{entity('counters', label)}", "Work per frame")
    when, costs = _states(picture, title, [*pair_lanes(result, label)]), rrb.Tabs(stages, counters, active_tab=0)
    top = _row((text, 0.3), (_close_up(picture, moments), 0.36), (listed, 0.34))
    return _column((top, 0.6), (_row((when, 0.6), (costs, 0.4)), 0.4), name=label)


def _close_up(picture: Picture, moments: Iterable[FocusMoment]) -> Any:
    return _spatial("Close-up: the nearest moment", _room(picture, PINS), EYE) if [*moments] else None


def _room(picture: Picture, *without: str) -> list[str]:
    """The room without these entities, and without a headset, which stands before the bench."""
    assembly, scene = picture.result.assembly, picture.result.session.scene
    headsets = [f"{body_path(name)}/**" for name in assembly.names if "headset" in tags_of(name, scene)]
    return ["/world/**", *(f"- /{path}" for path in [*headsets, *without])]


def _name(result: RunResult) -> str:
    return result.session.scene.name or "Session"


def _height(lanes: int) -> float:
    """Share of the height of a tab that so many lanes need; none needs nothing."""
    return (RULER_POINTS + LANE_POINTS * lanes) / LOW_POINTS if lanes else 0.0


def _row(*parts: tuple[Any, float], name: str | None = None) -> Any:
    """Views side by side with their shares of the width; ``None`` is no view."""
    views, shares = zip(*((view, share) for view, share in parts if view is not None), strict=True)
    return rrb.Horizontal(*views, column_shares=shares, name=name)


def _column(*parts: tuple[Any, float], name: str | None = None) -> Any:
    """Views one below the other with their shares of the height; ``None`` is no view."""
    views, shares = zip(*((view, share) for view, share in parts if view is not None), strict=True)
    return rrb.Vertical(*views, row_shares=shares, name=name)


def _seconds(start: float, end: float) -> rrb.TimeAxis:
    """These seconds, from side to side; zooming stays possible."""
    ends = (rr.TimeRangeBoundary.absolute(seconds=at) for at in (start, end))
    return rrb.TimeAxis(view_range=rr.TimeRange(*ends))


def _spatial(name: str, contents: Sequence[str], eye: Eye | str, origin: str = "/world") -> Any:
    """A room, dark and without a grid; ``eye``: where it is seen from first, or the entity that the view follows."""
    controls = rrb.EyeControls3D(tracking_entity=f"/{eye}") if isinstance(eye, str) else _orbit(eye)
    return rrb.Spatial3DView(
        origin=origin, contents=contents, name=drawable(name), eye_controls=controls, background=PLAIN,
        line_grid=rrb.LineGrid3D(visible=False),
    )  # fmt: skip


def _orbit(eye: Eye) -> rrb.EyeControls3D:
    return rrb.EyeControls3D(
        kind=rrb.Eye3DKind.Orbital, position=eye.position, look_target=eye.target, eye_up=(0.0, 1.0, 0.0)
    )


def _text(path: str, name: str) -> Any:
    return rrb.TextDocumentView(origin=f"/{path}", name=drawable(name))


def _list(paths: Sequence[str], name: str) -> Any:
    """Lines of entities of which a click moves the cursor; of none no view."""
    times = [TimelineColumn(SESSION), TimelineColumn(FRAME, visible=False)]
    columns = rrb.TextLogColumns(timeline_columns=times, text_log_columns=[TextLogColumn("body")])
    contents, even = [f"/{path}" for path in paths], rrb.TextLogFormat(monospace_body=True)
    view = rrb.TextLogView(contents=contents, name=drawable(name), columns=columns, format_options=even)
    return view if paths else None


def _plot(axis: rrb.TimeAxis, origin: str, name: str, paths: Iterable[str] = (), **more: Any) -> Any:
    """Curves over time: of these entities, or of all below the origin."""
    contents = [f"/{path}" for path in paths] or "$origin/**"
    legend = rrb.PlotLegend(rrb.Corner2D.RightTop)
    return rrb.TimeSeriesView(
        origin=origin, name=drawable(name), axis_x=axis, plot_legend=legend, contents=contents, **more
    )


def _states(picture: Picture, name: str, lanes: Sequence[str]) -> Any:
    """Lanes over the whole session; of none no view."""
    contents = [f"/{lane}" for lane in lanes]
    view = rrb.StateTimelineView(origin="/", contents=contents, name=drawable(name), time_view=picture.whole)
    return view if lanes else None
