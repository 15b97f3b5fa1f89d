"""Plots of matplotlib that lie in a page; the same drawing gives the same bytes."""

import io
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

from replay.outputs.report.markup import Markup, safe

if TYPE_CHECKING:
    from matplotlib.axes import Axes

INK: Final = "#010203"
PAPER: Final = "#fdfcfb"
"""What is drawn in these colours has the page's colour of words, and its background."""

INKED: Final = ("axes.labelcolor", "axes.edgecolor", "xtick.color", "ytick.color", "legend.edgecolor")


def svg_in_page(width: float, height: float, words: str, draw: "Callable[[Axes], None]") -> Markup:
    """One plot in ink and paper of the page, dark on a light one and light on a dark one; in inches of 72 points.

    ``words`` say what it shows, for those who cannot see it; ``draw`` is called with the axes to draw on.
    """
    text = saved(width, height, draw)
    text = text[text.index("<svg") :].replace(INK, "currentColor").replace(PAPER, "var(--paper)")
    return Markup(text.replace("<svg ", f'<svg role="img" aria-label="{safe(words)}" ', 1))


def saved(width: float, height: float, draw: "Callable[[Axes], None]") -> str:
    """A plot as SVG without a background."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    # The salt fixes the random names inside an SVG.
    style: dict[Any, Any] = {"svg.hashsalt": "vrlab-replay", "svg.fonttype": "none", "font.size": 10}
    style |= dict.fromkeys((*INKED, "text.color", "grid.color"), INK)
    style |= {"axes.facecolor": "none", "legend.facecolor": PAPER}
    out = io.BytesIO()
    with rc_context(style):
        figure = Figure(figsize=(width, height), layout="constrained")
        draw(figure.add_subplot())
        figure.savefig(out, format="svg", facecolor="none", metadata={"Date": None, "Creator": None})
    return out.getvalue().decode()
