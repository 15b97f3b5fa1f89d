"""A run as one figure for a notebook: who touched when, and what each detector missed beside what it took."""

from io import BytesIO
from itertools import cycle
from typing import TYPE_CHECKING, Final

import numpy as np
from matplotlib.figure import Figure

from replay.base.constants import BUDGET_MS, HEADSET_HZ
from replay.comparison.outcome import Outcome
from replay.errors import AuditError
from replay.outputs.lanes import ranked_pairs
from replay.outputs.palette import OUTCOMES, SERIES, hex_of
from replay.pipeline.ranking import part_of
from replay.pipeline.run_result import RunResult

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_LANES: Final = 12
DRAWN: Final = (Outcome.HELD, Outcome.BOTH, Outcome.WITHIN_TOLERANCE, Outcome.INVENTED, Outcome.MISSED)
"""Outcomes with a colour, the one that must be seen last."""


class NotebookFigure(Figure):
    """A figure that a notebook shows without pyplot and its state."""

    def _repr_png_(self) -> bytes:
        drawn = BytesIO()
        self.savefig(drawn, format="png", dpi=100)
        return drawn.getvalue()


def run_figure(result: RunResult, label: str | None = None) -> NotebookFigure:
    """The timeline of one detector (the worst unless named) above a scatter of all: what is wrong over mean ms."""
    label = label or next((rank.label for rank in result.ranking), None)
    if label is None:
        raise AuditError(
            "nothing was compared in this run, so there is nothing to plot; run it with a reference (oracle=...)"
        )
    comparison = result.comparisons[label]
    figure = NotebookFigure(figsize=(10, 7.5), layout="constrained")
    above, below = figure.subplots(2, 1, height_ratios=(3, 2))
    _timeline(above, result, label, ranked_pairs(comparison, result.assembly.held)[:MOST_LANES])
    _scatter(below, result)
    return figure


def _timeline(axes: "Axes", result: RunResult, label: str, pairs: list[int]) -> None:
    times, outcome = result.assembly.motion.times, result.comparisons[label].outcome
    step = float(np.median(np.diff(times))) if len(times) > 1 else 1.0
    for row, pair in enumerate(pairs):
        for kind in DRAWN:
            frames = np.flatnonzero(outcome[:, pair] == kind)
            if not len(frames):
                continue
            runs = np.split(frames, np.flatnonzero(np.diff(frames) > 1) + 1)
            bars = [(float(times[run[0]]), float(times[run[-1]] - times[run[0]]) + step) for run in runs]
            colour = hex_of(OUTCOMES[kind][1])
            # An edge: a contact of one frame in a minute would have no width.
            axes.broken_barh(bars, (row - 0.4, 0.8), facecolors=colour, edgecolors=colour, linewidth=1.0)
    axes.set_yticks(range(len(pairs)), [result.assembly.pair_name(pair) for pair in pairs])
    axes.set(xlabel="session time, s", ylim=(len(pairs) - 0.5, -0.5))
    if len(times) > 1:
        axes.set_xlim(float(times[0]), float(times[-1]))
    axes.set_title(f"{label} beside {result.oracle}", loc="left", fontsize=11, fontweight="bold")
    for kind in reversed(DRAWN):
        axes.plot([], [], "s", color=hex_of(OUTCOMES[kind][1]), label=OUTCOMES[kind][0])
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=len(DRAWN), fontsize=8, frameon=False)


def _scatter(axes: "Axes", result: RunResult) -> None:
    """The share of contacts missed, late or cut short, and the share of false contact, over the mean of a frame."""
    for rank, colour in zip(result.ranking, cycle(SERIES), strict=False):
        if not rank.mean:
            continue
        lost = 100 * (part_of(rank.missed) + part_of(rank.in_part))
        false = 100 * part_of(rank.false)
        mean = 1e3 * rank.mean
        axes.plot([mean, mean], [lost, false], color=hex_of(colour), lw=1, alpha=0.5)
        axes.plot(mean, lost, "o", color=hex_of(colour), ms=8)
        axes.plot(mean, false, "^", color=hex_of(colour), ms=8, mfc="none", mew=1.6)
        axes.annotate(rank.label, (mean, max(lost, false)), xytext=(0, 8), textcoords="offset points", ha="center")
    axes.axvline(BUDGET_MS, color="#5B6472", ls="--", lw=1)
    axes.text(BUDGET_MS, 0.97, f" {HEADSET_HZ:g} Hz", transform=axes.get_xaxis_transform(), va="top", fontsize=8)
    axes.plot([], [], "o", color="#1B1F27", label="missed, late or cut short, % of contacts")
    axes.plot([], [], "^", color="#1B1F27", mfc="none", label="false, % of reported contact time")
    axes.set(xscale="log", xlabel="mean time of a frame on this machine, ms", ylabel="%", ylim=(-5, 118))
    axes.grid(visible=True, alpha=0.25)
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, fontsize=8, frameon=False)
