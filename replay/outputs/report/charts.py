"""Charts of a run as SVG that lies in the page: who touched when, and what each frame took."""

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
from replay.outputs.report.markup import Markup, bar, element
from replay.outputs.words import counted
from replay.pipeline.run_result import RunResult
from replay.pipeline.summary import frame_seconds
from sessions.doctor.runs import runs

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


def timeline(result: RunResult, label: str) -> Markup:
    """A lane per pair in the words of the audit, worst first; numbers of misses above."""
    outcome = result.comparisons[label].outcome
    ranked = ranked_pairs(result.comparisons[label], result.assembly.held)
    pairs, rest = ranked[:MOST_LANES], len(ranked) - MOST_LANES
    height = TOP + LANE * (len(pairs) + 1) + 20
    times = result.assembly.motion.times
    parts = [_ruler(times, height), *_numbers(result, label)]
    for row, pair in enumerate(pairs, start=1):
        y = TOP + LANE * row
        parts.append(element("text", result.assembly.pair_name(pair), x=0, y=y + 15, class_="lane"))
        parts += lane_bars(outcome[:, pair], times, y + 3)
    span = f"{counted(len(pairs), 'pair')} over {float(times[-1] - times[0]):.0f} seconds"
    words = f"{span}, as {label} compares with {result.oracle}"
    more = f" In the tables: {counted(rest, 'more pair')}." if rest > 0 else ""
    if any(int((np.diff(outcome[:, pair].astype(np.int16)) != 0).sum()) > MOST_BARS for pair in pairs):
        more += " Where stretches are too many to tell apart, height is their share of the frames."
    svg = element("svg", *parts, viewBox=f"0 0 {WIDTH} {height}", role="img", aria_label=words)
    return element("figure", _legend(), svg, element("figcaption", words + "." + more), tabindex=0)


def _place(times: NDArray[np.float64], at: float) -> float:
    span = float(times[-1] - times[0]) or 1.0
    return LABEL + (WIDTH - RIGHT - LABEL) * (at - float(times[0])) / span


def _ruler(times: NDArray[np.float64], height: int) -> Markup:
    span = float(times[-1] - times[0]) or 1.0
    step = 10.0 ** np.floor(np.log10(span / 4))
    step = float(next(step * k for k in (1, 2, 5, 10) if span / (step * k) <= 8))
    ticks = []
    for k in range(int(span / step) + 1):
        x = _place(times, float(times[0]) + k * step)
        ticks.append(element("line", x1=f"{x:.1f}", x2=f"{x:.1f}", y1=TOP, y2=height - 20, class_="tick"))
        ticks.append(element("text", f"{k * step:g} s", x=f"{x:.1f}", y=height - 5, class_="tick"))
    return Markup("".join(ticks))


def _numbers(result: RunResult, label: str) -> list[Markup]:
    """Where misses are; numbers that would overlap share a box: ``12-31``."""
    times = result.assembly.motion.times
    found = [element("text", "missed", x=0, y=TOP + 15, class_="lane")]
    span = round(float(times[-1] - times[0]) * 1e9) or 1
    by_number = {miss.number: miss for miss in result.misses[label]}
    for words, start, end in number_boxes(result.misses[label], span, BOX, DIGIT):
        x, after = _place(times, start / 1e9), _place(times, end / 1e9)
        one = by_number.get(int(words)) if words.isdigit() else None
        hint = f"misses {words}" if one is None else f"miss {words}: {one.body_a}-{one.body_b}, {one.seconds:.3f} s"
        found += [
            bar(hint, x, TOP + 2, after - x - 1, 18, class_="missed"),
            element("text", words, x=f"{(x + after) / 2:.1f}", y=TOP + 16, class_="miss"),
        ]
    return found


SPOKEN: Final = (
    Outcome.MISSED, Outcome.INVENTED, Outcome.BETWEEN_FRAMES, Outcome.WITHIN_TOLERANCE, Outcome.BOTH,
    Outcome.HELD,
)  # fmt: skip
"""Outcomes with a colour, in the order in which they are stacked, from the top."""


def lane_bars(outcome: NDArray[np.uint8], times: NDArray[np.float64], y: int) -> list[Markup]:
    """The bars of one pair with its outcome (T,) below the edge ``y``: stretches, or shares where they are too many."""
    changes = int((np.diff(outcome.astype(np.int16)) != 0).sum())
    if changes > MOST_BARS:
        return _shares(outcome, times, y)
    # Misses last: widened to be seen, they must not be hidden by what follows.
    return [one for word in reversed(SPOKEN) for one in _bars(outcome == word, times, y, word)]


