"""Charts as SVG that lies in the page: accuracy against cost, when what happened, and curves of effects."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import ceil, floor, log1p, log10
from typing import Final

from replay.outputs.report.markup import Markup, element, joined

Span = tuple[float, float]
"""Seconds from start to end."""

KINDS: Final = ("false", "right", "late", "missed", "reference", "contact")
"""Kinds of stretches in a lane, in the order in which they are painted."""

KIND_WORDS: Final = {
    "reference": "reference", "contact": "contact", "right": "right", "missed": "missed",
    "late": "late or cut short", "false": "false",
}  # fmt: skip

NEIGHBOURS: Final = 2000
"""Stretches nearer to each other than this part of a lane are painted as one."""

SIZE: Final = (432.0, 180.0)

LETTER: Final = 7.2
"""Width of a letter of a name in a plot."""

SPREAD: Final = 30.0
"""An axis of which the largest value is so many times the smallest is logarithmic."""


@dataclass(frozen=True)
class Dot:
    """A detector in the plot."""

    label: str
    x: float
    y: float
    kind: str  # class of its colour


def scatter(dots: Sequence[Dot], words: str, x_words: str, y_words: str, size: tuple[float, float] = SIZE) -> Markup:
    """Named dots, their value of y in the name; each name stands where it covers no other."""
    across = _Axis.of([dot.x for dot in dots if dot.x > 0] or [1.0], 5)
    up = _Axis.of([1.0, *(dot.y for dot in dots)], 3, zero=True)
    left, right, top, bottom = _plot(size)
    parts = _axes(across, up, x_words, y_words, size)
    places = [(left + across.share(dot.x) * (right - left), bottom - up.share(dot.y) * (bottom - top)) for dot in dots]
    taken = [(x - 6, y - 6, x + 6, y + 6) for x, y in places]
    for dot, (x, y) in zip(dots, places, strict=True):
        parts.append(element("circle", class_=f"dot {dot.kind}", cx=f"{x:.1f}", cy=f"{y:.1f}", r=5.5))
        name = f"{dot.label}: {round(dot.y, 1):g}"
        free = _free(taken, x, y, LETTER * len(name), size)
        if free is not None:
            taken.append(free)
            parts.append(element("text", name, class_="lb", x=f"{free[0]:.1f}", y=f"{free[3] - 3:.1f}"))
    said = f"{words}: {', '.join(f'{dot.label} {dot.y:g} at {dot.x:.2g}' for dot in dots)}"
    return _svg(parts, said, size)


@dataclass(frozen=True)
class _Axis:
    """Ticks of an axis, and where a value stands between the first and the last."""

    ticks: Sequence[float]
    scale: Callable[[float], float]

    @staticmethod
    def of(values: Sequence[float], most: int, *, zero: bool = False) -> "_Axis":
        """An axis from 0, or a logarithmic one where the values are far apart; with ``zero`` that has a 0 too."""
        smallest, largest = min(value for value in values if value > 0), max(values)
        if largest <= SPREAD * smallest:
            return _Axis(_ticks(largest, most), float)
        if zero:
            return _Axis([0.0, *_decades(1.0, largest)], log1p)
        ticks = _decades(smallest, largest)
        return _Axis(ticks, lambda value: log10(max(value, ticks[0])))

    def share(self, value: float) -> float:
        """Where a value stands, 0 to 1."""
        first, last = self.scale(self.ticks[0]), self.scale(self.ticks[-1])
        return (self.scale(value) - first) / (last - first)


def _plot(size: tuple[float, float]) -> tuple[float, float, float, float]:
    """Left, right, top and bottom of the plot in a chart."""
    return 34.0, size[0] - 18.0, 22.0, size[1] - 38.0


def _axes(across: _Axis, up: _Axis, x_words: str, y_words: str, size: tuple[float, float]) -> list[Markup]:
    """Grid lines, ticks and what both axes are."""
    left, right, top, bottom = _plot(size)
    parts = []
    for tick in up.ticks:
        y = bottom - up.share(tick) * (bottom - top)
        parts.append(element("path", class_="grid", d=f"M{left:g} {y:.1f}H{right:g}"))
        parts.append(element("text", f"{tick:g}", class_="t r", x=left - 7, y=f"{y + 4:.1f}"))
    for tick in across.ticks:
        x = left + across.share(tick) * (right - left)
        parts.append(element("text", f"{tick:g}", class_="t m", x=f"{x:.1f}", y=bottom + 17))
    parts.append(element("text", y_words, class_="t", x=left, y=11))
    parts.append(element("text", x_words, class_="t r", x=right, y=bottom + 34))
    return parts


def _svg(parts: Sequence[Markup], words: str, size: tuple[float, float]) -> Markup:
    return element("svg", *parts, class_="sc", viewBox=f"0 0 {size[0]:g} {size[1]:g}", role="img", aria_label=words)


Box = tuple[float, float, float, float]


def _free(taken: Sequence[Box], x: float, y: float, wide: float, size: tuple[float, float]) -> Box | None:
    """The first box beside a dot that covers no other and lies in the plot."""
    places = ((x + 10, y - 8), (x - 10 - wide, y - 8), (x - wide / 2, y - 24), (x + 6, y - 22), (x - wide - 4, y - 22))
    for left, top in places:
        box = (left, top, left + wide, top + 15)
        inside = left >= _plot(size)[0] and box[2] <= size[0] and top >= 0
        if inside and not any(a < box[2] and left < c and b < box[3] and top < d for a, b, c, d in taken):
            return box
    return None


def _ticks(largest: float, most: int, smallest: float = 0.0) -> list[float]:
    """Round numbers from the last that is not above the smallest value to the first that is not below the largest."""
    rough = (largest - smallest) / most
    power = 10.0 ** floor(log10(rough))
    step = next(power * k for k in (1, 2, 2.5, 5, 10) if power * k >= rough * 0.999)
    return [step * k for k in range(floor(smallest / step), ceil(largest / step - 1e-9) + 1)]


def _decades(smallest: float, largest: float) -> list[float]:
    return [10.0**k for k in range(floor(log10(smallest)), ceil(log10(largest) - 1e-9) + 1)]


def lane(spans: Mapping[str, Iterable[Span]], window: Span, words: str, mark: float | None = None) -> Markup:
    """Stretches of each kind on one line, and a mark at the moment of the picture.

    A stretch that is too short to be seen is a line of fixed width.
    """
    start, end = window
    whole = max(end - start, 1e-6)
    parts = []
    for kind in KINDS:
        found = list(_joined(spans.get(kind, ()), window, whole / NEIGHBOURS))
        if found:
            boxes = "".join(f"M{a - start:.3f} 0H{b - start:.3f}V20H{a - start:.3f}Z" for a, b in found)
            ticks = "".join(f"M{(a + b) / 2 - start:.3f} 0V20" for a, b in found if b - a < whole / 300)
            parts += [element("path", class_=kind, d=boxes), element("path", class_=f"{kind} tick", d=ticks)]
    if mark is not None:
        parts.append(element("path", class_="now", d=f"M{mark - start:.3f} 0V20"))
    return element(
        "svg", *parts, class_="lane", viewBox=f"0 0 {whole:.3f} 20", preserveAspectRatio="none", role="img",
        aria_label=words,
    )  # fmt: skip


def _joined(spans: Iterable[Span], window: Span, apart: float) -> Iterator[Span]:
    """Sorted stretches within a window, those joined that are hardly apart."""
    before: Span | None = None
    for start, end in sorted(spans):
        start, end = max(start, window[0]), min(end, window[1])
        if end <= start:
            continue
        if before is not None and start - before[1] <= apart:
            before = before[0], max(before[1], end)
            continue
        if before is not None:
            yield before
        before = start, end
    if before is not None:
        yield before


def ruler(start: float, end: float) -> Markup:
    """Seconds below a lane."""
    length = max(end - start, 1e-6)
    ticks = [tick for tick in _ticks(length, 6) if tick < 0.94 * length]
    marks = [(tick, f"{start + tick:.4g}") for tick in ticks] + [
        (length, f"{end:.0f} s" if length > 20 else f"{end:.4g} s")
    ]
    return element(
        "div", *(element("span", name, style=f"left:{100 * at / length:.2f}%") for at, name in marks), class_="ticks"
    )


def legend(kinds: Sequence[str], mark: bool) -> Markup:
    """What the colours of lanes mean."""
    keys = [element("span", element("i", class_=f"k {kind}"), KIND_WORDS[kind]) for kind in kinds]
    if mark:
        keys.append(element("span", element("i", class_="k now"), "the picture"))
    return element("p", *keys, class_="leg")


def curve(
    points: Sequence[tuple[float, float]],
    ends: Sequence[float],
    words: str,
    x_words: str,
    y_words: str,
    lowest: float = 0.0,
) -> Markup:
    """A curve over linear axes, with a vertical line at each end point; ``lowest`` is where the upright axis begins."""
    left, right, top, bottom = _plot(SIZE)
    xs, ys = zip(*points, strict=True)
    across = _Axis(_ticks(max(*xs, 1e-9), 5), float)
    up = _Axis(_ticks(max(*ys, lowest + 1e-9), 3, lowest), float)

    def x_of(x: float) -> str:
        return f"{left + across.share(x) * (right - left):.1f}"

    places = [(x_of(x), f"{bottom - up.share(y) * (bottom - top):.1f}") for x, y in points]
    # What lies between two points of its height adds nothing.
    turns = [
        place
        for at, place in enumerate(places)
        if not 0 < at < len(places) - 1 or {places[at - 1][1], places[at + 1][1]} != {place[1]}
    ]
    path = "L".join(dict.fromkeys(f"{x} {y}" for x, y in turns))
    parts = [element("path", class_="curve", d=f"M{path}")]
    parts += [element("path", class_="end", d=f"M{x_of(end)} {top}V{bottom}") for end in ends]
    drawing = _svg([*parts, *_axes(across, up, x_words, y_words, SIZE)], words, SIZE)
    return element("figure", joined([drawing, element("figcaption", words)]), class_="plot")
