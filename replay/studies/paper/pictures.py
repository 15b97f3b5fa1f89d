"""A picture for every table, drawn from its cells alone, so that none shows what its table does not say."""

import io
from collections.abc import Callable, Sequence
from typing import Any, Final

import numpy as np

from replay.outputs.paper_table import Cell, PaperTable
from replay.studies.paper.feature_samples import ALL, EXPECTED
from replay.studies.paper.printed import OURS, PRINTED

Axes = Any
Rows = Sequence[tuple[Cell, ...]]
GREY: Final = "#777777"
FACES_MISSED: Final = 1.5
"""Sampled faces are drawn on a logarithm; *all* of them stand this factor right of the largest sample."""


def pictures_of(tables: Sequence[PaperTable]) -> dict[str, tuple[str, bytes]]:
    """Key of a table -> file name and PNG."""
    return {one.key: (PICTURES[one.key][0], _png(PICTURES[one.key][1](one))) for one in tables if one.key in PICTURES}


def _figure(panels: int = 1, height: float = 4.5, rows: int = 1) -> tuple[Any, list[Axes]]:
    """A figure and its panels, row after row; those of a row share their vertical axis."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, height), dpi=110, layout="constrained")
    axes = figure.subplots(rows, panels, squeeze=False, sharey="row").ravel().tolist()
    for one in axes:
        one.grid(True, alpha=0.3)
        one.set_axisbelow(True)
        one.spines[["top", "right"]].set_visible(False)
    return figure, axes


def _png(figure: Any) -> bytes:
    for axes in figure.axes:
        axes.title.set_fontsize(10)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None})
    return buffer.getvalue()


def _legend(figure: Any, axes: Axes, columns: int = 4) -> None:
    """One legend below all panels, where it covers nothing."""
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=columns, fontsize=8, frameon=False)


def _numbers(cells: Sequence[Cell]) -> list[float]:
    return [float("nan") if cell is None or isinstance(cell, str) else float(cell) for cell in cells]


def _intervals(table: PaperTable, heading: str, low: str = "low", high: str = "high") -> tuple[list[float], Any]:
    """Numbers, and distances of their intervals' ends from them; rounding may put an end a hair inside."""
    middle, below, above = (np.array(_numbers(table.column(name))) for name in (heading, low, high))
    return middle.tolist(), np.maximum(0.0, [middle - below, above - middle])


def _distinct(table: PaperTable, heading: str) -> list[Cell]:
    return list(dict.fromkeys(table.column(heading)))


def _table_one(table: PaperTable) -> Any:
    names = {name: f"{name} ({theirs})" for name, theirs in OURS.items()}
    figure, panels = _figure(len(names), 4.2)
    for axes, (name, words) in zip(panels, names.items(), strict=True):
        some = table.where(algorithm=words)
        faces = _numbers(some.column("faces"))
        for heading, style in (("to completion", "o-"), ("B = 1", "s--"), ("B = 0.25", "v:")):
            axes.plot(faces, _numbers(some.column(heading)), style, label=heading, markersize=5)
        axes.plot(faces, _numbers(some.column(PRINTED)), "x", color=GREY, label=PRINTED)
        axes.set(title=name, xlabel="faces that intersect")
    panels[0].set_ylabel("faces detected, mean of a pose")
    _legend(figure, panels[0])
    return figure


def _recall_bars(table: PaperTable) -> Any:
    figure, (axes,) = _figure()
    recalls = _numbers(table.column("face recall"))
    bars = axes.barh(table.column("algorithm"), recalls)
    axes.bar_label(bars, [f"{one:.3g}" for one in recalls], padding=3, fontsize=8)
    axes.invert_yaxis()
    axes.set(xlabel="face recall, all poses together", xlim=(0.0, 1.08))
    return figure