def _shares(outcome: NDArray[np.uint8], times: NDArray[np.float64], y: int) -> list[Markup]:
    """Stretches of ``STRETCH`` points, filled from the top with the shares of their frames; equal neighbours join."""
    span = float(times[-1] - times[0]) or 1.0
    count = int((WIDTH - RIGHT - LABEL) / STRETCH)
    place = np.minimum(((times - times[0]) / span * count).astype(np.int64), count - 1)
    seen = np.stack([np.bincount(place[outcome == word], minlength=count) for word in SPOKEN], axis=1)
    whole = np.maximum(np.bincount(place, minlength=count), 1)[:, None]
    tall = np.round((LANE - 6) * np.cumsum(seen, axis=1) / whole).astype(np.int64)
    # A miss among a hundred frames keeps a point of height: the lane exists to show it.
    tall[:, 0] = np.where(seen[:, 0] > 0, np.maximum(tall[:, 0], 1), 0)
    tall = np.maximum.accumulate(tall, axis=1)
    starts = np.flatnonzero(np.append(True, (np.diff(tall, axis=0) != 0).any(axis=1)))
    bars = []
    for first, after in zip(starts.tolist(), [*starts[1:].tolist(), count], strict=True):
        top = 0
        for k, word in enumerate(SPOKEN):
            high = int(tall[first, k]) - top
            if high > 0:
                name, colour = OUTCOMES[word]
                frames = int(seen[first:after, k].sum())
                words = f"{name}: {frames} of {int(whole[first:after].sum())} frames"
                x, width = LABEL + STRETCH * first, STRETCH * (after - first)
                bars.append(bar(words, x, y + top, width, high, fill=hex_of(colour)))
            top += max(high, 0)
    return bars


def _bars(active: NDArray[np.bool_], times: NDArray[np.float64], y: int, word: Outcome) -> list[Markup]:
    name, colour = OUTCOMES[word]
    bars = []
    for first, last in runs(active).tolist():
        start, end = float(times[first]), float(times[min(last + 1, len(times) - 1)])
        x = _place(times, start)
        width = max(SMALLEST, _place(times, end) - x)
        words = f"{name}: {start:.3f} s, {last + 1 - first} frames"
        bars.append(bar(words, x, y, width, LANE - 6, fill=hex_of(colour)))
    return bars


def _legend() -> Markup:
    keys = [
        element("span", Markup(f'<i style="background:{hex_of(OUTCOMES[word][1])}"></i>'), OUTCOMES[word][0])
        for word in SPOKEN
    ]
    return element("p", *keys, class_="legend")


def timing(result: RunResult) -> Markup:
    """Milliseconds of every frame on a log axis, most of each stretch kept; detectors of the whole motion as lines."""
    svg = svg_in_page(11, 3.4, "Time per frame", lambda axes: _draw_timing(axes, result))
    words = element("figcaption", "What each frame took, in milliseconds on a log axis.")
    return element("figure", svg, words, tabindex=0)


def _draw_timing(axes: "Axes", result: RunResult) -> None:
    for (label, detection), colour in zip(result.detections.items(), cycle(SERIES), strict=False):
        seconds = frame_seconds(detection)
        if seconds is not None and len(seconds):
            x, y = _peaks(result.assembly.motion.times, seconds * 1e3)
            axes.plot(x, y, color=hex_of(colour), lw=0.9, label=f"{label}, frame by frame (peaks)")
        else:
            mean = result.summary["detectors"][label]["seconds"]["per_frame_mean"] * 1e3
            axes.axhline(mean, color=hex_of(colour), lw=1.4, label=f"{label}, mean of the whole motion at once")
    axes.axhline(BUDGET_MS, color=INK, lw=1.0, ls="--", label=f"{ONE_FRAME}, {BUDGET_MS:.1f} ms")
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.set_xlabel("session time, s")
    axes.set_ylabel("ms per frame")
    # Above the plot: inside it, it would lie on the peaks that the plot exists to show.
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, fontsize=8, frameon=False)
    axes.grid(True, which="major", alpha=0.25)
    axes.set_xlim(float(result.assembly.motion.times[0]), float(result.assembly.motion.times[-1]))


def titration_pictures(result: RunResult) -> list[Markup]:
    """The pH of each vessel that was titrated over what came in, with a line at its end point."""
    curves = titration_curves(result.effects)
    return [_titration(shown(vessel), *curve) for vessel, curve in curves.items()]


def _titration(vessel: str, added: FloatArray, ph: FloatArray, end: float | None) -> Markup:
    def draw(axes: "Axes") -> None:
        axes.plot(added, ph, color=hex_of(SERIES[0]), lw=1.4)
        axes.set_xlabel("came in, mL")
        axes.set_ylabel("pH")
        axes.grid(True, alpha=0.25)
        if end is not None:
            axes.axvline(end, color=INK, lw=1.0, ls="--")

    words = f"The pH in {vessel} over what came in"
    told = f"{words}; the line is its end point, {end:.2f} mL." if end is not None else f"{words}."
    return element("figure", svg_in_page(7, 3.4, words, draw), element("figcaption", told), tabindex=0)


def _peaks(times: NDArray[np.float64], values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """At most ``BINS`` points, each the largest of its stretch."""
    size = max(1, -(-len(values) // BINS))
    starts = np.arange(0, len(values), size)
    # A log axis has no place for 0 ms.
    return times[starts], np.maximum(np.maximum.reduceat(values, starts), 1e-4)
