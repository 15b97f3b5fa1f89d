"""What accuracy costs, drawn in a plane: recall over time on a log axis, a colour per algorithm, the front in white.

Rerun has no log axis and no scatter plot, so axes, ticks and marks are strips and points in a plane of our own: x grows
to the right, y downwards.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, floor, log10
from typing import Any, Final

import rerun as rr
import rerun.blueprint as rrb

from replay.base.constants import BUDGET_MS, ONE_FRAME
from replay.outputs.palette import BACKGROUND, GRID, TICKS, WHITE, Rgba
from replay.outputs.report.tradeoff_picture import DARK, apart, stretched
from replay.outputs.rerun_log.columns import RecordingWriter, entity, packed
from replay.outputs.rerun_log.markdown import markdown
from replay.outputs.tradeoff_table import (
    OVER_BUDGET,
    front_rows,
    lines_of,
    measured_on,
    quickest_first,
    tradeoff_table,
)  # fmt: skip
from replay.pipeline.run_result import Tradeoff
from replay.tradeoffs.pareto import Row, counts

ROOT: Final = "tradeoff/plot"
ADVICE: Final = "tradeoff/advice"

WIDTH: Final = 1200.0
HEIGHT: Final = 900.0
"""Units of the plane; the axes fill it, words stand around it."""

PALE: Final = 90
"""Alpha of what invents too much to count."""

RECALLS: Final = (0.0, 0.5, 0.8, 0.9, 0.95, 0.99, 1.0)

SERIES: Final[tuple[Rgba, ...]] = tuple((*bytes.fromhex(colour[1:]), 255) for colour in DARK.series)
"""One colour per algorithm, those of the picture for dark pages."""

NUMBER: Final = (-44.0, -12.0)
"""From a point on the front to its number; words stand below the point they belong to."""

NUMBERS_APART: Final = 48.0
"""Units of the plane between the numbers of neighbours on the front: no two overlap in a view 600 pixels wide."""

LEGEND: Final = 46.0
"""Units of the plane per row of the list of algorithms."""


@dataclass(frozen=True)
class Plane:
    """Where milliseconds and recall are in the plane; ``low`` and ``high`` are powers of ten."""

    low: int
    high: int

    @classmethod
    def of(cls, rows: Sequence[Row]) -> Plane:
        """The decades that hold all rows and the budget of 90 Hz."""
        times = [row["ms_per_frame"] for row in rows if row["ms_per_frame"] > 0]
        return cls(floor(log10(min([*times, 1.0]))), ceil(log10(max([*times, BUDGET_MS]))))

    def x(self, ms: float) -> float:
        """Right of the axis."""
        return WIDTH * (log10(max(ms, 10.0**self.low)) - self.low) / (self.high - self.low)

    def y(self, recall: float) -> float:
        """Below the top: a recall of 1 is at the top, and what is nearly 1 has most of the room."""
        least, most, here = stretched([0.0, 100.0, 100.0 * recall]).tolist()
        return float(HEIGHT * (most - here) / (most - least))

    def point(self, row: Row) -> tuple[float, float]:
        """Where a row's mark is."""
        return self.x(row["ms_per_frame"]), self.y(row["recall"])


def _at(*parts: str) -> str:
    """Entity of a part of the plot."""
    return entity(*ROOT.split("/"), *parts)


def log_tradeoff(writer: RecordingWriter, done: Tradeoff) -> None:
    """Send axes, lines, intervals, the front and the words."""
    plane = Plane.of(done.rows)
    _axes(writer, plane)
    algorithms = list(dict.fromkeys(row["detector"] for row in done.rows))
    for name, points in lines_of(done.rows).items():
        _line(writer, plane, name, points, SERIES[algorithms.index(points[0]["detector"]) % len(SERIES)])
    for number, name in enumerate(algorithms):
        place = (name, WIDTH + 170.0, LEGEND * number)
        _words(writer, f"legend/{name}", [place], SERIES[number % len(SERIES)])
    _front(writer, plane, done)
    writer.markdown(ADVICE, advice_text(done))


