"""Accuracy against cost in a flat view. Rerun plots over time alone."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from replay.outputs.palette import FAINT, TICKS, Rgba
from replay.outputs.plots import LETTER, Axis, Dot, Plot, scatter, ticks_of
from replay.outputs.rerun_log.recording_file import RecordingWriter, packed
from replay.pipeline.gates import figure

ACCURACY: Final = "accuracy/plot"

UNIT: Final = 1.3
"""Units of a view, one a pixel at 1,920 x 1,080, for one of a plot."""

SIZE: Final = (690.0, 340.0)
"""Of each of the two scatters, in units of a plot."""

UP: Final = 15.0
"""How far words are moved up, in units of the view: the viewer centres them on their place and hangs them below."""

WIDE: Final = (-10.0, UNIT * SIZE[0] + 10.0)
HIGH: Final = (-40.0, UNIT * SIZE[1] * 2 + 10.0)
"""What the view of both shows of its axes."""


def log_accuracy(writer: RecordingWriter, dots: Sequence[tuple[Dot, float, Rgba]]) -> None:
    """Send two scatters over the same costs: wrong contacts of dots, and the false share of the time beside each."""
    wrong, colours = [dot for dot, *_ in dots], [colour for *_, colour in dots]
    up = Axis("missed + late or cut short", ticks_of(max(1.0, *(dot.y for dot in wrong)), 3))
    log_plot(writer, f"{ACCURACY}/wrong", scatter(wrong, "", "mean ms a frame", up, SIZE), colours)
    false = [
        Dot(f"{dot.name.rpartition(': ')[0]}: {figure(100 * share)} %", dot.x, 100 * share) for dot, share, _ in dots
    ]
    up = Axis("false, % of the reported contact time", [0, 25, 50, 75, 100])
    below = scatter(false, "", "mean ms a frame; left is cheaper, down is better", up, SIZE)
    log_plot(writer, f"{ACCURACY}/false", below, colours, top=SIZE[1])


def log_plot(writer: RecordingWriter, root: str, plot: Plot, colours: Sequence[Rgba], top: float = 0.0) -> None:
    """Send a plot so far below the top of its view; ``colours`` of its dots."""
    lines = [placed(corners, top) for _, corners in plot.lines]
    grid = rr.LineStrips2D(lines, colors=packed([FAINT]), radii=rr.Radius.ui_points(1.0), draw_order=-1.0)
    writer.static(f"{root}/lines", grid)
    places = placed([place for _, place in plot.dots], top)
    writer.static(f"{root}/dots", rr.Points2D(places, colors=packed(colours), radii=rr.Radius.ui_points(9.0)))
    half = {"start": LETTER / 2, "middle": 0.0, "end": -LETTER / 2}
    at = [(words.at[0] + half[words.side] * len(words.text), words.at[1]) for words in plot.words]
    shown = rr.Points2D(
        placed(at, top) - np.array([0.0, 2 * UP]), labels=[words.text for words in plot.words],
        colors=packed(TICKS if words.dot < 0 else colours[words.dot] for words in plot.words),
        radii=rr.Radius.ui_points(0.01), show_labels=True,
    )  # fmt: skip
    writer.static(f"{root}/words", shown)


def placed(points: Sequence[tuple[float, float]], top: float) -> NDArray[np.float32]:
    """Points of a plot in the units of its view, (n, 2)."""
    return np.float32(UNIT) * (np.array(points, np.float32).reshape(-1, 2) + np.array([0.0, top], np.float32))
