"""Effects in the picture: a plot per series, a lane per state, words per event, markers and liquids in the room."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from replay.base.shown import shown
from replay.effects.effect_summary import happened, leading
from replay.effects.effects_runner import SKIPPED, EffectRun
from replay.effects.output import QUANTITIES, EffectEvent, FloatArray, LaneSpan, Liquid, Series
from replay.effects.recorded import SCALARS
from replay.outputs.palette import SERIES, Rgba
from replay.outputs.rerun_log.lanes import lane_name, send_spans
from replay.outputs.rerun_log.moment_views import MomentPlace, log_moment_table
from replay.outputs.rerun_log.recording_file import RecordingWriter, entity, packed
from replay.outputs.rerun_log.scene import body_path
from replay.outputs.words import counted

ROOT: Final = "effects"
HAPPENED: Final = "happened"

SEEN_S: Final = 0.25
"""Seconds after an event at which the picture opens: in the frame of an end point the liquid is still colourless."""

MARKERS: Final = 100
"""Markers per effect at most, the first ones: more would hide the bench."""

MARKER_M: Final = 0.006
"""Radius of a marker."""

LEVEL_WORDS: Final = {"info": "INFO", "warning": "WARN", "error": "ERROR"}

UPRIGHT_XYZW: Final = (-np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5))
"""Turns a cylinder of Rerun, which stands along Z, so that it stands along the body's Y."""


@dataclass(frozen=True)
class EffectViews:
    """Entities of the effects' tab: quantity -> series of it, lanes, and words."""

    plots: Mapping[str, tuple[str, ...]]
    lanes: tuple[str, ...]
    events: tuple[str, ...]


def effect_views(effects: Mapping[str, EffectRun]) -> EffectViews:
    """What there is to lay out; what led to the result comes first."""
    plots: dict[str, tuple[str, ...]] = {}
    best = leading(effects)
    first = [kind for kind, event in happened(effects) if event is best]
    for kind in sorted(effects, key=lambda one: one not in first):
        for name, series in effects[kind].series.items():
            axis = QUANTITIES.get(series.unit, series.unit) or "numbers"
            plots[axis] = (*plots.get(axis, ()), _path(kind, *name.split("/")))
    events = tuple(_path(kind, "events") for kind, run in effects.items() if run.events)
    # How far a reaction went says less than what it did.
    plots = dict(sorted(plots.items(), key=lambda one: one[0] == QUANTITIES["mol"]))
    return EffectViews(plots, tuple(effect_lanes(effects)), events)


def effect_lanes(effects: Mapping[str, EffectRun]) -> dict[str, Sequence[LaneSpan]]:
    """Path -> its spans; what was left out by a trigger is a figure of the summary, not a lane."""
    found = [(name, kind, spans) for kind, run in effects.items() for name, spans in run.output.lanes.items()]
    named = [(name if name == kind else lane_name(name, kind), spans) for name, kind, spans in found if name != SKIPPED]
    return {lane_name(f"{number}_{name}"): spans for number, (name, spans) in enumerate(named, 1)}


def log_happened(writer: RecordingWriter, effects: Mapping[str, EffectRun], *, leads: bool) -> None:
    """Send what happened, its result first; where nothing is one, the last event: it is what the others led to.

    ``leads``: the picture opens at that event, a little later, when it can be seen.
    """
    found, last = happened(effects), leading(effects)
    if last is None:
        writer.markdown(HAPPENED, "## No effect found anything" if effects else "## What people did")
        return
    place = "the last of" if last is found[-1][1] else "one of"
    when = f"At {last.time:.1f} s, {place} {counted(len(found), 'event')}."
    writer.markdown(HAPPENED, f"# {last.text[:1].upper()}{last.text[1:]}\n\n{when}")
    if leads:
        ns = min(round((last.time + SEEN_S) * 1e9), int(writer.clock.ns[-1]))
        log_moment_table(writer, [MomentPlace("", "event", len(found), ns, True)])


def tab_name(effects: Mapping[str, EffectRun]) -> str:
    """What the tab is called: effects are declared, signals were recorded."""
    if SCALARS not in effects:
        return "Effects"
    return "Effects and signals" if len(effects) > 1 else "Signals"


