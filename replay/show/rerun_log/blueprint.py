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

from cdcore.bounding.bounding_sphere import Sphere
from replay import words
from replay.document.run_result import RunResult
from replay.show.camera import Eye
from replay.show.palette import BACKGROUND, fault_key, tags_of
from replay.show.rerun_log import timing
from replay.show.rerun_log.close_up import EYE_ENTITY, FOCUS_ENTITY, LEGEND_ENTITY, PINS_ENTITY
from replay.show.rerun_log.depth import DEPTH_ENTITY, deepest_pairs, depth_title
from replay.show.rerun_log.documents import ACCURACY_ENTITY, ANSWER_ENTITY, SESSION_ENTITY, details_path
from replay.show.rerun_log.effects import EVENTS_ENTITY, effect_lanes, effect_plots, event_paths
from replay.show.rerun_log.lanes import pair_lanes, session_lanes
from replay.show.rerun_log.moments import LISTS_ENTITY, FrameTime, Moments, list_path
from replay.show.rerun_log.pipeline_view import ALL, BOXES, SearchRun, pipeline_path, search_title
from replay.show.rerun_log.recording_file import SESSION_TIMELINE, drawable, entity
from replay.show.rerun_log.scene import body_path
from replay.show.words import LANES_LEGEND, lane_legend

LANE_POINTS: Final = 40
RULER_POINTS: Final = 64
"""Heights of a lane, and of title and ruler together, in points: the viewer does not let us choose."""

LOW_POINTS: Final = 704
"""Height the tabs share on a screen of 800 lines: shares are relative, so what is whole there is whole on all."""

MOST_LANES: Final = 4
"""Lanes of the answer at most."""

MOST_HEIGHT: Final = 0.32
"""Share of the height of their tab that lanes of effects take at most."""

MOST_EFFECT_PLOTS: Final = 3
PLOTS_HEIGHT: Final = 0.22
"""Plots of effects, one per unit, more would be too narrow to read; and their share of the height of their tab."""

MOMENT_MARGIN_S: Final = 0.5
"""Seconds before and after the worked moment in which steps can be read; over a minute they are a carpet."""

PLAIN_BACKGROUND: Final = rrb.Background(color=BACKGROUND[:3], kind=rrb.BackgroundKind.SolidColor)
STAGES_TITLE: Final = "Time per frame by stage, ms, added up"


@dataclass(frozen=True, eq=False)
class Picture:
    """Inputs of the layout."""

    result: RunResult
    answer_eye: Eye  # of the room
    effects_eye: Eye
    balls: Sequence[Sphere]  # around each body of the assembly
    moments: Moments  # in order of time
    eyes: Mapping[FrameTime, Eye]  # of the close-up of each moment
    order: Sequence[str]  # compared detectors, the worst first
    lanes: Sequence[str]  # lanes of the reference and of the worst detectors
    searches: Sequence[SearchRun]  # detectors that are shown at their work

    @cached_property
    def activity_lanes(self) -> Sequence[str]:
        """Lanes of what people did."""
        return [*session_lanes(self.result)]

    @cached_property
    def session_axis(self) -> rrb.TimeAxis:
        """The whole session; left alone, the viewer shows one minute around the cursor."""
        motion_times = self.result.assembly.motion.times
        return _time_axis(*((float(motion_times[0]), float(motion_times[-1])) if len(motion_times) else (0.0, 1.0)))

    @property
    def title(self) -> str:
        """Name of the scene."""
        return self.result.session.scene.name or "Session"

    def room(self, *excluded_entities: str, contents: Sequence[str] = ("/world/**",)) -> list[str]:
        """The room without these entities, and without a headset, which stands before the bench."""
        assembly, scene = self.result.assembly, self.result.session.scene
        headset_paths = [f"{body_path(name)}/**" for name in assembly.names if "headset" in tags_of(name, scene)]
        return [*contents, *(f"- /{path}" for path in [*headset_paths, *excluded_entities])]


