"""The tab *Accuracy against cost*: a dot a detector over one axis of cost, and the time of every frame beside it.

Rerun has no plot of one quantity over another, no logarithmic axis, and two views cannot share one. So both panels are
drawn by hand in one view, y downwards.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, floor, log10
from typing import Final

import numpy as np
import rerun as rr

from replay.base.constants import BUDGET_MS, HEADSET_HZ
from replay.outputs.palette import FAINT, TICKS, WHITE, Rgba
from replay.outputs.rerun_log.columns import RecordingWriter, packed
from replay.pipeline.gates import figure

PLOT: Final = "accuracy/plot"

WIDTH, HEIGHT = 760.0, 300.0
"""Of one panel, in the units of the view, one a pixel at 1,920 x 1,080."""

TOPS: Final = (60.0, 490.0)
BOUNDS: Final = ((-110.0, 850.0), (0.0, 930.0))
"""Where the panels begin, and what the view shows of both axes."""

LETTER, LINE = 9.4, 40.0
"""Half of a label is so many units a letter; lines of words stand so far apart."""

UP: Final = 15.0
"""How far words are moved up, in units of the view."""

STEPS: Final = (1.0, 2.0, 3.0, 5.0)
"""Ticks of the axis of cost in each power of ten."""


@dataclass(frozen=True)
class Dot:
    """One detector, or one setting: its mean milliseconds a frame, and both faults; a share of time is 0 to 1."""

    name: str
    ms: float
    wrong: float
    false: float
    colour: Rgba


def log_accuracy(writer: RecordingWriter, dots: Sequence[Dot], contacts: int) -> None:
    """Send both panels."""
    picture = _Picture(writer, dots)
    most = max(3, ceil(max((one.wrong for one in dots), default=0) / 3) * 3)
    counts = [(most * k / 3, f"{most * k // 3}") for k in range(4)]
    picture.panel("wrong", TOPS[0], f"missed + late or cut short, of {contacts} contacts", counts,
                  [(one.wrong, f"{one.wrong:.1f}".removesuffix(".0")) for one in dots])  # fmt: skip
    shares = [(k / 4, f"{25 * k} %") for k in range(5)]
    picture.panel("false", TOPS[1], "false: share of the reported contact time", shares,
                  [(one.false, f"{figure(100 * one.false)} %") for one in dots])  # fmt: skip
    picture.costs(TOPS[1] + HEIGHT + 30.0)


class _Picture:
    """Both panels over one axis of cost."""

    def __init__(self, writer: RecordingWriter, dots: Sequence[Dot]) -> None:
        self._writer, self._dots = writer, dots
        times = [max(one.ms, 1e-6) for one in dots]
        low, high = log10(min(times)) - 0.25, log10(max(times)) + 0.25
        powers = range(floor(low), ceil(high) + 1)
        self._ticks = [
            ms for power in powers for ms in (step * 10.0**power for step in STEPS) if low < log10(ms) < high
        ]
        self._low, self._span = low, high - low

    def panel(
        self, name: str, top: float, title: str, ticks: Sequence[tuple[float, str]],
        values: Sequence[tuple[float, str]],
    ) -> None:  # fmt: skip
        """A grid, and the dots with their names."""
        root, most, base = f"{PLOT}/{name}", ticks[-1][0], top + HEIGHT
        heights = [base - HEIGHT * value / most for value, _ in ticks]
        lines = [[(0.0, y), (WIDTH, y)] for y in heights]
        lines += [[(self._x(ms), top), (self._x(ms), base)] for ms in self._ticks]
        grid = rr.LineStrips2D(lines, colors=packed([FAINT]), radii=rr.Radius.ui_points(1.0), draw_order=-1.0)
        self._writer.static(f"{root}/grid", grid)
        places = [
            (self._x(one.ms), base - HEIGHT * value / most) for one, (value, _) in zip(self._dots, values, strict=True)
        ]
        colours = packed(one.colour for one in self._dots)
        dots = rr.Points2D(places, colors=colours, radii=rr.Radius.ui_points(9.0))
        self._writer.static(f"{root}/dots", dots)
        texts = [f"{one.name}, {text}" for one, (_, text) in zip(self._dots, values, strict=True)]
        beside = placed_labels(places, texts, (top - 20.0, base))
        ends = [_edge(place, dot, text) for place, dot, text in zip(beside, places, texts, strict=True)]
        leaders = rr.LineStrips2D([*zip(places, ends, strict=True)], colors=colours, radii=rr.Radius.ui_points(1.0))
        self._writer.static(f"{root}/leaders", leaders)
        named = zip(beside, texts, self._dots, strict=True)
        said = [(place, text, one.colour) for place, text, one in named]
        said += [((-45.0, y), text, TICKS) for y, (_, text) in zip(heights, ticks, strict=True)]
        said.append(((LETTER / 2 * len(title), top - 38.0), title, WHITE))
        log_words(self._writer, f"{root}/words", said)

    def costs(self, y: float) -> None:
        """The axis of cost: milliseconds, and their share of a frame."""
        said = [((self._x(ms), y), f"{ms:g}", TICKS) for ms in self._ticks]
        said += [((self._x(ms), y + LINE), f"{figure(100 * ms / BUDGET_MS)} %", TICKS) for ms in self._ticks]
        said += [((-60.0, y), "ms", TICKS), ((-60.0, y + LINE), f"of {HEADSET_HZ:g} Hz", TICKS)]
        words = "mean time per frame (logarithmic); left is cheaper, down is better"
        log_words(self._writer, f"{PLOT}/costs", [*said, ((WIDTH / 2, y + 2 * LINE), words, TICKS)])

    def _x(self, ms: float) -> float:
        return WIDTH * (log10(max(ms, 1e-6)) - self._low) / self._span


Said = Sequence[tuple[tuple[float, float], str, Rgba]]
"""Places of a flat view, the words there, and their colours."""


def log_words(writer: RecordingWriter, path: str, said: Said) -> None:
    """Send words; the viewer centres them on their place and hangs them below: they are moved up."""
    places = np.array([(x, y - UP) for (x, y), _, _ in said], dtype=np.float32)
    words, colours = [text for _, text, _ in said], packed(colour for *_, colour in said)
    dot = rr.Radius.ui_points(0.01)
    writer.static(path, rr.Points2D(places, labels=words, colors=colours, radii=dot, show_labels=True))


def placed_labels(
    dots: Sequence[tuple[float, float]], texts: Sequence[str], room: tuple[float, float]
) -> list[tuple[float, float]]:
    """Where words stand beside their dots, in order: none on another, none on a dot, all between top and base."""
    taken = [(x - 14.0, y - 14.0, x + 14.0, y + 14.0) for x, y in dots]
    places: list[tuple[float, float]] = []
    for (x, y), text in zip(dots, texts, strict=True):
        half = half_width(text)
        choices = [
            (x + side * (half + 24.0), y + LINE * step) for step in sorted(range(-8, 9), key=abs) for side in (1, -1, 0)
        ]
        boxes = {(cx, cy): (cx - half, cy - 14.0, cx + half, cy + 14.0) for cx, cy in choices}
        fits = (
            place
            for place, box in boxes.items()
            if box[0] >= 0.0 and box[2] <= WIDTH + 60.0 and room[0] <= place[1] <= room[1]
            and not any(_meet(box, other) for other in taken)
        )  # fmt: skip
        place = next(fits, choices[0])
        taken.append(boxes[place])
        places.append(place)
    return places


def half_width(text: str) -> float:
    """Half of what words and the plate behind them take."""
    return LETTER / 2 * len(text) + 10.0


def _edge(place: tuple[float, float], dot: tuple[float, float], text: str) -> tuple[float, float]:
    """Where a line from a dot meets the plate of its words."""
    half = 0.85 * half_width(text)  # on a large screen the plate is narrower
    return min(max(dot[0], place[0] - half), place[0] + half), place[1]


def _meet(one: Sequence[float], other: Sequence[float]) -> bool:
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]
