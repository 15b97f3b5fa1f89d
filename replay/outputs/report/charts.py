"""Charts of a run as SVG that lies in the page: who touched when, and what each frame took."""

from collections.abc import Iterator
from itertools import cycle
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from replay.base.constants import BUDGET_MS, ONE_FRAME
from replay.base.shown import shown
from replay.comparison.outcome import Outcome
from replay.effects.effect_summary import titration_curves
from replay.effects.output import FloatArray
from replay.outputs.lanes import number_boxes, ranked_pairs
from replay.outputs.palette import OUTCOMES, SERIES, hex_of
from replay.outputs.report.drawing import INK, svg_in_page
from replay.outputs.report.markup import Markup, element, figure, joined
from replay.outputs.words import counted
from replay.pipeline.run_result import RunResult
from replay.pipeline.summary import frame_seconds

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDTH, LABEL, LANE, TOP, RIGHT = 1100, 190, 26, 22, 60
SMALLEST: Final = 2.0
"""Points a mark is wide at least: a contact of 11 ms in a minute would be a fifth of one."""

MOST_BARS: Final = 200
"""Bars that lie beside each other in a lane; more are drawn as shares of each stretch, or the last would hide all."""

STRETCH: Final = 4.0
"""Points of such a stretch."""

BOX, DIGIT = 0.012, 0.009
"""Shares of the width that the box of a number takes, and each digit in it."""

MOST_LANES: Final = 20
BINS: Final = 800

SPOKEN: Final = (
    Outcome.MISSED, Outcome.INVENTED, Outcome.BETWEEN_FRAMES, Outcome.WITHIN_TOLERANCE, Outcome.BOTH,
    Outcome.HELD,
)  # fmt: skip
"""Outcomes with a colour, in the order in which they are stacked, from the top."""


def timeline(result: RunResult, label: str) -> Markup:
    """A lane per pair in the words of the audit, worst first; numbers of misses above."""
    outcome, times = result.comparisons[label].outcome, result.assembly.motion.times
    ranked = ranked_pairs(result.comparisons[label], result.assembly.held)
    pairs, rest = ranked[:MOST_LANES], len(ranked) - MOST_LANES
    height = TOP + LANE * (len(pairs) + 1) + 20
    parts = [*_ruler(times, height), *_numbers(result, label)]
    for y, pair in enumerate(pairs, start=1):
        parts.append(element("text", result.assembly.pair_name(pair), x=0, y=TOP + LANE * y + 15, class_="lane"))
        parts += lane_bars(outcome[:, pair], times, TOP + LANE * y + 3)
    span = f"{counted(len(pairs), 'pair')} over {float(times[-1] - times[0]):.0f} seconds"
    words = f"{span}, as {label} compares with {result.oracle}"
    more = f" In the tables: {counted(rest, 'more pair')}." if rest > 0 else ""
    if any(_changes(outcome[:, pair]) > MOST_BARS for pair in pairs):
        more += " Where stretches are too many to tell apart, height is their share of the frames."
    svg = element("svg", *parts, viewBox=f"0 0 {WIDTH} {height}", role="img", aria_label=words)
    keys = (element("span", element("i", style=f"background:{hex_of(colour)}"), name)
            for name, colour in (OUTCOMES[one] for one in SPOKEN))  # fmt: skip
    return figure(joined([element("p", *keys, class_="legend"), svg]), f"{words}.{more}")


def _bar(title: str, x: float, y: float, width: float, height: float, **more: object) -> Markup:
    """A rectangle that says what it is when pointed at."""
    at = {"x": f"{x:.1f}", "y": f"{y:g}", "width": f"{width:.1f}", "height": f"{height:g}"}
    return element("rect", element("title", title), **at, **more)


def _changes(outcome: NDArray[np.uint8]) -> int:
    return int((np.diff(outcome.astype(np.int16)) != 0).sum())


def _place(times: NDArray[np.float64], at: float) -> float:
    return LABEL + (WIDTH - RIGHT - LABEL) * (at - float(times[0])) / (float(times[-1] - times[0]) or 1.0)


def _ruler(times: NDArray[np.float64], height: int) -> Iterator[Markup]:
    span = float(times[-1] - times[0]) or 1.0
    step = 10.0 ** np.floor(np.log10(span / 4))
    step = float(next(step * k for k in (1, 2, 5, 10) if span / (step * k) <= 8))
    for k in range(int(span / step) + 1):
        x = f"{_place(times, float(times[0]) + k * step):.1f}"
        yield element("line", x1=x, x2=x, y1=TOP, y2=height - 20, class_="tick")
        yield element("text", f"{k * step:g} s", x=x, y=height - 5, class_="tick")


def _numbers(result: RunResult, label: str) -> Iterator[Markup]:
    """Where misses are; numbers that would overlap share a box: ``12-31``."""
    times, by_number = result.assembly.motion.times, {str(miss.number): miss for miss in result.misses[label]}
    yield element("text", "missed", x=0, y=TOP + 15, class_="lane")
    span = round(float(times[-1] - times[0]) * 1e9) or 1
    for words, start, end in number_boxes(result.misses[label], span, BOX, DIGIT):
        x, after, one = _place(times, start / 1e9), _place(times, end / 1e9), by_number.get(words)
        hint = f"misses {words}" if one is None else f"miss {words}: {one.body_a}-{one.body_b}, {one.seconds:.3f} s"
        yield _bar(hint, x, TOP + 2, after - x - 1, 18, class_="missed")
        yield element("text", words, x=f"{(x + after) / 2:.1f}", y=TOP + 16, class_="miss")


