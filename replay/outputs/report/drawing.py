"""Plots for page and folder, in a theme; the same drawing gives the same bytes."""

import io
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from replay.outputs.price_plot import BEST, COMPLETE, CURVES, FAINT, INVENTS
from replay.outputs.report.markup import Markup, safe

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

KINDS: Final = (BEST, COMPLETE, FAINT, INVENTS, *CURVES)


@dataclass(frozen=True)
class Theme:
    """Colours of background, words, lesser words and grid lines, and of each kind of mark."""

    paper: str
    ink: str
    faint: str
    grid: str
    kinds: Mapping[str, str]


LIGHT: Final = Theme(
    "#FFFFFF", "#1B1F27", "#5B6472", "#E4E7EC", dict(zip(
        KINDS, ("#0B7A45", "#1B1F27", "#8B93A1", "#9A7400", "#0072B2", "#7F3C8D", "#A5612C"), strict=True)),
)  # fmt: skip
DARK: Final = Theme(
    "#14171C", "#E8EAED", "#9AA3B0", "#2A2F38", dict(zip(
        KINDS, ("#3DC97B", "#E8EAED", "#7C8694", "#FFCC00", "#56B4E9", "#BE94E6", "#F5923E"), strict=True)),
)  # fmt: skip
INK: Final = "#010203"
PAPER: Final = "#fdfcfb"
"""What is drawn in these colours has the page's colour of words, and its background."""


def saved(draw: "Callable[[], Figure]", theme: Theme, kind: str, behind: str = "", dpi: float = 110) -> bytes:
    """A figure as ``png`` or ``svg``, on the paper of its theme or what is ``behind`` it."""
    from matplotlib import rc_context

    inked = ("axes.labelcolor", "axes.edgecolor", "xtick.color", "ytick.color", "legend.edgecolor")
    # The salt fixes the random names inside an SVG.
    style: dict[Any, Any] = {"svg.hashsalt": "vrlab-replay", "svg.fonttype": "none", "font.size": 10}
    style |= dict.fromkeys(inked, theme.faint) | {"text.color": theme.ink, "grid.color": theme.grid}
    style |= {"axes.facecolor": "none", "legend.facecolor": theme.paper}
    how: dict[str, Any] = {"metadata": {"Date": None, "Creator": None}} if kind == "svg" else {"dpi": dpi}
    out = io.BytesIO()
    with rc_context(style):
        draw().savefig(out, format=kind, facecolor=behind or theme.paper, **how)
    return out.getvalue()


def svg_in_page(width: float, height: float, words: str, draw: "Callable[[Axes], None]") -> Markup:
    """One plot in ink and paper of the page, dark on a light one and light on a dark one; in inches of 72 points.

    ``words`` say what it shows, for those who cannot see it; ``draw`` is called with the axes to draw on.
    """
    from matplotlib.figure import Figure

    def whole() -> "Figure":
        figure = Figure(figsize=(width, height), layout="constrained")
        draw(figure.add_subplot())
        return figure

    text = saved(whole, Theme(PAPER, INK, INK, INK, {}), "svg", "none").decode()
    text = text[text.index("<svg") :].replace(INK, "currentColor").replace(PAPER, "var(--paper)")
    return Markup(text.replace("<svg ", f'<svg role="img" aria-label="{safe(words)}" ', 1))
