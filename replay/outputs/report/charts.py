"""Charts as SVG that lies in the page: accuracy against cost, when what happened, and curves of effects."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import ceil, floor, log10
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
PLOT: Final = (34.0, 414.0, 22.0, 142.0)
"""Left, right, top and bottom of a plot."""

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


def scatter(dots: Sequence[Dot], words: str, x_words: str, y_words: str) -> Markup:
    """Named dots, their value of y in the name; each name stands where it covers no other."""
    left, right, top, bottom = PLOT
    xs = [dot.x for dot in dots if dot.x > 0] or [1.0]
    logarithmic = max(xs) > SPREAD * min(xs)
    x_ticks = _decades(min(xs), max(xs)) if logarithmic else _ticks(max(xs), 5)
    y_ticks = _ticks(max([1.0, *(dot.y for dot in dots)]), 3)

    def place(dot: Dot) -> tuple[float, float]:
        share = dot.x / x_ticks[-1]
        if logarithmic:
            share = log10(max(dot.x, x_ticks[0]) / x_ticks[0]) / log10(x_ticks[-1] / x_ticks[0])
        return left + share * (right - left), bottom - dot.y / y_ticks[-1] * (bottom - top)

    parts = []
    for tick in y_ticks:
        y = bottom - tick / y_ticks[-1] * (bottom - top)
        parts.append(element("path", class_="grid", d=f"M{left:g} {y:.1f}H{right:g}"))
        parts.append(element("text", f"{tick:g}", class_="t r", x=left - 7, y=f"{y + 4:.1f}"))
    for tick in x_ticks:
        parts.append(
            element("text", f"{tick:g}", class_="t m", x=f"{place(Dot('', tick, 0, ''))[0]:.1f}", y=bottom + 17)
        )
    parts.append(element("text", y_words, class_="t", x=left, y=11))
    parts.append(element("text", x_words, class_="t r", x=right, y=bottom + 34))
    places = [place(dot) for dot in dots]
    taken = [(x - 6, y - 6, x + 6, y + 6) for x, y in places]
    for dot, (x, y) in zip(dots, places, strict=True):
        parts.append(element("circle", class_=f"dot {dot.kind}", cx=f"{x:.1f}", cy=f"{y:.1f}", r=5.5))
        name = f"{dot.label}: {dot.y:g}"
        free = _free(taken, x, y, LETTER * len(name))
        if free is not None:
            taken.append(free)
            parts.append(element("text", name, class_="lb", x=f"{free[0]:.1f}", y=f"{free[3] - 3:.1f}"))
    said = f"{words}: {', '.join(f'{dot.label} {dot.y:g} at {dot.x:.2g}' for dot in dots)}"
    return element(
        "svg", *parts, class_="sc", viewBox=f"0 0 {SIZE[0]:g} {SIZE[1]:g}", role="img", aria_label=said,
    )  # fmt: skip


Box = tuple[float, float, float, float]


def _free(taken: Sequence[Box], x: float, y: float, wide: float) -> Box | None:
    """The first box beside a dot that covers no other and lies in the plot."""
    places = ((x + 10, y - 8), (x - 10 - wide, y - 8), (x - wide / 2, y - 24), (x + 6, y - 22), (x - wide - 4, y - 22))
    for left, top in places:
        box = (left, top, left + wide, top + 15)
        inside = left >= PLOT[0] and box[2] <= SIZE[0] and top >= 0
        covers = any(a < box[2] and left < c and b < box[3] and top < d for a, b, c, d in taken)
        if inside and not covers:
            return box
    return None


def _ticks(largest: float, most: int) -> list[float]:
    """Round numbers from 0 to the first that is not below the largest value."""
    rough = largest / most
    power = 10.0 ** floor(log10(rough))
    step = next(power * k for k in (1, 2, 2.5, 5, 10) if power * k >= rough * 0.999)
    return [step * k for k in range(ceil(largest / step - 1e-9) + 1)]


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
    points: Sequence[tuple[float, float]], ends: Sequence[float], words: str, x_words: str, y_words: str
) -> Markup:
    """A curve over a linear axis, with a vertical line at each end point."""
    left, right, top, bottom = PLOT
    xs, ys = zip(*points, strict=True)
    x_ticks, y_ticks = _ticks(max(*xs, 1e-9), 5), _ticks(max(*ys, 1e-9), 3)
    across, up = (right - left) / x_ticks[-1], (bottom - top) / y_ticks[-1]
    step = 1 + len(points) // 800
    path = "L".join(f"{left + x * across:.1f} {bottom - y * up:.1f}" for x, y in points[::step])
    parts = [element("path", class_="curve", d=f"M{path}")]
    parts += [element("path", class_="end", d=f"M{left + end * across:.1f} {top}V{bottom}") for end in ends]
    parts += [element("text", f"{x:g}", class_="t m", x=f"{left + x * across:.1f}", y=bottom + 17) for x in x_ticks]
    for tick in y_ticks:
        parts.append(element("path", class_="grid", d=f"M{left} {bottom - tick * up:.1f}H{right}"))
        parts.append(element("text", f"{tick:g}", class_="t r", x=left - 7, y=f"{bottom - tick * up + 4:.1f}"))
    parts.append(element("text", y_words, class_="t", x=left, y=11))
    parts.append(element("text", x_words, class_="t r", x=right, y=bottom + 34))
    drawing = element("svg", *parts, class_="sc", viewBox=f"0 0 {SIZE[0]:g} {SIZE[1]:g}", role="img", aria_label=words)
    return element("figure", joined([drawing, element("figcaption", words)]), class_="plot")
