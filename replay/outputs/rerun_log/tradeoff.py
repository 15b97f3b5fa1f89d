"""What accuracy costs, drawn in two planes, live and offline: the same layout as in the report.

Rerun has no log axis and no scatter plot, so axes, ticks and marks are strips and points in a plane of our own: x grows
to the right, y downwards.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import rerun as rr
import rerun.blueprint as rrb

from replay.outputs.palette import BACKGROUND, BUDGET, GRID, INVENTED, SERIES, TICKS, WHITE, Rgba
from replay.outputs.price_plot import BEST, COMPLETE, CURVES, FAINT, INVENTS, TITLES, Mark, Plot, plots_of, subtitle
from replay.outputs.rerun_log.columns import RecordingWriter, entity, packed
from replay.outputs.rerun_log.views import PLAIN, text_view
from replay.outputs.tables import markdown
from replay.outputs.tradeoff_table import SHOWN, front_rows, how_measured, quickest_first, tradeoff_table
from replay.pipeline.run_result import Tradeoff

ROOTS: Final = ("tradeoff/live", "tradeoff/offline")
ADVICE: Final = "tradeoff/advice"

WIDTH: Final = 1200.0
HEIGHT: Final = 900.0
"""Units of a plane; the axes fill it, words stand around it."""

COLOURS: Final[dict[str, Rgba]] = {
    BEST: SERIES[2], COMPLETE: WHITE, FAINT: BUDGET, INVENTS: INVENTED,
    **dict(zip(CURVES, (SERIES[0], SERIES[3], SERIES[1]), strict=True)),
}  # fmt: skip

Strip = list[tuple[float, float]]


def log_tradeoff(writer: RecordingWriter, done: Tradeoff) -> None:
    """Send both planes and the words."""
    for root, plot in zip(ROOTS, plots_of(done), strict=True):
        _Plane(writer, root).draw(plot)
    writer.markdown(ADVICE, advice_text(done))


class _Plane:
    """Draws one plot below an entity."""

    def __init__(self, writer: RecordingWriter, root: str) -> None:
        self._writer, self._root = writer, root

    def draw(self, plot: Plot) -> None:
        """Axes, budgets, curves, marks with intervals, words."""
        upright = [[_at(x, -0.16), _at(x, 1.0)] for x, _ in plot.x_ticks]
        self._strips("grid", [*upright, *([_at(0.0, y), _at(1.0, y)] for y, _ in plot.y_ticks)], GRID, 0.8)
        self._strips("budget", [[_at(x, -0.16), _at(x, 1.0)] for x, _ in plot.budgets], BUDGET, 1.2)
        axes = [*((x, 1.03, words) for x, words in plot.x_ticks), *((-0.03, y, words) for y, words in plot.y_ticks)]
        axes += [(x, 0.97 - 0.05 * k, words) for k, (x, words) in enumerate(plot.budgets)]
        self._words("axes", [*axes, (0.5, 1.09, plot.x_words), (0.3, -0.21, f"{plot.y_words} (0 is best)")], TICKS)
        for kind, marks in plot.curves:
            self._strips(f"curves/{kind}", [[_at(one.x, one.y) for one in marks]], COLOURS[kind], 1.8)
        for kind, colour in COLOURS.items():
            if kind in {one.kind for one in plot.marks}:
                self._marks(kind, [one for one in plot.marks if one.kind == kind], colour)
            found = [(one.x, one.y, one.text) for one in plot.words if one.kind == kind]
            if found:
                self._words(f"words/{kind}", found, colour)

    def _marks(self, kind: str, marks: Sequence[Mark], colour: Rgba) -> None:
        places = [_at(one.x, one.y) for one in marks]
        self._strips(f"intervals/{kind}", [[_at(one.x, one.low), _at(one.x, one.high)] for one in marks], colour, 0.7)
        size = 3.0 if kind == FAINT else 7.0
        self._send(f"marks/{kind}", rr.Points2D(places, colors=packed([colour]), radii=size, draw_order=40.0))
        if kind == INVENTS:
            hole = rr.Points2D(places, colors=packed([BACKGROUND]), radii=0.6 * size, draw_order=41.0)
            self._send(f"marks/{kind}/hole", hole)

    def _strips(self, name: str, strips: Sequence[Strip], colour: Rgba, radius: float) -> None:
        if strips:
            self._send(name, rr.LineStrips2D(strips, colors=packed([colour]), radii=radius))

    def _words(self, name: str, words: Sequence[tuple[float, float, str]], colour: Rgba) -> None:
        places, labels = [_at(x, y) for x, y, _ in words], [text for _, _, text in words]
        points = rr.Points2D(places, labels=labels, radii=0.01, colors=packed([colour]), show_labels=True)
        self._send(name, points)

    def _send(self, name: str, what: Any) -> None:
        self._writer.static(entity(*self._root.split("/"), *name.split("/")), what)


def _at(x: float, y: float) -> tuple[float, float]:
    return WIDTH * x, HEIGHT * y


def curve_tab() -> Any:
    """Contacts missed against time, live and offline, and what to take."""
    views = [
        rrb.Spatial2DView(
            origin=f"/{root}", name=title,
            visual_bounds=rrb.VisualBounds2D(x_range=(-110.0, WIDTH + 60.0), y_range=(-230.0, HEIGHT + 120.0)),
            background=PLAIN,
        )
        for root, (title, _) in zip(ROOTS, TITLES.values(), strict=True)
    ]  # fmt: skip
    return rrb.Horizontal(
        *views, text_view(ADVICE, "What to take"), column_shares=[0.36, 0.36, 0.28], name="What accuracy costs"
    )


def advice_text(done: Tradeoff) -> str:
    """The answer, the advice, how it was measured and the table of the front in Markdown, then every row."""
    front = tradeoff_table("The front", front_rows(done.rows)).only("#", *SHOWN)
    cut = [f"Not tried, for want of time: {', '.join(done.cut)}."] if done.cut else []
    whole = tradeoff_table("Every setting", quickest_first(done.rows)).only(*SHOWN).titled("Every setting", *cut)
    advice = "\n\n".join([f"## {done.answer}", *subtitle(done), *(f"- {one}" for one in done.advice)])
    measured = "\n".join(f"- {one}" for one in how_measured(done))
    return "\n\n".join([advice, measured, markdown(front, level=2), markdown(whole, level=2)])
