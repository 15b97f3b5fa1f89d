"""Recall against time, a line per algorithm, the front drawn out and numbered.

Source: M. Aumueller, E. Bernhardsson, A. Faithfull, ANN-Benchmarks, Information Systems 87 (2020), figures 2-6.
"""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import hypot
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from replay.base.constants import BUDGET_MS, ONE_FRAME
from replay.outputs.tradeoff_table import front_rows, lines_of
from replay.pipeline.gates import figure
from replay.tradeoffs.pareto import PRECISION, Row, counts
from replay.tradeoffs.settings import AS_IT_COMES

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SIZE: Final = (12.4, 6.6)
MARKERS: Final = ("o", "s", "D", "^", "v", "P", "X", "<", ">", "h", "*")
"""One per parameter that is varied."""

PALE: Final = 0.3
"""Opacity of what is not on the front for inventing too much."""

TOP: Final = 0.003
"""Missed share below which rows stand together at the top: a bench minute has some 300 pair-frames in contact."""

RECALLS: Final = (0, 20, 50, 70, 80, 90, 95, 98, 99, 100)
APART: Final = 15.0
"""Points between the numbers of two neighbours on the front, so that both can be read."""


@dataclass(frozen=True)
class Theme:
    """Colours of background, words, lesser words, grid lines and front; ``series`` has one per algorithm.

    Colour-blind readers can tell the series apart; with more algorithms than colours they repeat.
    """

    paper: str
    ink: str
    faint: str
    grid: str
    front: str
    series: tuple[str, ...]


LIGHT: Final = Theme(
    "#FFFFFF", "#1B1F27", "#5B6472", "#E4E7EC", "#D7263D",
    (
        "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#B98500", "#7F3C8D", "#80735B", "#3D4C9E", "#A5612C",
        "#11857F", "#9B1F56", "#6B8E23",
    ),
)  # fmt: skip
DARK: Final = Theme(
    "#14171C", "#E8EAED", "#9AA3B0", "#2A2F38", "#FF5A6E",
    (
        "#4FA8E0", "#FF8A3D", "#35CFA4", "#EBA3CB", "#8FD3FF", "#F0C24B", "#BE86D1", "#B5A88B", "#8C9BEA", "#D69763",
        "#4CC9C0", "#E0679F", "#A8CC5A",
    ),
)  # fmt: skip


def picture(rows: Sequence[Row], title: str, kind: str = "png", theme: Theme = LIGHT) -> bytes:
    """The picture as ``png`` or ``svg``; no row is a ``ValueError``."""
    from matplotlib import rc_context

    out = io.BytesIO()
    how: Mapping[str, Any] = {"metadata": {"Date": None}} if kind == "svg" else {"dpi": 110}
    style: dict[Any, Any] = {"svg.hashsalt": "vrlab-replay", "text.color": theme.ink}
    style |= dict.fromkeys(("axes.labelcolor", "xtick.color", "ytick.color", "axes.edgecolor"), theme.faint)
    # The salt fixes the random names inside an SVG, so that the page that holds it is the same every time.
    with rc_context(style):
        _drawn(rows, title, theme).savefig(out, format=kind, facecolor=theme.paper, **how)
    return out.getvalue()


def _drawn(rows: Sequence[Row], title: str, theme: Theme) -> Figure:
    from matplotlib.figure import Figure

    if not rows:
        raise ValueError("there is no row to draw; run a setting first")
    figure = Figure(figsize=SIZE)
    axes = figure.add_axes((0.07, 0.09, 0.585, 0.775), facecolor=theme.paper)
    names = list(dict.fromkeys(row["detector"] for row in rows))
    colours = {name: theme.series[k % len(theme.series)] for k, name in enumerate(names)}
    turned = list(dict.fromkeys([AS_IT_COMES, *(row["axis"] for row in rows)]))
    markers = {axis: MARKERS[k % len(MARKERS)] for k, axis in enumerate(turned)}
    for points in lines_of(rows).values():
        _line(axes, points, colours[points[0]["detector"]], markers[points[0]["axis"]], theme)
    _dress(axes, rows, title, theme)
    below = _front(axes, rows, theme)
    _legend(axes, colours, markers, theme, below)
    return figure


