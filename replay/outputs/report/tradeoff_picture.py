"""What accuracy costs, and how it grows with a session; the answer is the title."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

from replay.base.constants import BUDGET_MS, ONE_FRAME
from replay.base.shown import drawable
from replay.outputs.price_plot import BEST, CURVES, FAINT, Plot, plot_of, subtitle
from replay.outputs.report.drawing import DARK, LIGHT, Theme, saved
from replay.pipeline.run_result import Tradeoff
from replay.tradeoffs.growth import UNITS, growth_answer, leaves_at

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SIZE: Final = (10.0, 7.6)
BESIDE: Final = 1.4
"""So many times smaller is a picture with words beside it: with the same letters it is read in less room."""

ABOVE: Final = 0.18
"""Room over the line of 0, in shares of the plot, for the names of what misses nothing."""


def picture(done: Tradeoff, kind: str = "png", theme: Theme = LIGHT, *, beside_words: bool = False) -> bytes:
    """The picture as ``png`` or ``svg``; ``beside_words``: smaller, and without the title that stands there."""
    dpi = 110 * (BESIDE if beside_words else 1.0)
    return saved(lambda: _drawn(done, theme, beside_words=beside_words), theme, kind, dpi=dpi)


def growth_picture(rows: Sequence[dict[str, Any]], theme: Theme = DARK) -> bytes:
    """A plot an axis, as PNG; the size at which a curve leaves the budget stands beside it."""
    return saved(lambda: _grown(rows, theme), theme, "png")


def _drawn(done: Tradeoff, theme: Theme, *, beside_words: bool = False) -> "Figure":
    from matplotlib.figure import Figure

    small = BESIDE if beside_words else 1.0
    drawn = Figure(figsize=(SIZE[0] / small, SIZE[1] / small))
    if not beside_words:
        drawn.text(0.05, 0.95, done.answer, fontsize=13, fontweight="bold", va="center")
        for place, line in zip((0.915, 0.887), subtitle(done), strict=True):
            drawn.text(0.05, place, drawable(line), fontsize=10, color=theme.faint, va="center")
    _panel(drawn.subplots(), plot_of(done, small), theme)
    drawn.subplots_adjust(left=0.05 * small, right=0.985, top=0.94 if beside_words else 0.83, bottom=0.09 * small)
    return drawn


def _panel(axes: "Axes", plot: Plot, theme: Theme) -> None:
    axes.set(xlim=(0.0, 1.0), ylim=(1.03, -ABOVE), xlabel=plot.x_words, ylabel=f"{plot.y_words}  (0 is best, on top)")
    axes.set_title(plot.title, loc="left", fontsize=12, fontweight="bold")
    axes.set_xticks(*zip(*plot.x_ticks, strict=True))
    axes.set_yticks(*zip(*plot.y_ticks, strict=True))
    axes.grid(visible=True, lw=0.7)
    axes.set_axisbelow(True)
    axes.spines[["right", "top"]].set_visible(False)
    words: dict[str, Any] = {"color": theme.faint, "backgroundcolor": theme.paper, "ha": "center", "fontsize": 8}
    for number, (x, rate) in enumerate(plot.budgets):
        axes.axvline(x, color=theme.faint, lw=1.1, ls="--")
        axes.text(x, 0.98 - 0.05 * number, rate, **words)
    for kind, marks in plot.curves:
        axes.plot([one.x for one in marks], [one.y for one in marks], color=theme.kinds[kind], lw=1.8)
    for one in plot.marks:
        colour, faint = theme.kinds[one.kind], one.kind == FAINT
        axes.plot([one.x] * 2, [one.low, one.high], color=colour, lw=4, alpha=0.15 if faint else 0.3)
        axes.plot(one.x, one.y, "o", color=colour, ms=4 if faint else 8, mew=1.6)
    for word in plot.words:
        strong: dict[str, Any] = {"fontsize": 9.5, "fontweight": "bold"} if word.strong else {"fontsize": 8.5}
        axes.text(word.x, word.y, word.text, color=theme.kinds[word.kind], ha="center", va="center", **strong)


def _grown(rows: Sequence[dict[str, Any]], theme: Theme) -> "Figure":
    from matplotlib.figure import Figure

    axes, names = ([*dict.fromkeys(row[key] for row in rows)] for key in ("axis", "detector"))
    drawn = Figure(figsize=(5.0 * len(axes), 5.6), layout="constrained")
    drawn.suptitle(growth_answer(rows), fontsize=15, fontweight="bold")
    for place, axis in zip(drawn.subplots(1, len(axes), squeeze=False)[0], axes, strict=True):
        place.set(xscale="log", yscale="log", xlabel=UNITS[axis], ylabel="p99 time of one live frame, ms")
        place.minorticks_off()
        place.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
        some = sorted((row for row in rows if row["axis"] == axis), key=lambda row: float(row["size"]))
        sizes = [*dict.fromkeys(row["size"] for row in some)]
        place.set_xticks(sizes, [f"{size:,.4g}" if size < 1000 else f"{size:,.0f}" for size in sizes])
        place.plot(sizes, [next(row["budget_ms"] for row in some if row["size"] == size) for size in sizes],
                   color=theme.ink, lw=1.5)  # fmt: skip
        place.text(sizes[0], some[0]["budget_ms"], ONE_FRAME if axis != "rate" else "one frame")
        for kind, name in zip((BEST, *CURVES), names, strict=False):
            if points := [(row["size"], row["p99_ms"]) for row in some if row["detector"] == name]:
                size, colour = leaves_at(rows, axis, name), theme.kinds[kind]
                words = f" {name}" if size is None else f" {name}: {size:,.0f}"
                place.plot(*zip(*points, strict=True), "o-", color=colour)
                place.text(*points[-1], words, color=colour, fontsize=9)
                if size is not None and axis != "rate":
                    place.plot(size, BUDGET_MS, "o", ms=10, mfc="none", color=colour)
    return drawn