def _recall_lines(table: PaperTable, along: str, label: str, base: int) -> Any:
    """Recall by what is below the heading ``along``, on a logarithm."""
    figure, (axes,) = _figure(height=5.0)
    for number, name in enumerate(_distinct(table, "algorithm")):
        some = table.where(algorithm=name)
        marker = "os^vDPX*<>"[number % 10]
        axes.plot(_numbers(some.column(along)), _numbers(some.column("face recall")), marker=marker, label=str(name))
    axes.set_xscale("log", base=base)
    ticks = _numbers(_distinct(table, along))
    axes.set_xticks(ticks, [f"{one:g}" for one in ticks])
    axes.set(xlabel=label, ylabel="face recall, all poses together")
    _legend(figure, axes)
    return figure


def _sampling(table: PaperTable) -> Any:
    figure, (axes,) = _figure()
    rates = [f"{rate:g} Hz" for rate in _numbers(table.column("looks a second"))]
    missed, error = _intervals(table, "missed, share")
    places = np.arange(len(rates))
    axes.bar(places - 0.2, missed, 0.38, yerr=error, capsize=3, label="contacts missed, with Wilson interval")
    axes.bar(places + 0.2, _numbers(table.column("missed seconds, share")), 0.38, label="seconds of contact missed")
    axes.set_xticks(places, rates)
    axes.set(xlabel="looks a second", ylabel="share missed", ylim=(0.0, 1.0))
    _legend(figure, axes)
    return figure


def _accuracy(table: PaperTable) -> Any:
    shares = _distinct(table, "B")
    figure, panels = _figure(len(shares), 4.2)
    for axes, share in zip(panels, shares, strict=True):
        some = table.where(B=share)
        names, (means, error) = some.column("algorithm"), _intervals(some, "mean", "mean, low", "mean, high")
        axes.errorbar(means, names, xerr=error, fmt="o", capsize=3, label="mean, with bootstrap interval")
        axes.plot(_numbers(some.column(f"mean: {PRINTED}")), names, "x", color=GREY, label=PRINTED)
        axes.set(title=f"B = {share:g}", xlabel="face recall of a pose", xlim=(-0.05, 1.05))
    panels[0].invert_yaxis()
    _legend(figure, panels[0])
    return figure


def _times(table: PaperTable) -> Any:
    figure, (axes,) = _figure()
    middle, error = _intervals(table, "median, ms", "lower quartile, ms", "upper quartile, ms")
    axes.errorbar(middle, table.column("algorithm"), xerr=error, fmt="o", capsize=3)
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter("{x:g}")
    axes.invert_yaxis()
    axes.set_xlabel("ms for all faces of a pose: median, lower to upper quartile")
    return figure


def _rates(table: PaperTable) -> Any:
    families = _distinct(table, "family")
    figure, panels = _figure(len(families))
    for axes, family in zip(panels, families, strict=True):
        some = table.where(family=family)
        rates, error = _intervals(some, "rate")
        axes.errorbar(rates, some.column("algorithm"), xerr=error, fmt="o", capsize=3)
        words = "share of colliding poses detected, with Wilson interval"
        axes.set(title=str(family), xlabel=words, xlim=(-0.03, 1.03))
        axes.xaxis.label.set_fontsize(8)
    panels[0].invert_yaxis()
    return figure


def _ablation(table: PaperTable) -> Any:
    families = _distinct(table, "family")
    figure, panels = _figure(len(families))
    for axes, family in zip(panels, families, strict=True):
        for number, variant in enumerate(_distinct(table, "variant")):
            some = table.where(family=family, variant=variant)
            places = np.arange(len(some.rows)) + 0.15 * number
            axes.errorbar(places, *_intervals(some, "rate"), fmt="o", capsize=3, label=str(variant))
            axes.set_xticks(places, some.column("without"))
        axes.set(title=str(family), xlabel="equation switched off", ylim=(-0.03, 1.03))
    panels[0].set_ylabel("share of colliding poses detected")
    _legend(figure, panels[0])
    return figure