def _line(axes: Axes, points: Sequence[Row], colour: str, marker: str, theme: Theme) -> None:
    times = [row["ms_per_frame"] for row in points]
    recall = [100 * row["recall"] for row in points]
    sure = [counts(row) or bool(row["oracle"]) for row in points]
    axes.plot(times, recall, color=colour, lw=1.1, alpha=0.7 if all(sure) else PALE, zorder=2)
    for row, time, value, full in zip(points, times, recall, sure, strict=True):
        spread = [[value - 100 * row["recall_low"]], [100 * row["recall_high"] - value]]
        seen = 1.0 if full else PALE
        axes.errorbar([time], [value], yerr=spread, fmt="none", ecolor=colour, lw=0.6, alpha=seen / 2, zorder=2)
        fill = colour if row["online"] else theme.paper
        axes.plot([time], [value], marker, color=colour, ms=6, mfc=fill, mew=1.2, alpha=seen, zorder=3)


def _front(axes: Axes, rows: Sequence[Row], theme: Theme) -> float:
    """Draw the front, number its points and list them beside the picture; return the height where the list ends."""
    front = front_rows(rows)
    heads = ("", "the front, quickest first", "ms/frame", "misses", "invents")
    height = _row_beside(axes, 1.0, heads, theme.front, bold=True)
    if not front:
        return height
    times = [row["ms_per_frame"] for row in front]
    recall = [100 * row["recall"] for row in front]
    right = axes.get_xlim()[1]
    axes.step([*times, right], [*recall, recall[-1]], where="post", color=theme.front, lw=2.4, alpha=0.8, zorder=4)
    for number, (row, (x, y)) in enumerate(zip(front, _apart(axes, times, recall), strict=True), 1):
        axes.annotate(
            str(number), (row["ms_per_frame"], 100 * row["recall"]), xytext=(x, y), textcoords="offset points",
            fontsize=8, fontweight="bold", color=theme.paper, ha="center", va="center", zorder=6,
            bbox={"boxstyle": "circle,pad=0.22", "fc": theme.front, "ec": "none"},
            arrowprops={"arrowstyle": "-", "color": theme.front, "lw": 0.8, "shrinkA": 0, "shrinkB": 2},
        )  # fmt: skip
        invents = "" if row["precision"] == 1.0 else f"{figure(100 * (1 - row['precision']))} %"
        cells = (str(number), row["label"], f"{row['ms_per_frame']:.4f}", f"{figure(100 * row['missed'])} %", invents)
        height = _row_beside(axes, height, cells, theme.ink)
    return height


def _apart(axes: Axes, times: Sequence[float], recall: Sequence[float]) -> list[tuple[float, float]]:
    """Offsets of the numbers from their points, in points: to the left, without overlap."""
    scale = 72.0 / axes.figure.dpi
    places = axes.transData.transform(np.column_stack([times, recall])) * scale
    words = np.array(apart([(x, y) for x, y in places.tolist()], (-APART, APART / 2), APART, 1.0))
    return [(x, y) for x, y in (words - places).tolist()]


def _row_beside(axes: Axes, height: float, words: Sequence[str], colour: str, *, bold: bool = False) -> float:
    """Write one row of a list to the right of the axes; return the height of the next."""
    for x, word, side in zip((1.02, 1.045, 1.385, 1.47, 1.555), words, ("left", "left", *["right"] * 3), strict=True):
        axes.text(
            x, height, word, transform=axes.transAxes, fontsize=8, color=colour, ha=side, va="top",
            fontweight="bold" if bold else "normal",
        )  # fmt: skip
    return height - 0.036


