"""Plots that lie in a page as SVG and take ink and paper from it: dark on a light page, light on a dark one."""

import io
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

from replay.outputs.report.markup import Markup, safe

if TYPE_CHECKING:
    from matplotlib.axes import Axes

INK: Final = "#010203"
"""What is drawn in this colour has the page's colour of words."""

PAPER: Final = "#fdfcfb"
"""What is drawn in this colour has the page's background."""

INKED: Final = (
    "text.color", "axes.labelcolor", "axes.edgecolor", "xtick.color", "ytick.color", "grid.color", "legend.edgecolor",
)  # fmt: skip


def svg_in_page(width: float, height: float, words: str, draw: "Callable[[Axes], None]") -> Markup:
    """One plot without a background of its own, in inches of 72 points; the same drawing gives the same bytes.

    ``words`` say what it shows, for those who cannot see it; ``draw`` is called with the axes to draw on.
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure

    how: dict[Any, Any] = {"svg.hashsalt": "vrlab-replay", "svg.fonttype": "none", "font.size": 10}
    how |= dict.fromkeys(INKED, INK) | {"axes.facecolor": "none", "legend.facecolor": PAPER}
    buffer = io.StringIO()
    with mpl.rc_context(how):
        figure = Figure(figsize=(width, height), layout="constrained")
        draw(figure.add_subplot())
        figure.savefig(buffer, format="svg", transparent=True, metadata={"Date": None, "Creator": None})
    text = buffer.getvalue()
    text = text[text.index("<svg") :].replace(INK, "currentColor").replace(PAPER, "var(--paper)")
    return Markup(text.replace("<svg ", f'<svg role="img" aria-label="{safe(words)}" ', 1))
