"""Effects in the picture: a plot per series, a lane per state, words per event, markers and liquids in the room."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
import rerun as rr
from numpy.typing import ArrayLike, NDArray

from replay import words
from replay.effects.effect_summary import events_in_order, leading_event
from replay.effects.effects_runner import SKIPPED_LANE, EffectRun
from replay.effects.output import QUANTITIES, EffectEvent, LaneSpan, Liquid
from replay.show.palette import SERIES_COLOURS, WHITE
from replay.show.rerun_log.lanes import in_series, lane_name, log_lane
from replay.show.rerun_log.moments import Bookmark, log_bookmarks
from replay.show.rerun_log.recording_file import RecordingWriter, entity, pack_colours
from replay.show.rerun_log.scene import body_path
from replay.words import plural, safe_text

EFFECTS_ENTITY: Final = "effects"
EVENTS_ENTITY: Final = "happened"

VISIBLE_S: Final = 0.25
"""Seconds after an event at which the picture opens: in the frame of an end point the liquid is still colourless."""

MOST_MARKERS: Final = 100
"""Markers per effect at most, the first ones: more would hide the bench."""

MARKER_RADIUS_M: Final = 0.006
"""Radius of a marker."""

LEVEL_COLOURS: Final = {"info": WHITE, "warning": SERIES_COLOURS[4], "error": SERIES_COLOURS[1]}

UPRIGHT_XYZW: Final = (-np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5))
"""Turns a cylinder of Rerun, which stands along Z, so that it stands along the body's Y."""

Effects = Mapping[str, EffectRun]


def effect_plots(effects: Effects) -> list[tuple[str, list[str]]]:
    """Quantity and the paths of its series; what led to the result comes first."""
    plots: dict[str, list[str]] = {}
    leading_result = leading_event(effects)
    leading_kinds = [kind for kind, event in events_in_order(effects) if event is leading_result]
    for kind in sorted(effects, key=lambda kind: kind not in leading_kinds):
        for name, series in effects[kind].series.items():
            axis = QUANTITIES.get(series.unit, series.unit) or "numbers"
            plots.setdefault(axis, []).append(_series_path(kind, name))
    # How far a reaction went says less than what it did.
    return sorted(plots.items(), key=lambda plot: plot[0] == QUANTITIES["mol"])


def event_paths(effects: Effects) -> list[str]:
    """Paths of the events of each effect that has some."""
    return [_events_path(kind) for kind, run in effects.items() if run.events]


def effect_lanes(effects: Effects) -> dict[str, Sequence[LaneSpan]]:
    """Path -> its spans; what was left out by a trigger is a figure of the summary, not a lane."""
    lanes: dict[str, Sequence[LaneSpan]] = {}
    for kind, run in effects.items():
        for name, spans in run.output.lanes.items():
            if name != SKIPPED_LANE:
                label = name if name == kind else lane_name(name, kind)
                lanes[lane_name(f"{len(lanes) + 1}_{label}")] = spans
    return lanes


def log_happened(writer: RecordingWriter, effects: Effects, *, is_leading: bool) -> None:
    """Send what happened, its result first; where nothing is one, the last event: it is what the others led to.

    ``is_leading``: the picture opens at that event, a little later, when it can be seen.
    """
    events, event = events_in_order(effects), leading_event(effects)
    if event is None:
        writer.markdown(EVENTS_ENTITY, "## No effect found anything" if effects else "## What people did")
        return
    position_text = "the last of" if event is events[-1][1] else "one of"
    moment_clause = f"At {words.moment(event.time)}, {position_text} {plural(len(events), 'event')}."
    writer.markdown(EVENTS_ENTITY, f"# {event.text[:1].upper()}{event.text[1:]}\n\n{moment_clause}")
    if is_leading:
        ns = min(round((event.time + VISIBLE_S) * 1e9), int(writer.clock.ns[-1]))
        log_bookmarks(writer, [Bookmark("", "event", len(events), ns, leads=True)])


def _series_path(kind: str, name: str) -> str:
    """A slash in a series' name makes a folder."""
    return entity(EFFECTS_ENTITY, kind, *name.split("/"))


def _events_path(kind: str) -> str:
    return entity(EFFECTS_ENTITY, kind, "events")


def log_effects(writer: RecordingWriter, effects: Effects) -> None:
    """Send everything of every effect of the plan; an effect that did not run has no entity."""
    for path, spans in effect_lanes(effects).items():
        lane_states = [(span.word, *_nanoseconds([span.start, span.end]).tolist()) for span in spans]
        log_lane(writer, path, lane_states, in_series({span.word: span.rgba for span in spans}))
    number = 0
    for kind, run in effects.items():
        for name, series in run.series.items():
            # Every sample: the mean of the samples under a pixel draws a slope from a value to the zero beside it.
            policy, colour = (
                rr.components.AggregationPolicy.Off,
                pack_colours([SERIES_COLOURS[number % len(SERIES_COLOURS)]]),
            )
            path, number = _series_path(kind, name), number + 1
            writer.static(path, rr.SeriesLines(names=name, colors=colour, aggregation_policy=policy))
            writer.session_rows(path, _nanoseconds(series.times), rr.Scalars.columns(scalars=series.values))
        lines = [(safe_text(event.text), event.level.upper(), LEVEL_COLOURS[event.level]) for event in run.events]
        writer.log_lines(_events_path(kind), _nanoseconds([event.time for event in run.events]), lines)
        _log_markers(writer, kind, run.events)
    # Of each vessel that of the effect that ran last, which knows most of it (its colour, what fell out).
    liquids = {body: liquid for run in effects.values() for body, liquid in run.output.liquids.items()}
    for body, liquid in liquids.items():
        _log_liquid(writer, f"{body_path(body)}/liquid", liquid)


def _log_markers(writer: RecordingWriter, kind: str, events: Sequence[EffectEvent]) -> None:
    """A dot with words from the event on, for every event with a place that somebody should mind."""
    marked_events = [event for event in events if event.point is not None and event.level != "info"]
    for number, event in enumerate(marked_events[:MOST_MARKERS], start=1):
        colours, position = pack_colours([LEVEL_COLOURS[event.level]]), np.array([event.point])
        columns = rr.Points3D.columns(positions=position, radii=[MARKER_RADIUS_M], labels=[event.text], colors=colours)
        writer.session_rows(entity("world", EFFECTS_ENTITY, kind, str(number)), _nanoseconds([event.time]), columns)


def _log_liquid(writer: RecordingWriter, path: str, liquid: Liquid) -> None:
    """A cylinder from the floor of a vessel to the level of the liquid; one without height is not seen."""
    time_count, height = len(liquid.times), np.maximum(0.0, liquid.level - liquid.floor)
    middle_heights = liquid.floor + height / 2
    colours = np.where((height > 0.0)[:, None], liquid.rgba, liquid.rgba * [1, 1, 1, 0])
    columns = rr.Cylinders3D.columns(
        lengths=np.maximum(height, 1e-6),
        radii=np.full(time_count, liquid.radius),
        centers=np.stack([0.0 * middle_heights, middle_heights, 0.0 * middle_heights], axis=1),
        quaternions=np.tile(UPRIGHT_XYZW, (time_count, 1)),
        colors=pack_colours(map(tuple, colours.tolist())),
        fill_mode=["Solid"] * time_count,
    )
    writer.session_rows(path, _nanoseconds(liquid.times), columns)


def _nanoseconds(times: ArrayLike) -> NDArray[np.int64]:
    return np.round(np.asarray(times) * 1e9).astype(np.int64)
