"""Recall against time, a line per algorithm, the front drawn out: the picture people know from ann-benchmarks."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from replay.tradeoff.clocks import BUDGET_MS
from replay.tradeoff.front import PRECISION, Row, counts, front_of
from replay.tradeoff.lines import lines_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SIZE: Final = (11.0, 6.2)
COLOURS: Final = (
    "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00", "#7F3C8D", "#80735B", "#4C6A92", "#A5612C",
)  # fmt: skip
"""Told apart by colour-blind readers; further lines begin again with another marker."""

MARKERS: Final = ("o", "s", "D", "^", "v", "P", "X")
PALE: Final = 0.35
"""Opacity of what is not on the front for inventing too much."""

# SOURCE: M. Aumueller, E. Bernhardsson, A. Faithfull, ANN-Benchmarks, Information Systems 87 (2020), figures 2-6.


def picture(rows: Sequence[Row], title: str, kind: str = "png") -> bytes:
    """The picture as ``png`` or ``svg``.

    Raises
    ------
    ValueError
        No row.
    """
    from matplotlib import rc_context

    out = io.BytesIO()
    how: Mapping[str, Any] = {"metadata": {"Date": None}} if kind == "svg" else {"dpi": 110}
    # The salt makes the names inside an SVG, and so the page that holds it, the same every time.
    with rc_context({"svg.hashsalt": "vrlab-replay"}):
        _drawn(rows, title).savefig(out, format=kind, **how)
    return out.getvalue()


def _drawn(rows: Sequence[Row], title: str) -> Figure:
    from matplotlib.figure import Figure

    if not rows:
        raise ValueError("there is no row to draw; run a setting first")
    figure = Figure(figsize=SIZE, layout="constrained")
    axes = figure.add_subplot()
    for number, (name, points) in enumerate(lines_of(rows).items()):
        _line(axes, name, points, COLOURS[number % len(COLOURS)], MARKERS[number // len(COLOURS) % len(MARKERS)])
    _front(axes, rows)
    _dress(axes, rows, title)
    return figure


def _line(axes: Axes, name: str, points: Sequence[Row], colour: str, marker: str) -> None:
    times = [row["ms_per_frame"] for row in points]
    recall = [100 * row["recall"] for row in points]
    sure = all(counts(row) or row["oracle"] for row in points)
    word = name if sure else f"{name} (invents)"
    axes.plot(times, recall, color=colour, lw=1.2, alpha=0.8 if sure else PALE, zorder=2)
    for row, time, value in zip(points, times, recall, strict=True):
        spread = [[value - 100 * row["recall_low"]], [100 * row["recall_high"] - value]]
        span = [[0.0], [row["ms_median"] - time]]
        axes.errorbar(
            [time], [value], yerr=spread, xerr=span, fmt=marker, color=colour, ms=6, lw=0.7,
            alpha=1.0 if counts(row) or row["oracle"] else PALE,
            mfc=colour if row["online"] else "white", label=word, zorder=3,
        )  # fmt: skip
        word = "_" + name


def _front(axes: Axes, rows: Sequence[Row]) -> None:
    by_label = {row["label"]: row for row in rows}
    front = [by_label[label] for label in front_of(rows)]
    times = [row["ms_per_frame"] for row in front]
    recall = [100 * row["recall"] for row in front]
    if not front:
        return
    right = max(row["ms_per_frame"] for row in rows) * 2
    axes.step(
        [*times, right], [*recall, recall[-1]], where="post", color="#D7263D", lw=2.6, alpha=0.75, zorder=1,
        label="the front",
    )  # fmt: skip
    for number, (row, time, value) in enumerate(zip(front, times, recall, strict=True)):
        up = 12 if number % 2 else -18
        axes.annotate(
            row["label"], (time, value), xytext=(6, up), textcoords="offset points", fontsize=8, color="#8E1B2C",
            bbox={"boxstyle": "round,pad=0.15", "fc": "white", "ec": "none", "alpha": 0.75}, zorder=5,
        )  # fmt: skip


def _dress(axes: Axes, rows: Sequence[Row], title: str) -> None:
    axes.set_xscale("log")
    axes.set_ylim(-3, 106)
    axes.axvline(BUDGET_MS, color="#444444", lw=1.2, ls="--")
    axes.text(BUDGET_MS, 2, " one frame at 90 Hz", fontsize=8, color="#444444", va="bottom")
    axes.grid(visible=True, which="major", color="#DDDDDD", lw=0.6)
    axes.set_title(title, loc="left", fontsize=12)
    axes.set_ylabel("recall, % of contact pair-frames (95 % Wilson)")
    axes.set_xlabel(
        "ms per frame, quickest pass (filled: frame by frame, hollow: whole recording at once; "
        f"pale: fewer than {PRECISION:.0%} of the reported are contacts)"
    )
    ratio = rows[0]["seconds_per_minute"] / rows[0]["ms_per_frame"] if rows[0]["ms_per_frame"] else 1.0
    above = axes.secondary_xaxis("top", functions=(lambda ms: np.asarray(ms) * ratio, lambda s: np.asarray(s) / ratio))
    above.set_xlabel("seconds per session minute", fontsize=9)
    axes.legend(fontsize=7.5, loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False)
