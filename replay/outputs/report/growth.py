"""Growth of the price as a table and as a picture: time of a frame against size, and where the budget is left."""

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

from replay.base.constants import BUDGET_MS, ONE_FRAME
from replay.outputs.price_plot import COMPLETE, CURVES
from replay.outputs.report.tradeoff_picture import DARK, Theme
from replay.outputs.tables import Table, table
from replay.tradeoffs.growth import UNITS, growth_answer, leaves_at

if TYPE_CHECKING:
    from matplotlib.figure import Figure

KINDS: Final = (COMPLETE, *CURVES)


def growth_table(rows: Sequence[dict[str, Any]]) -> Table:
    """A row a detector: on each axis the size at which it fills a frame, or the largest that fits."""
    axes, names = ([*dict.fromkeys(row[key] for row in rows)] for key in ("axis", "detector"))
    cells = [(name, *(_cell(rows, axis, name) for axis in axes)) for name in names]
    note = f"p99 of live looks, {rows[0]['passes']} passes in turns; containment in, faces out" if rows else ""
    return table(growth_answer(rows), ("detector", *(UNITS[axis] for axis in axes)), cells, notes=(note,))


def _cell(rows: Sequence[dict[str, Any]], axis: str, name: str) -> str:
    size = leaves_at(rows, axis, name)
    largest = max((row["size"] for row in rows if (row["axis"], row["detector"]) == (axis, name)), default=0)
    return f"fits up to {largest:,.0f}" if size is None else f"leaves at {size:,.0f}"


def growth_picture(rows: Sequence[dict[str, Any]], theme: Theme = DARK) -> bytes:
    """A plot an axis, as PNG; the size at which a curve leaves the budget stands beside it."""
    out = io.BytesIO()
    _drawn(rows, theme).savefig(out, format="png", dpi=110, facecolor=theme.paper)
    return out.getvalue()


def _drawn(rows: Sequence[dict[str, Any]], theme: Theme) -> "Figure":
    from matplotlib.figure import Figure

    axes, names = ([*dict.fromkeys(row[key] for row in rows)] for key in ("axis", "detector"))
    drawn = Figure(figsize=(5.0 * len(axes), 5.6), facecolor=theme.paper)
    drawn.suptitle(growth_answer(rows), color=theme.ink, fontsize=15, fontweight="bold")
    for place, axis in zip(drawn.subplots(1, len(axes), squeeze=False)[0], axes, strict=True):
        place.set_facecolor(theme.paper)
        place.set(xscale="log", yscale="log", xlabel=UNITS[axis], ylabel="p99 time of one live frame, ms")
        place.tick_params(colors=theme.faint)
        place.xaxis.label.set_color(theme.faint)
        place.yaxis.label.set_color(theme.faint)
        some = sorted((row for row in rows if row["axis"] == axis), key=lambda row: float(row["size"]))
        budgets = [(row["size"], row["budget_ms"]) for row in some]
        place.plot(*zip(*budgets, strict=True), color=theme.ink, lw=1.5)
        place.text(budgets[0][0], budgets[0][1], ONE_FRAME if axis != "rate" else "one frame", color=theme.ink)
        for kind, name in zip(KINDS, names, strict=False):
            points = [(row["size"], row["p99_ms"]) for row in some if row["detector"] == name]
            if not points:
                continue
            place.plot(*zip(*points, strict=True), "o-", color=theme.kinds[kind])
            size = leaves_at(rows, axis, name)
            words = name if size is None else f"{name}: {size:,.0f}"
            place.text(*points[-1], f" {words}", color=theme.kinds[kind], fontsize=9)
            if size is not None and axis != "rate":
                place.plot(size, BUDGET_MS, "o", ms=10, mfc="none", color=theme.kinds[kind])
    drawn.tight_layout()
    return drawn
