"""Cost of each detector: milliseconds of every frame by stage, its counters, and accuracy against cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import accumulate
from typing import Final

import numpy as np
import rerun as rr

from cdcore import Detection
from cdcore.numerics import FloatArray
from replay import words
from replay.document.cost import BUDGET_MS
from replay.show.accuracy import accuracy_plot
from replay.show.palette import BUDGET, FAINT, SERIES_COLOURS, TICKS, Rgba
from replay.show.plots import LETTER_WIDTH, Dot, Plot, Point
from replay.show.rerun_log.recording_file import RecordingWriter, entity, pack_colours
from sessions.model.constants import HEADSET_HZ

BUDGET_ENTITY: Final = "timing/budget"
CUT_PERCENTILE: Final = 99.9
"""A plot of times ends at what one frame in a thousand exceeds: one slow frame would press all curves to the floor."""

IDLE_S: Final = 1e-7
"""Seconds, in the mean, below which a stage had nothing to do and is not shown."""

STAGE_LABELS: Final[Mapping[str, str]] = {
    "volumes": "broad phase",
    "broad": "broad phase",
    "spheres": "broad phase",
    "boxes": "broad phase",
    "surfaces": "narrow phase",
    "meshes": "narrow phase",
    "rest": "other",
}
"""Stage as a detector calls it -> in words of the field; any other keeps its name."""

SCATTER_ENTITY: Final = "accuracy/plot"
UNITS_PER_PLOT_UNIT: Final = 1.3
"""Units of a view, one a pixel at 1,920 x 1,080, for one of a plot."""

SCATTER_SIZE: Final = (690.0, 680.0)
"""Of the plot of losses over costs, in its units."""

TEXT_RISE: Final = 30.0
"""How far words are moved up, in units of the view: the viewer centres them on their place and hangs them below."""

X_RANGE: Final = (-10.0, UNITS_PER_PLOT_UNIT * SCATTER_SIZE[0] + 10.0)
Y_RANGE: Final = (-40.0, UNITS_PER_PLOT_UNIT * SCATTER_SIZE[1] + 10.0)
"""Range of its view along both axes."""


def colour_of(detector_number: int) -> Rgba:
    """Colour of the n-th detector in every plot."""
    return SERIES_COLOURS[detector_number % len(SERIES_COLOURS)]


def stage_ms(detection: Detection) -> dict[str, FloatArray]:
    """Stage -> milliseconds of each frame, (T,); where the whole motion was asked at once, their mean."""
    frames, stages = len(detection.times), dict[str, FloatArray]()
    for name, stage_seconds in detection.seconds.items():
        if np.sum(stage_seconds) > IDLE_S * frames:
            stage_name = STAGE_LABELS.get(name, name)
            stage_milliseconds = 1e3 * (
                stage_seconds
                if isinstance(stage_seconds, np.ndarray)
                else np.full(frames, stage_seconds / max(1, frames))
            )
            stages[stage_name] = stages.get(stage_name, 0.0) + stage_milliseconds
    return stages


def total_ms(detection: Detection) -> FloatArray:
    """Milliseconds of each frame, (T,)."""
    total: FloatArray = sum(stage_ms(detection).values(), start=np.zeros(len(detection.times)))
    return total


def plot_cut_ms(total_milliseconds: Sequence[FloatArray]) -> float:
    """Milliseconds at which a plot of these is cut."""
    return (
        max((float(np.percentile(ms, CUT_PERCENTILE)) for ms in total_milliseconds if len(ms)), default=0.0)
        or BUDGET_MS
    )


def budget_fraction(plot_top: float) -> float:
    """The largest of 1, 1/10, 1/100 ... of a frame's budget that a plot up to ``plot_top`` shows."""
    return float(10.0 ** min(0, int(np.floor(np.log10(plot_top / BUDGET_MS)))))


def total_path(label: str) -> str:
    """Entity of all that a detector took."""
    return entity("timing", label, "total")