def build_blueprint(picture: Picture) -> rrb.Blueprint:
    """The blueprint that is embedded in the recording; its first tab is what was asked for."""
    result, first_tab, tabs = picture.result, 0, []
    if picture.order:
        tabs.append(_answer_tab(picture))
    if picture.searches:
        pipeline_tabs = [_pipeline_tab(picture, run) for run in picture.searches]
        tabs.append(rrb.Tabs(*pipeline_tabs, name="Pipeline", active_tab=0) if pipeline_tabs[1:] else pipeline_tabs[0])
    if picture.order:
        first_tab = 0 if result.tradeoff is None else len(tabs)
        tabs.append(_accuracy_tab(picture))
    if result.effects or picture.activity_lanes:
        tabs.append(_effects_tab(picture))
    if not picture.order:
        tabs.append(_session_tab(picture))
    if result.detections:
        detail_tabs = [_details_tab(picture, label) for label in dict.fromkeys([*picture.order, *result.detections])]
        tabs.append(rrb.Tabs(*detail_tabs, name="Details", active_tab=0))
    time_panel = rrb.TimePanel(timeline=SESSION_TIMELINE, state="collapsed", playback_speed=0.25, play_state="paused")
    hidden_panels = rrb.SelectionPanel(state="hidden"), rrb.BlueprintPanel(state="hidden")
    return rrb.Blueprint(
        rrb.Tabs(*tabs, active_tab=first_tab), time_panel, *hidden_panels, auto_views=False, auto_layout=False
    )


def _answer_tab(picture: Picture) -> Any:
    """Tab of the answer: text, close-up of the worst moment, room, lanes and list of moments."""
    lanes = [*picture.lanes, *picture.activity_lanes][:MOST_LANES]
    room_title = "Where   a dot: a fault, in the colours of When"
    room_view = _spatial_view(
        room_title, picture.room(EYE_ENTITY, f"{FOCUS_ENTITY}/lines", f"{LEGEND_ENTITY}/**"), picture.answer_eye
    )
    title = "Moments: click a time; --miss and --false take the numbers"
    moments = _list_view([f"{LISTS_ENTITY}/**"] if picture.moments else [], title)
    height = height_of_lanes(max(3, len(lanes)))
    close_up = _close_up_view(picture, bool(picture.moments))
    return _column(
        (
            _row((_text_view(ANSWER_ENTITY, "The answer"), 0.43), (close_up, 0.33), (room_view, 0.24)),
            1 - height,
        ),
        (_row((_lanes_view(picture, f"When   {LANES_LEGEND}", lanes), 0.55), (moments, 0.45)), height),
        name="Answer",
    )


def _pipeline_tab(picture: Picture, run: SearchRun) -> Any:
    """Volumes of the pair, one look of the search, the frame in numbers; below both over time, and other moments."""
    tab_name = run.label if len(picture.searches) > 1 else "Pipeline"
    pipeline_root, cut_ms = pipeline_path(run.label), timing.plot_cut_ms([timing.total_ms(run.detection)])
    pairs, axis = int(run.counts[ALL].max(initial=0)), rrb.ScalarAxis(range=(0.0, cut_ms))
    title = f"{STAGES_TITLE}   cut at {words.decimal(cut_ms, 2)}: 99.9 % of frames"
    stage_times_view = _plot_view(picture.session_axis, timing.stages_path(run.label), title, axis_y=axis)
    if not run.searches:
        pair_counts_view = _plot_view(
            picture.session_axis, f"{pipeline_root}/pairs", f"Pairs left after each stage, of {pairs}"
        )
        return rrb.Vertical(pair_counts_view, stage_times_view, name=tab_name)
    worked_second = float(run.motion.times[run.worked_search.frame])
    shapes_title = "1 spheres (grey), 2 boxes (blue)" if BOXES in run.counts else "1 spheres (grey)"
    bodies = [pipeline_path(run.label, "bodies", body) for body in picture.result.assembly.names]
    volumes = [f"- /{body}/{volume}" for body in bodies for volume in ("sphere", "box")]
    volumes_view = _spatial_view(
        f"At {words.moment(worked_second)}   {shapes_title}",
        [f"/{pipeline_root}/bodies/**", f"/{pipeline_root}/near/eye"],
        f"{pipeline_root}/near/eye",
        pipeline_root,
    )
    search_view_title = f"{search_title(run, run.worked_search)}   dots: faces of ants   white: best pair"
    contents = [f"/{pipeline_root}/bodies/**", f"/{pipeline_root}/search/**", *volumes]
    search = _spatial_view(search_view_title, contents, f"{pipeline_root}/search/eye", pipeline_root)
    frame = _text_view(f"{pipeline_root}/frame", "This frame: pairs left, and the price")
    near_axis = _time_axis(max(0.0, worked_second - MOMENT_MARGIN_S), worked_second + MOMENT_MARGIN_S)
    left_plot = _plot_view(
        near_axis,
        f"{pipeline_root}/pairs",
        f"Pairs left, of {pairs}, half a second around {words.moment(worked_second)}",
    )
    moments = _list_view([f"{pipeline_root}/moments"], "Other moments: click a time")
    return _column(
        (_row((volumes_view, 0.31), (search, 0.40), (frame, 0.29)), 0.68),
        (_row((left_plot, 0.29), (stage_times_view, 0.38), (moments, 0.33)), 0.32),
        name=tab_name,
    )