def lane_bars(outcome: NDArray[np.uint8], times: NDArray[np.float64], y: int) -> list[Markup]:
    """The bars of one pair with its outcome (T,) below the edge ``y``: stretches, or shares where they are too many.

    A column is a frame, or ``STRETCH`` points, filled from the top with the shares of its frames; equal neighbours
    are one bar.
    """
    place, edges = np.arange(len(times)), np.append(times, times[-1])
    if _changes(outcome) > MOST_BARS:
        count, span = int((WIDTH - RIGHT - LABEL) / STRETCH), float(times[-1] - times[0])
        place = np.minimum(((times - times[0]) / span * count).astype(np.int64), count - 1)
        edges = times[0] + span * np.arange(count + 1) * STRETCH / (WIDTH - RIGHT - LABEL)
    columns = len(edges) - 1
    seen = np.stack([np.bincount(place[outcome == word], minlength=columns) for word in SPOKEN], axis=1)
    whole = np.maximum(np.bincount(place, minlength=columns), 1)
    tall = np.round((LANE - 6) * np.cumsum(seen, axis=1) / whole[:, None]).astype(np.int64)
    # A miss among a hundred frames keeps a point of height: the lane exists to show it.
    tall[:, 0] = np.where(seen[:, 0] > 0, np.maximum(tall[:, 0], 1), 0)
    tall = np.maximum.accumulate(tall, axis=1)
    starts = np.flatnonzero(np.append(True, (np.diff(tall, axis=0) != 0).any(axis=1)))
    ends, bars = np.append(starts[1:], columns), []
    # Misses last: widened to be seen, they must not be hidden by what follows.
    for k in reversed(range(len(SPOKEN))):
        top = tall[starts, k - 1] if k else np.zeros(len(starts), dtype=np.int64)
        for one in np.flatnonzero(tall[starts, k] > top).tolist():
            first, after, (name, colour) = starts[one], ends[one], OUTCOMES[SPOKEN[k]]
            frames, of = int(seen[first:after, k].sum()), int(whole[first:after].sum())
            x, end = (_place(times, float(edges[at])) for at in (first, after))
            words = f"{name}: {edges[first]:.3f} s, {frames} {f'of {of} ' if frames < of else ''}frames"
            high = int(tall[starts[one], k] - top[one])
            bars.append(_bar(words, x, y + int(top[one]), max(SMALLEST, end - x), high, fill=hex_of(colour)))
    return bars


def timing(result: RunResult) -> Markup:
    """Milliseconds of every frame on a log axis, most of each stretch kept; detectors of the whole motion as lines."""
    svg = svg_in_page(11, 3.4, "Time per frame", lambda axes: _draw_timing(axes, result))
    return figure(svg, "What each frame took, in milliseconds on a log axis.")


def _draw_timing(axes: "Axes", result: RunResult) -> None:
    times = result.assembly.motion.times
    for (label, detection), colour in zip(result.detections.items(), cycle(SERIES), strict=False):
        seconds = frame_seconds(detection)
        if seconds is not None and len(seconds):
            starts = np.arange(0, len(seconds), max(1, -(-len(seconds) // BINS)))
            # A log axis has no place for 0 ms.
            peaks = np.maximum(np.maximum.reduceat(seconds * 1e3, starts), 1e-4)
            axes.plot(times[starts], peaks, color=hex_of(colour), lw=0.9, label=f"{label}, frame by frame (peaks)")
        else:
            mean = result.summary["detectors"][label]["seconds"]["per_frame_mean"] * 1e3
            axes.axhline(mean, color=hex_of(colour), lw=1.4, label=f"{label}, mean of the whole motion at once")
    axes.axhline(BUDGET_MS, color=INK, lw=1.0, ls="--", label=f"{ONE_FRAME}, {BUDGET_MS:.1f} ms")
    axes.set(yscale="log", xlabel="session time, s", ylabel="ms per frame", xlim=(float(times[0]), float(times[-1])))
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    # Above the plot: inside it, it would lie on the peaks that the plot exists to show.
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, fontsize=8, frameon=False)
    axes.grid(True, which="major", alpha=0.25)


def titration_pictures(result: RunResult) -> list[Markup]:
    """The pH of each vessel that was titrated over what came in, with a line at each end point."""
    curves = titration_curves(result.effects)
    return [_titration(shown(vessel), *curve) for vessel, curve in curves.items()]


def _titration(vessel: str, added: FloatArray, ph: FloatArray, ends: list[float]) -> Markup:
    def draw(axes: "Axes") -> None:
        axes.plot(added, ph, color=hex_of(SERIES[0]), lw=1.4)
        axes.set_xlabel("came in, mL")
        axes.set_ylabel("pH")
        axes.grid(True, alpha=0.25)
        for end in ends:
            axes.axvline(end, color=INK, lw=1.0, ls="--")

    words = f"The pH in {vessel} over what came in"
    told = f"{words}."
    if len(ends) == 1:
        told = f"{words}; the line is its end point, {ends[0]:.2f} mL."
    elif ends:
        told = f"{words}; the lines are its end points, {' and '.join(f'{end:.2f}' for end in ends)} mL."
    return figure(svg_in_page(7, 3.4, words, draw), told)