def stages_path(label: str) -> str:
    """Entity below which the stages of a detector stand."""
    return entity("timing", label, "stages")


def log_timing(writer: RecordingWriter, detections: Mapping[str, Detection], legends: Mapping[str, str]) -> None:
    """Send totals, stages added up, counters and the line of the budget; ``legends``: what stands beside a detector."""
    total_ms_of_label = {label: total_ms(detection) for label, detection in detections.items()}
    fraction = budget_fraction(plot_cut_ms([*total_ms_of_label.values()]))
    fraction_text = {1.0: "", 0.1: "a tenth of ", 0.01: "a hundredth of "}.get(
        fraction, f"{words.number(fraction)} of "
    )
    budget_name = f"{fraction_text}a {words.rate(HEADSET_HZ)} frame: {words.frame_time(fraction * BUDGET_MS / 1e3)}"
    frames = len(writer.clock.ns)
    writer.curve(BUDGET_ENTITY, np.full(frames, fraction * BUDGET_MS), budget_name, BUDGET)
    for number, (label, detection) in enumerate(detections.items()):
        writer.curve(total_path(label), total_ms_of_label[label], legends[label], colour_of(number))
        _log_stages(writer, label, stage_ms(detection))
        for rank, (counter, value) in enumerate(detection.work.items()):
            if np.any(value):
                work_counts = value.sum(axis=1) if isinstance(value, np.ndarray) else np.full(frames, value)
                legend = f"{counter.replace('_', ' ')}: {int(np.sum(value)):,} in all"
                writer.curve(entity("counters", label, counter), work_counts, legend, colour_of(rank))


def _log_stages(writer: RecordingWriter, label: str, stages: Mapping[str, FloatArray]) -> None:
    """Lines added up, the total drawn first: Rerun has no areas."""
    for rank, (stage, total) in enumerate(zip(stages, accumulate(stages.values()), strict=True)):
        path = f"{stages_path(label)}/{entity(f'{len(stages) - rank}_{stage}')}"
        writer.curve(path, total, f"+ {stage}" if rank else stage, colour_of(rank))


def log_accuracy(writer: RecordingWriter, dots: Sequence[tuple[Dot, Rgba]]) -> None:
    """Send losses over costs, the plot of the page, in a flat view: Rerun plots over time alone."""
    if dots:
        plot = accuracy_plot(
            [dot for dot, _ in dots], SCATTER_SIZE, "loss: 0 is right; left is cheaper, down is better"
        )
        _log_plot(writer, plot, [colour for _, colour in dots])


def _log_plot(writer: RecordingWriter, plot: Plot, colours: Sequence[Rgba]) -> None:
    """Send a plot with the ``colours`` of its dots."""
    root, radius = SCATTER_ENTITY, rr.Radius.ui_points

    def view_points(points: Sequence[Point]) -> FloatArray:
        return UNITS_PER_PLOT_UNIT * np.reshape(points, (-1, 2))

    lines = [view_points(corners) for _, corners in plot.lines]
    writer.static(
        f"{root}/lines", rr.LineStrips2D(lines, colors=pack_colours([FAINT]), radii=radius(1.0), draw_order=-1.0)
    )
    dots = view_points([dot.at for dot in plot.dots])
    writer.static(f"{root}/dots", rr.Points2D(dots, colors=pack_colours(colours), radii=radius(9.0)))
    side_offsets = {"start": LETTER_WIDTH / 2, "middle": 0.0, "end": -LETTER_WIDTH / 2}
    anchors = view_points([(text.at[0] + side_offsets[text.side] * len(text.text), text.at[1]) for text in plot.labels])
    label_points = rr.Points2D(
        anchors - np.array([0.0, TEXT_RISE]),
        labels=[text.text for text in plot.labels],
        colors=pack_colours(TICKS if text.dot < 0 else colours[text.dot] for text in plot.labels),
        radii=radius(0.01),
        show_labels=True,
    )
    writer.static(f"{root}/words", label_points)
