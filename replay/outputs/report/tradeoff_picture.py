"""What accuracy costs, live and offline, side by side; the answer is the title."""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from replay.base.shown import drawable
from replay.outputs.price_plot import BEST, COMPLETE, CURVES, FAINT, INVENTS, Plot, plots_of, subtitle
from replay.pipeline.run_result import Tradeoff

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SIZE: Final = (15.0, 7.6)

ABOVE: Final = 0.18
"""Room over the line of 0, in shares of the plot, for the names of what misses nothing."""


@dataclass(frozen=True)
class Theme:
    """Colours of background, words, lesser words and grid lines, and of each kind of mark."""

    paper: str
    ink: str
    faint: str
    grid: str
    kinds: Mapping[str, str]


def _kinds(*colours: str) -> dict[str, str]:
    return dict(zip((BEST, COMPLETE, FAINT, INVENTS, *CURVES), colours, strict=True))


LIGHT: Final = Theme(
    "#FFFFFF", "#1B1F27", "#5B6472", "#E4E7EC",
    _kinds("#0B7A45", "#1B1F27", "#8B93A1", "#9A7400", "#0072B2", "#7F3C8D", "#A5612C"),
)  # fmt: skip
DARK: Final = Theme(
    "#14171C", "#E8EAED", "#9AA3B0", "#2A2F38",
    _kinds("#3DC97B", "#E8EAED", "#7C8694", "#FFCC00", "#56B4E9", "#BE94E6", "#F5923E"),
)  # fmt: skip


def picture(done: Tradeoff, kind: str = "png", theme: Theme = LIGHT) -> bytes:
    """The picture as ``png`` or ``svg``."""
    from matplotlib import rc_context

    out = io.BytesIO()
    how: Mapping[str, Any] = {"metadata": {"Date": None}} if kind == "svg" else {"dpi": 110}
    style: dict[Any, Any] = {"svg.hashsalt": "vrlab-replay", "text.color": theme.ink}
    style |= dict.fromkeys(("axes.labelcolor", "xtick.color", "ytick.color", "axes.edgecolor"), theme.faint)
    # The salt fixes the random names inside an SVG, so that the page that holds it is the same every time.
    with rc_context(style):
        _drawn(done, theme).savefig(out, format=kind, facecolor=theme.paper, **how)
    return out.getvalue()


def _drawn(done: Tradeoff, theme: Theme) -> Figure:
    from matplotlib.figure import Figure

    drawn = Figure(figsize=SIZE, facecolor=theme.paper)
    drawn.text(0.05, 0.95, done.answer, fontsize=17, fontweight="bold", va="center")
    for place, line in zip((0.915, 0.887), subtitle(done), strict=True):
        drawn.text(0.05, place, drawable(line), fontsize=10, color=theme.faint, va="center")
    for axes, plot in zip(drawn.subplots(1, 2, gridspec_kw={"wspace": 0.14}), plots_of(done), strict=True):
        _panel(axes, plot, theme)
    drawn.subplots_adjust(left=0.05, right=0.985, top=0.83, bottom=0.09)
    return drawn


def _panel(axes: Axes, plot: Plot, theme: Theme) -> None:
    axes.set_facecolor(theme.paper)
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(1.03, -ABOVE)
    axes.set_title(plot.title, loc="left", fontsize=12, fontweight="bold")
    axes.set_xlabel(plot.x_words)
    axes.set_ylabel(f"{plot.y_words}  (0 is best, on top)")
    axes.set_xticks([x for x, _ in plot.x_ticks], [words for _, words in plot.x_ticks])
    axes.set_yticks([y for y, _ in plot.y_ticks], [words for _, words in plot.y_ticks])
    axes.grid(visible=True, color=theme.grid, lw=0.7)
    axes.set_axisbelow(True)
    axes.spines[["right", "top"]].set_visible(False)
    for number, (x, words) in enumerate(plot.budgets):
        axes.axvline(x, color=theme.faint, lw=1.1, ls="--")
        axes.text(
            x, 0.98 - 0.05 * number, words, fontsize=8, color=theme.faint, backgroundcolor=theme.paper, ha="center"
        )
    for kind, marks in plot.curves:
        axes.plot([one.x for one in marks], [one.y for one in marks], color=theme.kinds[kind], lw=1.8)
    for one in plot.marks:
        colour, ring = theme.kinds[one.kind], one.kind == INVENTS
        axes.plot([one.x] * 2, [one.low, one.high], color=colour, lw=4, alpha=0.15 if one.kind == FAINT else 0.3)
        axes.plot(
            one.x, one.y, "o", color=colour, ms=4 if one.kind == FAINT else 8, mew=1.6,
            mfc=theme.paper if ring else colour,
        )  # fmt: skip
    for word in plot.words:
        axes.text(
            word.x, word.y, word.text, color=theme.kinds[word.kind], ha="center", va="center",
            fontsize=9.5 if word.strong else 8.5, fontweight="bold" if word.strong else "normal",
        )  # fmt: skip
