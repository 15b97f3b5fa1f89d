"""Data of the charts of a page: corners of plots, and events with their times."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from replay.show.plots import Point, ticks_of
from replay.words import number

TimeSpan = tuple[float, float]
"""Seconds from start to end."""

INTERVAL_KINDS: Final = ("false", "right", "late", "missed", "reference", "contact")
"""Kinds of stretches in a lane, in the order in which they are painted."""

KIND_LABELS: Final = {
    "reference": "reference",
    "contact": "contact",
    "right": "right",
    "missed": "missed",
    "late": "late or cut short",
    "false": "false",
}

MOST_BOXES: Final = 4000
"""Intervals of a kind in a lane; where there are more, neighbours are painted as one."""

LANE_DIVISIONS: Final = 2000
"""Intervals nearer to each other than this part of such a lane are painted as one."""


def path_of(corners: Sequence[Point]) -> str:
    """Corners as a path; what lies between two of its height adds nothing."""
    points = [(f"{x:.1f}", f"{y:.1f}") for x, y in corners]
    bend_points = [
        point
        for point_number, point in enumerate(points)
        if not 0 < point_number < len(points) - 1
        or {points[point_number - 1][1], points[point_number + 1][1]} != {point[1]}
    ]
    return f"M{'L'.join(dict.fromkeys(f'{x} {y}' for x, y in bend_points))}"


@dataclass(frozen=True)
class Lane:
    """Stretches on one line, as long as a window: kind and path of each, and words for those who cannot see it."""

    words: str
    length: float
    paths: list[tuple[str, str]]


def lane(
    spans_of_kind: Mapping[str, Iterable[TimeSpan]], window: TimeSpan, label: str, marked_second: float | None = None
) -> Lane:
    """Stretches of each kind on one line, and a mark at the moment of the picture.

    A stretch that is too short to be seen is a line of fixed width.
    """
    start, end = window
    window_length = max(end - start, 1e-6)
    paths = []
    for kind in INTERVAL_KINDS:
        all_spans = list(spans_of_kind.get(kind, ()))
        intervals = list(
            _merged_spans(all_spans, window, window_length / LANE_DIVISIONS if len(all_spans) > MOST_BOXES else 0.0)
        )
        if intervals:
            boxes = "".join(f"M{a - start:.3f} 0H{b - start:.3f}V20H{a - start:.3f}Z" for a, b in intervals)
            ticks = "".join(f"M{(a + b) / 2 - start:.3f} 0V20" for a, b in intervals if b - a < window_length / 300)
            paths += [(kind, boxes), (f"{kind} tick", ticks)]
    if marked_second is not None:
        paths.append(("now", f"M{marked_second - start:.3f} 0V20"))
    return Lane(label, window_length, paths)


def _merged_spans(spans: Iterable[TimeSpan], window: TimeSpan, gap: float) -> Iterator[TimeSpan]:
    """Sorted stretches within a window, those joined that are hardly apart."""
    previous_span: TimeSpan | None = None
    for start, end in sorted(spans):
        start, end = max(start, window[0]), min(end, window[1])
        if end <= start:
            continue
        if previous_span is not None and start - previous_span[1] <= gap:
            previous_span = previous_span[0], max(previous_span[1], end)
            continue
        if previous_span is not None:
            yield previous_span
        previous_span = start, end
    if previous_span is not None:
        yield previous_span


def ruler(start: float, end: float) -> list[tuple[float, str]]:
    """Seconds below a lane: where, in percent of it, and in words."""
    length = max(end - start, 1e-6)
    ticks = [tick for tick in ticks_of(length, 6) if tick < 0.94 * length]
    tick_labels = [(tick, number(start + tick, 4)) for tick in ticks]
    tick_labels.append((length, f"{end:.0f} s" if length > 20 else f"{number(end, 4)} s"))
    return [(100 * tick_second / length, name) for tick_second, name in tick_labels]