def _sizes(some: PaperTable, axes: Axes) -> list[float]:
    """Places of the sampled faces along a logarithm, and their words below."""
    words = [str(cell) for cell in some.column("faces sampled")]
    known = [float(word) for word in words if word != ALL]
    places = [float(word) if word != ALL else FACES_MISSED * max(known) for word in words]
    axes.set_xscale("log", base=2)
    axes.set_xticks(places, words)
    axes.minorticks_off()
    axes.set_xlabel("faces sampled of each mesh")
    return places


def _coverage(table: PaperTable) -> Any:
    figure, (axes,) = _figure()
    for family in _distinct(table, "family"):
        some = table.where(family=family)
        axes.errorbar(_sizes(some, axes), *_intervals(some, "rate"), fmt="o-", capsize=3, label=str(family))
    axes.set(ylabel="contacts of which no pair is in the sample", ylim=(-0.03, 1.03))
    _legend(figure, axes)
    return figure


def _search(table: PaperTable) -> Any:
    families = _distinct(table, "family")
    missed = next(heading for heading in table.head if heading.startswith("misses at"))
    spent = next(heading for heading in table.head if heading.startswith("evaluations") and "covered" in heading)
    measured = any(number > 0 for number in _numbers(table.column(spent)))  # no logarithm shows an empty panel
    figure, panels = _figure(len(families), 7.5, rows=2)
    upper, lower = panels[: len(families)], panels[len(families) :]
    for rates, work, family in zip(upper, lower, families, strict=True):
        for search in _distinct(table, "search"):
            some = table.where(family=family, search=search)
            style = "o:" if search == EXPECTED else "o-"
            rates.errorbar(_sizes(some, rates), *_intervals(some, "rate"), fmt=style, capsize=2)
            work.plot(_sizes(some, work), _numbers(some.column(spent)), style, label=str(search))
        rates.set(title=f"{family}: {missed} evaluations", ylim=(-0.03, 1.03))
        work.set(title=f"{family}: {spent} poses", yscale="log" if measured else "linear")
        work.yaxis.set_major_formatter("{x:,.0f}")
    upper[0].set_ylabel("share of the covered poses, with Wilson interval")
    lower[0].set_ylabel("evaluations")
    _legend(figure, lower[0], 5)
    return figure


def _growth(table: PaperTable) -> Any:
    figure, (axes,) = _figure()
    searches, families = _distinct(table, "search"), _distinct(table, "family")
    for number, family in enumerate(families):
        exponents = _numbers(table.where(family=family).column("exponent"))
        bars = axes.bar(np.arange(len(searches)) + 0.4 * number - 0.2, exponents, 0.38, label=str(family))
        axes.bar_label(bars, ["-" if one != one else f"{one:.2f}" for one in exponents], fontsize=8)
    axes.set_xticks(np.arange(len(searches)), searches)
    axes.set_ylabel("exponent of evaluations in faces sampled")
    _legend(figure, axes)
    return figure


PICTURES: Final[dict[str, tuple[str, Callable[[PaperTable], Any]]]] = {
    "Table I": ("table_1.png", _table_one),
    "T1a": ("to_completion.png", _recall_bars),
    "T1b": ("equal_budget.png", lambda one: _recall_lines(one, "B", "wall time B, medians of hybrid", 2)),
    "T1c": (
        "contact_caps.png", lambda one: _recall_lines(one, "contacts", "face pairs after which the engine stops", 10),
    ),
    "T1d": ("frame_sampling.png", _sampling),
    "F7ab": ("accuracy.png", _accuracy),
    "F7c": ("times.png", _times),
    "F7e": ("random_collisions.png", _rates),
    "ablation": ("ablation.png", _ablation),
    "F8 coverage": ("sample_coverage.png", _coverage),
    "F8 search": ("sample_search.png", _search),
    "F8 growth": ("sample_growth.png", _growth),
}  # fmt: skip
"""Key of a table -> its picture's file and what draws it."""