def _accuracy_tab(picture: Picture) -> Any:
    """Losses over costs, what they mean, and the time of every frame."""
    tab_name = "Accuracy against cost"
    scatter_bounds = rrb.VisualBounds2D(x_range=timing.X_RANGE, y_range=timing.Y_RANGE)
    scatter_view = rrb.Spatial2DView(
        origin=f"/{timing.SCATTER_ENTITY}",
        name=f"{tab_name}: one dot a detector",
        visual_bounds=scatter_bounds,
        background=PLAIN_BACKGROUND,
    )
    detections = picture.result.detections
    upper = timing.plot_cut_ms([timing.total_ms(detection) for detection in detections.values()])
    title = f"Time per frame, ms   cut at {words.decimal(upper, 2)}: 99.9 % of the slowest detector's frames"
    axis = rrb.ScalarAxis(range=(0.0, max(upper, 1.0001 * timing.budget_fraction(upper))))
    paths = [*(timing.total_path(label) for label in detections), timing.BUDGET_ENTITY]
    frame_times_view = _plot_view(picture.session_axis, "timing", title, paths, axis_y=axis)
    right_column = _column((_text_view(ACCURACY_ENTITY, "Meaning"), 0.32), (frame_times_view, 0.68))
    return _row((scatter_view, 0.5), (right_column, 0.5), name=tab_name)


def _effects_tab(picture: Picture) -> Any:
    """Tab of effects: room, events, lanes and plots, independent of detectors."""
    result, effects = picture.result, picture.result.effects
    bodies = [f"/{body_path(name)}/{leaf}" for name in result.assembly.names for leaf in ("mesh", "liquid")]
    room_view = _spatial_view(picture.title, picture.room(contents=["/world/effects/**", *bodies]), picture.effects_eye)
    text_column = _column(
        (_text_view(EVENTS_ENTITY, "What happened"), 0.4),
        (_list_view(event_paths(effects), "Events: click a time"), 0.6),
    )
    lanes = [*effect_lanes(effects), *picture.activity_lanes]
    lanes_view = _lanes_view(picture, "When: what the effects found, and what people did", lanes)
    plot_views = [
        _plot_view(picture.session_axis, "effects", unit, paths)
        for unit, paths in effect_plots(effects)[:MOST_EFFECT_PLOTS]
    ]
    lanes_height, plots_height = min(MOST_HEIGHT, height_of_lanes(len(lanes))), PLOTS_HEIGHT if plot_views else 0.0
    return _column(
        (_row((room_view, 0.36), (text_column, 0.28)), 1.0 - lanes_height - plots_height),
        (lanes_view, lanes_height),
        (rrb.Horizontal(*plot_views) if plot_views else None, plots_height),
        name="Effects" if effects else "Tasks",
    )


def _session_tab(picture: Picture) -> Any:
    """Without anything to compare: the session, and what was replayed."""
    room_view = _spatial_view(picture.title, picture.room(), picture.effects_eye)
    return _row((room_view, 0.7), (_text_view(SESSION_ENTITY, "The session"), 0.3), name="Session")


def _details_tab(picture: Picture, label: str) -> Any:
    """Tab of one detector: errors, moments, lanes pair by pair, times by stage and counters."""
    result = picture.result
    title = f"What {label} said of each pair"
    if label in result.comparisons:
        present_outcomes = np.flatnonzero(result.comparisons[label].by_pair.sum(axis=0)).tolist()
        has_late = any(fault_key(miss.kind) == "late" for miss in result.misses[label])
        title = f"Pair by pair    {lane_legend(present_outcomes, label, has_late=has_late)}"
    has_faults = bool(result.misses.get(label) or result.false.get(label))
    moments_list = _list_view([list_path(label)] if has_faults else [], f"All moments of {label}: click a time")
    settings_view = _text_view(details_path(label), "Settings, and what each stage takes")
    stages = _plot_view(picture.session_axis, timing.stages_path(label), STAGES_TITLE)
    counter_view = _plot_view(
        picture.session_axis, entity("counters", label), "Work per frame: how often each step ran"
    )
    plot_views = [stages, counter_view]
    if deepest_pairs(result):
        plot_views.append(_plot_view(picture.session_axis, DEPTH_ENTITY, depth_title(result)))
    return _column(
        (_row((settings_view, 0.3), (_close_up_view(picture, has_faults), 0.36), (moments_list, 0.34)), 0.6),
        (
            _row(
                (_lanes_view(picture, title, [*pair_lanes(result, label)]), 0.6),
                (rrb.Tabs(*plot_views, active_tab=len(plot_views) - 1 if label == result.oracle else 0), 0.4),
            ),
            0.4,
        ),
        name=label,
    )