def _path(kind: str, *parts: str) -> str:
    """Below ``effects/<kind>``: a series, ``lanes/<name>``, or ``events``. A slash in a series' name makes a folder."""
    return entity(ROOT, kind, *parts)


def log_effects(writer: RecordingWriter, effects: Mapping[str, EffectRun]) -> None:
    """Send everything of every effect of the plan; an effect that did not run has no entity."""
    number = 0
    for path, spans in effect_lanes(effects).items():
        _log_lane(writer, path, spans)
    for kind, run in effects.items():
        for name, series in run.series.items():
            _log_series(writer, _path(kind, *name.split("/")), name, series, number)
            number += 1
        _log_events(writer, _path(kind, "events"), run.events)
        _log_markers(writer, kind, run.events)
    for body, liquid in _drawn(effects).items():
        _log_liquid(writer, f"{body_path(body)}/liquid", liquid)


def _drawn(effects: Mapping[str, EffectRun]) -> dict[str, Liquid]:
    """One liquid per vessel: that of the effect that ran last, which knows most of it (its colour, what fell out)."""
    return {body: liquid for run in effects.values() for body, liquid in run.output.liquids.items()}


def _log_series(writer: RecordingWriter, path: str, title: str, series: Series, number: int) -> None:
    # Every sample: the mean of the samples under a pixel draws a slope from a value to the zero beside it.
    policy, colours = rr.components.AggregationPolicy.Off, packed([SERIES[number % len(SERIES)]])
    writer.static(path, rr.SeriesLines(names=title, colors=colours, aggregation_policy=policy))
    writer.session_rows(path, _ns(series.times), rr.Scalars.columns(scalars=series.values))


def _log_lane(writer: RecordingWriter, path: str, spans: Sequence[LaneSpan]) -> None:
    own = {span.word: span.rgba for span in spans}
    colours: list[tuple[str, Rgba]] = [
        (word, rgba or SERIES[k % len(SERIES)]) for k, (word, rgba) in enumerate(own.items())
    ]
    at = [(span.word, round(span.start * 1e9), round(span.end * 1e9)) for span in spans]
    send_spans(writer, path, at, colours)


def _log_events(writer: RecordingWriter, path: str, events: Sequence[EffectEvent]) -> None:
    if events:
        levels = [LEVEL_WORDS[event.level] for event in events]
        columns = rr.TextLog.columns(text=[shown(event.text) for event in events], level=levels)
        writer.session_rows(path, _ns(np.array([event.time for event in events])), columns)


def _log_markers(writer: RecordingWriter, kind: str, events: Sequence[EffectEvent]) -> None:
    """A dot with words from the event on, for every event with a place that somebody should mind."""
    shown = [(event.point, event) for event in events if event.point is not None and event.level != "info"]
    for number, (point, event) in enumerate(shown[:MARKERS], start=1):
        columns = rr.Points3D.columns(
            positions=[point], radii=[MARKER_M], labels=[event.text],
            colors=packed([SERIES[1] if event.level == "error" else SERIES[4]]),
        )  # fmt: skip
        writer.session_rows(entity("world", ROOT, kind, str(number)), _ns(np.array([event.time])), columns)


def _log_liquid(writer: RecordingWriter, path: str, liquid: Liquid) -> None:
    count, height = len(liquid.times), np.maximum(0.0, liquid.level - liquid.floor)
    centre = np.zeros((count, 3))
    centre[:, 1] = liquid.floor + height / 2
    colour = liquid.rgba.copy()
    colour[height <= 0.0, 3] = 0
    columns = rr.Cylinders3D.columns(
        lengths=np.maximum(height, 1e-6).astype(np.float32),
        radii=np.full(count, liquid.radius, dtype=np.float32),
        centers=centre.astype(np.float32),
        quaternions=np.tile(np.array(UPRIGHT_XYZW, dtype=np.float32), (count, 1)),
        colors=packed([(r, g, b, a) for r, g, b, a in colour.tolist()]),
        fill_mode=["Solid"] * count,
    )
    writer.session_rows(path, _ns(liquid.times), columns)


def _ns(times: FloatArray) -> NDArray[np.int64]:
    return np.round(times * 1e9).astype(np.int64)