def _legend(axes: Axes, colours: Mapping[str, str], markers: Mapping[str, str], theme: Theme, height: float) -> None:
    from matplotlib.legend import Legend
    from matplotlib.lines import Line2D

    def mark(label: str, sign: str = "o", fill: str = theme.paper, seen: float = 1.0) -> Line2D:
        return Line2D([], [], ls="", marker=sign, ms=6, mew=1.2, color=theme.faint, mfc=fill, alpha=seen, label=label)

    lines: list[Artist] = [Line2D([], [], color=colour, lw=2.4, label=name) for name, colour in colours.items()]
    marks: list[Artist] = [mark(axis, sign) for axis, sign in markers.items()]
    marks += [
        mark("filled: frame by frame", fill=theme.faint),
        mark("hollow: whole recording at once"),
        mark(f"pale: {1 - PRECISION:.0%} or more is invented", seen=PALE),
    ]
    for title, entries, x in (("algorithm", lines, 1.012), ("what is turned", marks, 1.24)):
        made = Legend(
            axes, entries, [str(one.get_label()) for one in entries], title=title,
            loc="upper left", bbox_to_anchor=(x, height - 0.02), frameon=False,
            fontsize=8, title_fontsize=8, alignment="left", labelspacing=0.35, borderaxespad=0.0,
        )  # fmt: skip
        made.get_title().set_fontweight("bold")
        axes.add_artist(made)


def _dress(axes: Axes, rows: Sequence[Row], title: str, theme: Theme) -> None:
    times = [row["ms_per_frame"] for row in rows if row["ms_per_frame"] > 0] or [BUDGET_MS]
    axes.set_xscale("log")
    axes.set_xlim(min(times) / 1.8, max(*times, BUDGET_MS) * 1.6)
    axes.set_yscale("function", functions=(stretched, unstretched))
    axes.set_ylim(-1.0, 100.1)
    axes.set_yticks(RECALLS, [f"{level} %" for level in RECALLS])
    axes.minorticks_off()
    axes.axvline(BUDGET_MS, color=theme.faint, lw=1.1, ls="--", zorder=1)
    axes.text(BUDGET_MS, 1, f"{ONE_FRAME} ", fontsize=8, color=theme.faint, va="bottom", ha="right", rotation=90)
    axes.grid(visible=True, which="major", color=theme.grid, lw=0.7)
    axes.set_axisbelow(True)
    axes.spines[["right"]].set_visible(False)
    axes.set_title(title, loc="left", fontsize=12, fontweight="bold", pad=14)
    axes.set_ylabel("recall: pair-frames in contact that are found, with 95 % interval", fontsize=9)
    axes.set_xlabel("milliseconds per frame, quickest of several passes", fontsize=9)
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    ratio = rows[0]["seconds_per_minute"] / rows[0]["ms_per_frame"] if rows[0]["ms_per_frame"] else 1.0
    above = axes.secondary_xaxis("top", functions=(lambda ms: np.asarray(ms) * ratio, lambda s: np.asarray(s) / ratio))
    above.set_xlabel("seconds per minute of the session", fontsize=9)
    above.xaxis.set_major_formatter(lambda value, _: f"{value:g}")


def stretched(recall: ArrayLike) -> NDArray[np.float64]:
    """Where a recall in % stands: half the missed share is as far again, until ``TOP`` is missed.

    The range that matters lies between 90 and 100, where a plain axis has no room.
    """
    return -np.log10(np.maximum(1.0 - np.asarray(recall, dtype=np.float64) / 100.0, -TOP / 2) + TOP)


def unstretched(place: ArrayLike) -> NDArray[np.float64]:
    """The recall in % at this height."""
    return 100.0 * (1.0 + TOP - 10.0 ** -np.asarray(place, dtype=np.float64))


def apart(
    places: Sequence[tuple[float, float]], shift: tuple[float, float], least: float, step: float
) -> list[tuple[float, float]]:
    """Where labels of points stand: each at ``shift`` from its point, then moved along y by ``step`` until no two are
    nearer than ``least``; all in one unit.
    """
    taken: list[tuple[float, float]] = []
    for x, y in places:
        at = x + shift[0], y + shift[1]
        while any(hypot(at[0] - a, at[1] - b) < least for a, b in taken):
            at = at[0], at[1] + step
        taken.append(at)
    return taken