def _axes(writer: RecordingWriter, plane: Plane) -> None:
    decades = range(plane.low, plane.high + 1)
    strips = [[(plane.x(10.0**k), 0.0), (plane.x(10.0**k), HEIGHT)] for k in decades]
    strips += [[(0.0, plane.y(level)), (WIDTH, plane.y(level))] for level in RECALLS]
    writer.static(_at("grid"), rr.LineStrips2D(strips, colors=packed([GRID]), radii=0.8))
    budget = [[(plane.x(BUDGET_MS), -10.0), (plane.x(BUDGET_MS), HEIGHT)]]
    writer.static(_at("budget"), rr.LineStrips2D(budget, colors=packed([WHITE]), radii=1.2))
    words: list[tuple[str, float, float]] = [(f"{10.0**k:g} ms", plane.x(10.0**k), HEIGHT + 14) for k in decades]
    words += [(f"{level:.0%}", -52.0, plane.y(level) - 16) for level in RECALLS]
    words += [
        ("recall: share of contact pair-frames found", 200.0, -96.0),
        (ONE_FRAME, plane.x(BUDGET_MS), -66.0),
        ("time per frame, logarithmic (large marks: decided frame by frame)", WIDTH / 2, HEIGHT + 64),
    ]
    _words(writer, "axes", words, TICKS)


def _words(writer: RecordingWriter, name: str, words: Sequence[tuple[str, float, float]], colour: Rgba) -> None:
    places, labels = [(x, y) for _, x, y in words], [text for text, _, _ in words]
    points = rr.Points2D(places, labels=labels, radii=0.01, colors=packed([colour]), show_labels=True)
    writer.static(_at(*name.split("/")), points)


def _line(writer: RecordingWriter, plane: Plane, name: str, points: Sequence[Row], colour: Rgba) -> None:
    places = [plane.point(row) for row in points]
    shades = [colour if counts(row) or row["oracle"] else (*colour[:3], PALE) for row in points]
    ends = ("recall_low", "recall_high")
    spans = [[(plane.x(row["ms_per_frame"]), plane.y(row[end])) for end in ends] for row in points]
    writer.static(_at("lines", name, "interval"), rr.LineStrips2D(spans, colors=packed(shades), radii=0.7))
    if len(places) > 1:
        writer.static(_at("lines", name, "line"), rr.LineStrips2D([places], colors=packed([shades[-1]]), radii=1.3))
    sizes = [7.0 if row["online"] else 4.5 for row in points]
    labels = [row["label"] for row in points]
    marks = rr.Points2D(places, colors=packed(shades), radii=sizes, labels=labels, show_labels=False)
    writer.static(_at("lines", name, "marks"), marks)


def _front(writer: RecordingWriter, plane: Plane, done: Tradeoff) -> None:
    places = [plane.point(row) for row in front_rows(done.rows)]
    if not places:
        return
    ends = [*(x for x, _ in places[1:]), WIDTH]
    corners = [corner for (x, y), end in zip(places, ends, strict=True) for corner in ((x, y), (end, y))]
    white = packed([WHITE])
    writer.static(_at("front", "steps"), rr.LineStrips2D([corners], colors=white, radii=2.4))
    writer.static(_at("front", "marks"), rr.Points2D(places, colors=white, radii=5.5, draw_order=40.0))
    numbers = apart(places, NUMBER, NUMBERS_APART, -2.0)
    poles = [[place, (x, y + 14.0)] for place, (x, y) in zip(places, numbers, strict=True)]
    writer.static(_at("front", "poles"), rr.LineStrips2D(poles, colors=packed([GRID]), radii=0.8))
    _words(writer, "words", [(str(number), x, y) for number, (x, y) in enumerate(numbers, 1)], WHITE)


def curve_tab() -> Any:
    """Recall against time for every setting tried, and what to take."""
    plane = rrb.Spatial2DView(
        origin="/tradeoff/plot",
        name="What accuracy costs: recall against time; the white line is the front, numbered as at the right",
        visual_bounds=rrb.VisualBounds2D(x_range=(-130.0, WIDTH + 300.0), y_range=(-150.0, HEIGHT + 120.0)),
        background=rrb.Background(color=BACKGROUND[:3], kind=rrb.BackgroundKind.SolidColor),
    )
    words = rrb.TextDocumentView(origin="/tradeoff/advice", name="What to take")
    return rrb.Horizontal(plane, words, column_shares=[0.66, 0.34], name="What accuracy costs")


def advice_text(done: Tradeoff) -> str:
    """Advice and the table of the front in Markdown, then every row in order of time."""
    front = tradeoff_table("The front", front_rows(done.rows)).only("#", *SHOWN)
    where = f"Measured on {measured_on(done)}; compare ratios, not milliseconds."
    cut = [f"Not tried, for want of time: {', '.join(done.cut)}."] if done.cut else []
    whole = tradeoff_table("Every setting", quickest_first(done.rows)).only(*SHOWN).titled("Every setting", where, *cut)
    advice = "\n\n".join(["## What to take", *(f"- {sentence}" for sentence in done.advice)])
    return "\n\n".join([advice, markdown(front, level=2), markdown(whole, level=2)])


SHOWN: Final = ("setting", "ms per frame", "missed, % [95 %]", "invented, %", OVER_BUDGET)
