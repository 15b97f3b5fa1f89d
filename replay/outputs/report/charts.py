"""Charts as SVG that lies in the page: plots, and when what happened."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Final

from replay.outputs.plots import Plot, Point, ticks_of
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


def drawn(plot: Plot) -> Markup:
    """A plot as SVG."""
    parts = [element("path", class_=kind, d=_path(corners)) for kind, corners in plot.lines]
    parts += [
        element("circle", class_=f"dot {kind}", cx=f"{x:.1f}", cy=f"{y:.1f}", r=5.5) for kind, (x, y) in plot.dots
    ]
    for words in plot.words:
        kind = "lb" if words.dot >= 0 else "t"
        x, y = words.at
        parts.append(
            element(
                "text", words.text, class_=f"{kind} {words.side}".removesuffix(" start"), x=f"{x:.1f}", y=f"{y:.1f}"
            )
        )
    box = f"0 0 {plot.size[0]:g} {plot.size[1]:g}"
    return element("svg", *parts, class_="sc", viewBox=box, role="img", aria_label=plot.said)


def _path(corners: Sequence[Point]) -> str:
    """Corners as a path; what lies between two of its height adds nothing."""
    places = [(f"{x:.1f}", f"{y:.1f}") for x, y in corners]
    turns = [
        place
        for at, place in enumerate(places)
        if not 0 < at < len(places) - 1 or {places[at - 1][1], places[at + 1][1]} != {place[1]}
    ]
    return f"M{'L'.join(dict.fromkeys(f'{x} {y}' for x, y in turns))}"


def curve_figure(plot: Plot) -> Markup:
    """A curve above what it says."""
    return element("figure", joined([drawn(plot), element("figcaption", plot.said)]), class_="plot")


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
    ticks = [tick for tick in ticks_of(length, 6) if tick < 0.94 * length]
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