def _close_up_view(picture: Picture, has_moments: bool) -> Any:
    if not has_moments:
        return None
    answers = picture.result.answers
    moment = answers[0].moment if answers else None
    worst = ""
    if moment is not None:
        worst = f". Worst: {answers[0].label} {moment.kind} {moment.number}, {words.moment(moment.seconds)}"
    return _spatial_view(f"Close-up nearest the cursor{worst}", picture.room(PINS_ENTITY), EYE_ENTITY)


def height_of_lanes(lanes: int) -> float:
    """Share of the height of a tab that so many lanes need; none needs nothing."""
    return (RULER_POINTS + LANE_POINTS * lanes) / LOW_POINTS if lanes else 0.0


def _row(*sized_views: tuple[Any, float], name: str | None = None) -> Any:
    """Views side by side with their shares of the width; ``None`` is no view."""
    views, fractions = zip(*((view, fraction) for view, fraction in sized_views if view is not None), strict=True)
    return rrb.Horizontal(*views, column_shares=fractions, name=name)


def _column(*sized_views: tuple[Any, float], name: str | None = None) -> Any:
    """Views one below the other with their shares of the height; ``None`` is no view."""
    views, fractions = zip(*((view, fraction) for view, fraction in sized_views if view is not None), strict=True)
    return rrb.Vertical(*views, row_shares=fractions, name=name)


def _time_axis(start: float, end: float) -> rrb.TimeAxis:
    """These seconds, from side to side; zooming stays possible."""
    range_boundaries = (rr.TimeRangeBoundary.absolute(seconds=boundary_second) for boundary_second in (start, end))
    return rrb.TimeAxis(view_range=rr.TimeRange(*range_boundaries))


def _spatial_view(name: str, contents: Sequence[str], eye: Eye | str, origin: str = "world") -> Any:
    """A room, dark and without a grid; ``eye``: where it is seen from first, or the entity that the view follows."""
    if isinstance(eye, str):
        controls = rrb.EyeControls3D(tracking_entity=f"/{eye}")
    else:
        controls = rrb.EyeControls3D(
            kind=rrb.Eye3DKind.Orbital, position=eye.position, look_target=eye.target, eye_up=(0.0, 1.0, 0.0)
        )
    return rrb.Spatial3DView(
        origin=f"/{origin}",
        contents=contents,
        name=drawable(name),
        eye_controls=controls,
        background=PLAIN_BACKGROUND,
        line_grid=rrb.LineGrid3D(visible=False),
    )


def _text_view(path: str, name: str) -> Any:
    return rrb.TextDocumentView(origin=f"/{path}", name=drawable(name))


def _list_view(paths: Sequence[str], name: str) -> Any:
    """Lines of entities of which a click moves the cursor; of none no view."""
    times, text_columns = [TimelineColumn(SESSION_TIMELINE)], [TextLogColumn("body")]
    columns = rrb.TextLogColumns(timeline_columns=times, text_log_columns=text_columns)
    contents, line_format = [f"/{path}" for path in paths], rrb.TextLogFormat(monospace_body=True)
    view = rrb.TextLogView(contents=contents, name=drawable(name), columns=columns, format_options=line_format)
    return view if paths else None


def _plot_view(axis: rrb.TimeAxis, origin: str, name: str, paths: Iterable[str] = (), **more: Any) -> Any:
    """Curves over time: of these entities, or of all below the origin."""
    contents = [f"/{path}" for path in paths] or "$origin/**"
    legend = rrb.PlotLegend(rrb.Corner2D.RightTop)
    return rrb.TimeSeriesView(
        origin=f"/{origin}", name=drawable(name), axis_x=axis, plot_legend=legend, contents=contents, **more
    )


def _lanes_view(picture: Picture, name: str, lanes: Sequence[str]) -> Any:
    """Lanes over the whole session; of none no view."""
    contents = [f"/{lane}" for lane in lanes]
    view = rrb.StateTimelineView(origin="/", contents=contents, name=drawable(name), time_view=picture.session_axis)
    return view if lanes else None
