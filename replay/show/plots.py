"""Charts as lines, dots and words on a flat field, y downwards: a page draws them as SVG, the picture in a flat view.

Rerun has no plot of one quantity over another. Lengths are in units of which a letter is ``LETTER`` wide.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import ceil, floor, log1p, log10
from typing import Final

from replay.words import number as number_text

Size = tuple[float, float]
Point = tuple[float, float]
Box = tuple[float, float, float, float]

SIZE: Final[Size] = (432.0, 180.0)
LETTER: Final = 7.2
HIGH: Final = 15.0
"""Height of a line of words."""

SPREAD: Final = 30.0
"""An axis of which the largest value is so many times the smallest is logarithmic."""


@dataclass(frozen=True)
class Dot:
    """A detector or a setting, at its cost x and its fault y."""

    name: str
    x: float
    y: float
    kind: str = ""  # class of its colour


@dataclass(frozen=True)
class Words:
    """Words whose ``start``, ``middle`` or ``end`` is at a point of their base line; ``dot``: what they name."""

    text: str
    at: Point
    side: str = "start"
    dot: int = -1


@dataclass(frozen=True)
class Plot:
    """Shapes and texts of a plot; ``said`` is its text alternative."""

    said: str
    size: Size
    lines: list[tuple[str, list[Point]]] = field(default_factory=list)  # kind, and corners
    dots: list[tuple[str, Point]] = field(default_factory=list)  # kind, and middle
    words: list[Words] = field(default_factory=list)


@dataclass(frozen=True)
class Axis:
    """Ticks of an axis, and where a value stands between the first and the last."""

    words: str
    ticks: Sequence[float]
    scale: Callable[[float], float] = float

    @staticmethod
    def of(title: str, values: Sequence[float], most: int, *, zero: bool = False) -> "Axis":
        """An axis from 0, or a logarithmic one where the values are far apart; with ``zero`` that has a 0 too."""
        smallest, largest = min(value for value in values if value > 0), max(values)
        if largest <= SPREAD * smallest:
            return Axis(title, ticks_of(largest, most))
        if zero:
            return Axis(title, [0.0, *_decades(1.0, largest)], log1p)
        ticks = _decades(smallest, largest)
        return Axis(title, ticks, lambda value: log10(max(value, ticks[0])))

    def share(self, value: float) -> float:
        """Position of a value on the axis, 0 to 1."""
        first, last = self.scale(self.ticks[0]), self.scale(self.ticks[-1])
        return (self.scale(value) - first) / (last - first)


def scatter(dots: Sequence[Dot], alternative: str, x_title: str, up: Axis, size: Size = SIZE) -> Plot:
    """Named dots; each name stands where it covers no other, or is left out."""
    across = Axis.of(x_title, [dot.x for dot in dots if dot.x > 0] or [1.0], 5)
    plot = _axes(Plot(alternative, size), across, up)
    plot.dots.extend((dot.kind, _place(plot, across.share(dot.x), up.share(dot.y))) for dot in dots)
    taken = [(x - 6, y - 6, x + 6, y + 6) for _, (x, y) in plot.dots]
    for number, dot in enumerate(dots):
        x, y = plot.dots[number][1]
        free = _free(taken, x, y, LETTER * len(dot.name), size)
        if free is not None:
            taken.append(free)
            plot.words.append(Words(dot.name, (free[0], free[3] - 3), dot=number))
    return plot


def curve(
    points: Sequence[Point], ends: Sequence[float], alternative: str, x_title: str, y_title: str, lowest: float = 0.0
) -> Plot:
    """A curve over linear axes, with a vertical line at each end point; ``lowest`` is where the upright axis begins."""
    across = Axis(x_title, ticks_of(max(points[-1][0], *(x for x, _ in points), 1e-9), 5))
    up = Axis(y_title, ticks_of(max(*(y for _, y in points), lowest + 1e-9), 3, lowest))
    plot = _axes(Plot(alternative, SIZE), across, up)
    plot.lines.append(("curve", [_place(plot, across.share(x), up.share(y)) for x, y in points]))
    for end in ends:
        plot.lines.append(("end", [_place(plot, across.share(end), height) for height in (1.0, 0.0)]))
    return plot


def _frame(size: Size) -> Box:
    """Left, top, right and bottom of the field between the axes."""
    return 34.0, 22.0, size[0] - 18.0, size[1] - 38.0


def _place(plot: Plot, x: float, y: float) -> Point:
    """Pixel at these fractions of both axes."""
    left, top, right, bottom = _frame(plot.size)
    return left + x * (right - left), bottom - y * (bottom - top)


def _axes(plot: Plot, across: Axis, up: Axis) -> Plot:
    """With grid lines, ticks and what both axes are."""
    left, _, right, bottom = _frame(plot.size)
    for tick in up.ticks:
        y = _place(plot, 0.0, up.share(tick))[1]
        plot.lines.append(("grid", [(left, y), (right, y)]))
        plot.words.append(Words(number_text(tick), (left - 7, y + 4), "end"))
    for tick in across.ticks:
        x = _place(plot, across.share(tick), 0.0)[0]
        plot.words.append(Words(number_text(tick), (x, bottom + 17), "middle"))
    plot.words.extend([Words(up.words, (left, 11.0)), Words(across.words, (right, bottom + 34), "end")])
    return plot


def _free(taken: Sequence[Box], x: float, y: float, wide: float, size: Size) -> Box | None:
    """The first box beside a dot that covers no other and lies in the plot."""
    candidates = (
        (x + 10, y - 8),
        (x - 10 - wide, y - 8),
        (x - wide / 2, y - 24),
        (x + 6, y - 22),
        (x - wide - 4, y - 22),
    )
    for left, top in candidates:
        box = (left, top, left + wide, top + HIGH)
        inside = left >= _frame(size)[0] and box[2] <= size[0] and top >= 0
        if inside and not any(a < box[2] and left < c and b < box[3] and top < d for a, b, c, d in taken):
            return box
    return None


def ticks_of(largest: float, most: int, smallest: float = 0.0) -> list[float]:
    """Round numbers from the last that is not above the smallest value to the first that is not below the largest."""
    rough = (largest - smallest) / most
    power = 10.0 ** floor(log10(rough))
    step = next(power * k for k in (1, 2, 2.5, 5, 10) if power * k >= rough * 0.999)
    return [step * k for k in range(floor(smallest / step), ceil(largest / step - 1e-9) + 1)]


def _decades(smallest: float, largest: float) -> list[float]:
    return [10.0**k for k in range(floor(log10(smallest)), ceil(log10(largest) - 1e-9) + 1)]
