"""Charts as lines, dots and labels on a flat field, y downwards: a page draws them as SVG, the picture in a flat view.

Rerun has no plot of one quantity over another. Lengths are in units of which a letter is ``LETTER_WIDTH`` wide.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import permutations
from math import ceil, floor, inf, isfinite, log1p, log10
from textwrap import wrap
from typing import Final

from replay.words import number as number_text

Size = tuple[float, float]
Point = tuple[float, float]
Box = tuple[float, float, float, float]

PLOT_SIZE: Final[Size] = (432.0, 180.0)
LETTER_WIDTH: Final = 7.2
NARROW_BOLD, LETTER_BOLD, CAPITAL_BOLD, WIDEST_BOLD = 5.7, 8.9, 10.9, 15.8
"""Widths of bold letters: narrow ones, small ones and digits, capitals, and the widest with all beyond ASCII."""

NARROW_CHARACTERS: Final = " .,:;'|!ijlI"
WIDE_CHARACTERS: Final = "MWmw@%"

MOST_PERMUTED_NAMES: Final = 5
"""Names that are placed in every order, the best of which counts."""

CANDIDATES_BESIDE: Final = 7
"""Candidates beside a dot; a name farther away has a line to it."""

CROSSING_COST: Final = 100
"""Cost of a name on the line from another name to its dot."""

OMISSION_COST: Final = 1000
"""Cost of a name without room."""

LINE_HEIGHT: Final = 15.0
"""Height of a line of text."""

INTERVAL_WIDTH, ROW_HEIGHT, INTERVAL_FOOT = 400.0, 42.0, 40.0
"""Of a plot of intervals: its width, the height of a row, and that of axis and title."""

LOGARITHMIC_RATIO: Final = 30.0
"""An axis of which the largest value is so many times the smallest is logarithmic."""


@dataclass(frozen=True)
class Dot:
    """A detector or a setting, at its cost x and its fault y."""

    name: str
    x: float
    y: float
    kind: str = ""  # class of its colour
    detector: str = ""  # its label, where it stands for one of a run


@dataclass(frozen=True)
class PlacedDot:
    """A dot with its centre in pixels."""

    kind: str
    at: Point
    name: str
    detector: str


@dataclass(frozen=True)
class Label:
    """A text whose ``start``, ``middle`` or ``end`` is at a point of its base line; ``dot``: what it names."""

    text: str
    at: Point
    side: str = "start"
    dot: int = -1


@dataclass(frozen=True)
class Plot:
    """Shapes and texts of a plot; ``description`` is its text alternative."""

    description: str
    size: Size
    lines: list[tuple[str, list[Point]]] = field(default_factory=list)  # kind, and corners
    dots: list[PlacedDot] = field(default_factory=list)
    labels: list[Label] = field(default_factory=list)
    caption: str = ""  # below it, where that is shorter than ``description``
    title: str = ""


@dataclass(frozen=True)
class Axis:
    """Ticks of an axis, and where a value stands between the first and the last."""

    title: str
    ticks: Sequence[float]
    scale: Callable[[float], float] = float

    @staticmethod
    def of(title: str, values: Sequence[float], most_ticks: int, *, zero: bool = False) -> "Axis":
        """An axis from 0, or a logarithmic one where the values are far apart; with ``zero`` that has a 0 too."""
        smallest, largest = min(value for value in values if value > 0), max(values)
        if largest <= LOGARITHMIC_RATIO * smallest:
            return Axis(title, ticks_of(largest, most_ticks))
        if zero:
            return Axis(title, [0.0, *_decades(1.0, largest)], log1p)
        ticks = _decades(smallest, largest)
        return Axis(title, ticks, lambda value: log10(max(value, ticks[0])))

    def fraction(self, value: float) -> float:
        """Position of a value on the axis, 0 to 1."""
        first_tick, last_tick = self.scale(self.ticks[0]), self.scale(self.ticks[-1])
        return (self.scale(value) - first_tick) / (last_tick - first_tick)


def scatter(dots: Sequence[Dot], alternative_text: str, x_title: str, y_axis: Axis, size: Size = PLOT_SIZE) -> Plot:
    """Named dots; each name stands where it covers no other, farther away with a line to its dot, or is left out."""
    x_axis = Axis.of(x_title, [dot.x for dot in dots if dot.x > 0] or [1.0], 5)
    plot = _axes(Plot(alternative_text, size), x_axis, y_axis)
    plot.dots.extend(
        PlacedDot(dot.kind, _pixel(plot, x_axis.fraction(dot.x), y_axis.fraction(dot.y)), dot.name, dot.detector)
        for dot in dots
    )
    for number, box, has_leader in _names(plot, [dot.name for dot in dots]):
        x, y = plot.dots[number].at
        side = "end" if box[2] < x else "start"
        plot.labels.append(Label(dots[number].name, (box[2 if side == "end" else 0], box[3] - 3), side, dot=number))
        if has_leader:
            plot.lines.append(("leader", [(x, y), _nearest_corner(box, (x, y))]))
    return plot


def curve(
    points: Sequence[Point],
    end_points: Sequence[float],
    alternative_text: str,
    x_title: str,
    y_title: str,
    lowest: float = 0.0,
) -> Plot:
    """A curve over linear axes, with a vertical line at each end point; ``lowest`` is where the upright axis begins."""
    x_axis = Axis(x_title, ticks_of(max(points[-1][0], *(x for x, _ in points), 1e-9), 5))
    y_axis = Axis(y_title, ticks_of(max(*(y for _, y in points), lowest + 1e-9), 3, lowest))
    plot = _axes(Plot(alternative_text, PLOT_SIZE), x_axis, y_axis)
    plot.lines.append(("curve", [_pixel(plot, x_axis.fraction(x), y_axis.fraction(y)) for x, y in points]))
    for end in end_points:
        plot.lines.append(("end", [_pixel(plot, x_axis.fraction(end), height) for height in (1.0, 0.0)]))
    return plot


@dataclass(frozen=True)
class IntervalRow:
    """A figure with its interval; ``label`` stands at the right, ``kind`` is the class of its colour."""

    name: str
    value: float
    lower: float
    upper: float
    label: str
    kind: str = ""


def interval_plot(
    rows: Sequence[IntervalRow],
    alternative_text: str,
    x_title: str,
    *,
    title: str = "",
    marked_values: Sequence[float] = (),
    start: float | None = None,
    end: float | None = None,
) -> Plot:
    """Return figures below each other with their intervals, and vertical lines at ``marked_values``.

    ``start`` and ``end``: where the axis begins and ends at least; an interval without a finite end is drawn as a dot.
    """
    interval_bounds = [bound for row in rows for bound in (row.lower, row.value, row.upper) if isfinite(bound)]
    interval_bounds += [*marked_values, *(bound for bound in (start, end) if bound is not None)]
    smallest, largest = min(interval_bounds), max(interval_bounds)
    ticks = ticks_of(max(largest, smallest + 1e-9), 5, smallest)
    left, right = 8.0, INTERVAL_WIDTH - 8.0
    wrapped_names = [wrap(row.name, max(1, round((right - left) / LETTER_WIDTH) - len(row.label) - 2)) for row in rows]
    extra_height = LINE_HEIGHT * sum(len(lines) - 1 for lines in wrapped_names)
    bottom = ROW_HEIGHT * len(rows) + extra_height + 4.0
    size = INTERVAL_WIDTH, bottom - 4.0 + INTERVAL_FOOT
    rows_text = "; ".join(f"{row.name}: {row.label}" for row in rows)
    plot = Plot(f"{alternative_text} {rows_text}.", size, caption=alternative_text, title=title)

    def x_of(value: float) -> float:
        return left + (min(max(value, ticks[0]), ticks[-1]) - ticks[0]) / (ticks[-1] - ticks[0]) * (right - left)

    for tick in ticks:
        plot.lines.append(("grid", [(x_of(tick), 4.0), (x_of(tick), bottom)]))
        side = "start" if tick == ticks[0] else "end" if tick == ticks[-1] else "middle"
        plot.labels.append(Label(number_text(tick), (x_of(tick), bottom + 15), side))
    plot.labels.append(Label(x_title, (right, bottom + 31), "end"))
    row_top = 0.0
    for number, (row, lines) in enumerate(zip(rows, wrapped_names, strict=True)):
        y = row_top + LINE_HEIGHT * (len(lines) - 1) + 30.0
        # Names stay free of the marks.
        plot.lines.extend(("end", [(x_of(mark), y - 8), (x_of(mark), y + 8)]) for mark in marked_values)
        plot.labels.extend(
            Label(text, (left, row_top + 19.0 + LINE_HEIGHT * k), dot=number) for k, text in enumerate(lines)
        )
        plot.labels.append(Label(row.label, (right, row_top + 19.0), "end"))
        if isfinite(row.lower) and isfinite(row.upper):
            plot.lines.append((f"whisker {row.kind}".strip(), [(x_of(row.lower), y), (x_of(row.upper), y)]))
        plot.dots.append(PlacedDot(row.kind, (x_of(row.value), y), f"{row.name}: {row.label}", ""))
        row_top += ROW_HEIGHT + LINE_HEIGHT * (len(lines) - 1)
    return plot


def _frame(size: Size) -> Box:
    """Left, top, right and bottom of the field between the axes."""
    return 34.0, 22.0, size[0] - 18.0, size[1] - 38.0


def _pixel(plot: Plot, x: float, y: float) -> Point:
    """Pixel at these fractions of both axes."""
    left, top, right, bottom = _frame(plot.size)
    return left + x * (right - left), bottom - y * (bottom - top)


def _axes(plot: Plot, x_axis: Axis, y_axis: Axis) -> Plot:
    """With grid lines, ticks and what both axes are."""
    left, _, right, bottom = _frame(plot.size)
    for tick in y_axis.ticks:
        y = _pixel(plot, 0.0, y_axis.fraction(tick))[1]
        plot.lines.append(("grid", [(left, y), (right, y)]))
        plot.labels.append(Label(number_text(tick), (left - 7, y + 4), "end"))
    for tick in x_axis.ticks:
        x = _pixel(plot, x_axis.fraction(tick), 0.0)[0]
        plot.labels.append(Label(number_text(tick), (x, bottom + 17), "middle"))
    plot.labels.extend([Label(y_axis.title, (left, 11.0)), Label(x_axis.title, (right, bottom + 34), "end")])
    return plot


@dataclass(frozen=True)
class NamePlace:
    """A box for the name of a dot that covers no dot and no tick; ``leader``: the field of the line, if it has one.

    ``rank``: its number among the candidates, the best first; ``is_crossed``: whether its line crosses a dot or tick.
    """

    rank: int
    box: Box
    leader: Box | None
    is_crossed: bool

    @property
    def cost(self) -> int:
        """Grows with the distance from the dot."""
        return self.rank if self.leader is None else CANDIDATES_BESIDE * self.rank


def _names(plot: Plot, names: Sequence[str]) -> list[tuple[int, Box, bool]]:
    """Number, box and need of a line of every name that finds room; few names are tried in every order."""
    dots = [(x - 6, y - 6, x + 6, y + 6) for x, y in (dot.at for dot in plot.dots)]
    taken_boxes = [*dots, *(_box_of(text) for text in plot.labels)]
    places = [_places(plot, number, name, taken_boxes) for number, name in enumerate(names)]
    numbers = range(len(names))
    lowest_cost, chosen_places = inf, dict[int, NamePlace]()
    for order in permutations(numbers) if len(names) <= MOST_PERMUTED_NAMES else [tuple(numbers)]:
        cost, order_places = _placed_names(places, order, lowest_cost)
        if cost < lowest_cost:
            lowest_cost, chosen_places = cost, order_places
    return [(number, place.box, place.leader is not None) for number, place in chosen_places.items()]


def _places(plot: Plot, number: int, name: str, taken_boxes: Sequence[Box]) -> list[NamePlace]:
    """Places for the name of a dot that are free as long as no other name stands there, the best first."""
    dot = plot.dots[number].at
    others = [box for k, box in enumerate(taken_boxes) if k != number]
    places = []
    for rank, box in enumerate(_candidates(*dot, text_width(name))):
        if _is_free(box, taken_boxes, plot.size):
            leader = _leader(box, dot) if rank >= CANDIDATES_BESIDE else None
            places.append(NamePlace(rank, box, leader, leader is not None and not _is_apart(leader, others)))
    return places


def _placed_names(
    places: Sequence[Sequence[NamePlace]], order: Sequence[int], most_cost: float
) -> tuple[float, dict[int, NamePlace]]:
    """Cost of an order, which grows with names far from their dots or left out, and the place of each name in it.

    ``most_cost``: from which on the order is given up.
    """
    boxes, leaders, cost, placed = list[Box](), list[Box](), 0.0, dict[int, NamePlace]()
    for number in order:
        crossed_place = None
        for place in places[number]:
            if not _is_apart(place.box, boxes):
                continue
            is_crossed = (
                place.is_crossed
                or not _is_apart(place.box, leaders)
                or (place.leader is not None and not _is_apart(place.leader, boxes))
            )
            if not is_crossed:
                placed[number] = place
                break
            crossed_place = crossed_place or place
        if number not in placed:
            if crossed_place is None:
                cost += OMISSION_COST
                continue
            placed[number] = crossed_place
            cost += CROSSING_COST
        place = placed[number]
        cost += place.cost
        if cost >= most_cost:
            break
        boxes.append(place.box)
        if place.leader is not None:
            leaders.append(place.leader)
    return cost, placed


def _leader(box: Box, dot_point: Point) -> Box:
    """The field of the line from a dot to the box of its name."""
    x, y = _nearest_corner(box, dot_point)
    return min(x, dot_point[0]) - 1, min(y, dot_point[1]), max(x, dot_point[0]) + 1, max(y, dot_point[1])


def text_width(name: str) -> float:
    """Width of a name in the bold letters of a plot, rather too large than too small."""
    return sum(_letter_width(letter) for letter in name)


def _letter_width(letter: str) -> float:
    if letter in WIDE_CHARACTERS or not letter.isascii():
        return WIDEST_BOLD
    if letter in NARROW_CHARACTERS:
        return NARROW_BOLD
    return CAPITAL_BOLD if letter.isupper() else LETTER_BOLD


def _candidates(x: float, y: float, width: float) -> Iterator[Box]:
    """Boxes for the name of a dot, the best first: beside it, then farther away."""
    corners = [
        (x + 10, y - 8),
        (x - 10 - width, y - 8),
        (x - width / 2, y - 24),
        (x + 6, y - 22),
        (x - width - 4, y - 22),
    ]
    # Ticks stand close below a dot on the floor.
    corners += [(x + 10, y - 13), (x - 10 - width, y - 13)]
    for rise in (-40, 14, -58, 30, -76, -94):
        corners += [(x + shift * width, y + rise) for shift in (-0.5, -1.0, 0.0)]
    for left, top in corners:
        yield left, top, left + width, top + LINE_HEIGHT


def _is_free(box: Box, taken_boxes: Sequence[Box], size: Size) -> bool:
    left, top, right, bottom = box
    is_inside = left >= _frame(size)[0] and right <= size[0] and top >= 0 and bottom <= size[1]
    return is_inside and _is_apart(box, taken_boxes)


def _is_apart(box: Box, other_boxes: Sequence[Box]) -> bool:
    """Whether a box overlaps none of others."""
    left, top, right, bottom = box
    return not any(a < right and left < c and b < bottom and top < d for a, b, c, d in other_boxes)


def _box_of(text: Label) -> Box:
    width, (x, y) = text_width(text.text), text.at
    left = x - {"start": 0.0, "middle": width / 2, "end": width}[text.side]
    return left, y - LINE_HEIGHT + 3, left + width, y + 3


def _nearest_corner(box: Box, point: Point) -> Point:
    """The point of a box's upper or lower edge that is nearest to a point above or below."""
    return min(max(point[0], box[0]), box[2]), box[1] if box[1] > point[1] else box[3]


def ticks_of(largest: float, most_ticks: int, smallest: float = 0.0) -> list[float]:
    """Round numbers from the last that is not above the smallest value to the first that is not below the largest."""
    rough_step = (largest - smallest) / most_ticks
    power_of_ten = 10.0 ** floor(log10(rough_step))
    tick_step = next(power_of_ten * k for k in (1, 2, 2.5, 5, 10) if power_of_ten * k >= rough_step * 0.999)
    return [tick_step * k for k in range(floor(smallest / tick_step), ceil(largest / tick_step - 1e-9) + 1)]


def _decades(smallest: float, largest: float) -> list[float]:
    return [10.0**k for k in range(floor(log10(smallest)), ceil(log10(largest) - 1e-9) + 1)]
