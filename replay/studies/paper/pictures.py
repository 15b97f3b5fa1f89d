"""Figures 7 and 8, drawn from the cells of the tables alone, so that neither shows what no table says."""

import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from replay.errors import OutputError
from replay.outputs.paper_table import Cell
from replay.outputs.tables import Table
from replay.studies.paper.feature_samples import ALL
from replay.studies.paper.printed import PRINTED
from sessions.whole_files import whole_file

Axes = Any
GREY: Final = "#777777"
BEYOND_LARGEST: Final = 1.5
"""Sampled faces are drawn on a logarithm; *all* of them stand this factor right of the largest sample."""

BARS: Final = {"fmt": "o", "capsize": 3}


def write_pictures(tables: Sequence[Table], out: Path) -> list[Path]:
    """Write ``figure_7.png`` and ``figure_8.png`` into a folder, which is made; returns their paths."""
    by_key = {one.key: one for one in tables}
    out.mkdir(parents=True, exist_ok=True)
    written = []
    for name, draw in (("figure_7.png", figure_7), ("figure_8.png", figure_8)):
        written.append(out / name)
        with whole_file(written[-1], OutputError) as file:
            file.write(draw(by_key))
    return written


def figure_7(tables: Mapping[str, Table]) -> bytes:
    """A PNG: accuracy at equal wall times above; below, wall times and the rates of poses about first touch."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(14.0, 9.0), dpi=110, layout="constrained")
    parts: Any = figure.subfigures(2, 1)
    above, below = parts
    _accuracy(above, tables["F7ab"])
    families = _distinct(tables["F7e"], "family")
    times, *rates = below.subplots(1, 1 + len(families))
    _times(times, tables["F7c"])
    for axes, family in zip(rates, families, strict=True):
        _rates(axes, tables["F7e"].where(family=family), f"7e: random collisions, {family}")
    return _png(figure)


def figure_8(tables: Mapping[str, Table]) -> bytes:
    """A PNG with a column for each family: misses for want of a sampled pair, misses of the search, and its work."""
    from matplotlib.figure import Figure

    coverage, search = tables["F8 coverage"], tables["F8 search"]
    families = _distinct(coverage, "family")
    figure = Figure(figsize=(12.0, 10.0), dpi=110, layout="constrained")
    panels = figure.subplots(3, len(families), squeeze=False, sharey="row")
    for column, family in zip(panels.T, families, strict=True):
        _coverage(column[0], coverage.where(family=family), str(family))
        _search(column[1], column[2], search.where(family=family))
    panels[0, 0].set_ylabel("contacts of which no pair is in the sample")
    panels[1, 0].set_ylabel("share of covered poses missed")
    panels[2, 0].set_ylabel("evaluations")
    handles, labels = panels[2, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=5, fontsize=8, frameon=False)
    return _png(figure)


def _png(figure: Any) -> bytes:
    for axes in figure.axes:
        axes.grid(True, alpha=0.3)
        axes.set_axisbelow(True)
        axes.spines[["top", "right"]].set_visible(False)
        axes.title.set_fontsize(10)
        axes.tick_params(labelsize=8)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None})
    return buffer.getvalue()


def _numbers(cells: Sequence[Cell]) -> list[float]:
    return [float("nan") if cell is None or isinstance(cell, str) else float(cell) for cell in cells]


def _intervals(table: Table, heading: str, low: str = "low", high: str = "high") -> tuple[list[float], Any]:
    """Numbers, and distances of their intervals' ends from them; rounding may put an end a hair inside."""
    middle, below, above = (np.array(_numbers(table.column(name))) for name in (heading, low, high))
    return middle.tolist(), np.maximum(0.0, [middle - below, above - middle])


def _distinct(table: Table, heading: str) -> list[Cell]:
    return list(dict.fromkeys(table.column(heading)))


def _accuracy(figure: Any, table: Table) -> None:
    shares = _distinct(table, "B")
    panels = figure.subplots(1, len(shares), squeeze=False, sharey="row")[0]
    for axes, share in zip(panels, shares, strict=True):
        part = table.where(B=share)
        names, (means, error) = part.column("algorithm"), _intervals(part, "mean", "mean, low", "mean, high")
        axes.errorbar(means, names, xerr=error, label="mean, with bootstrap interval", **BARS)
        axes.plot(_numbers(part.column(f"mean: {PRINTED}")), names, "x", color=GREY, label=PRINTED)
        axes.set(title=f"7a, b: accuracy, B = {share:g}", xlabel="face recall of a pose", xlim=(-0.05, 1.05))
    panels[0].invert_yaxis()
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, fontsize=8, frameon=False)


def _times(axes: Axes, table: Table) -> None:
    middle, error = _intervals(table, "median, ms", "lower quartile, ms", "upper quartile, ms")
    axes.errorbar(middle, table.column("algorithm"), xerr=error, **BARS)
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter("{x:g}")
    axes.invert_yaxis()
    axes.set(title="7c: time of a pose", xlabel="ms for all faces: median, lower to upper quartile")


def _rates(axes: Axes, table: Table, title: str) -> None:
    rates, error = _intervals(table, "rate")
    axes.errorbar(rates, table.column("algorithm"), xerr=error, **BARS)
    axes.invert_yaxis()
    axes.set(title=title, xlabel="share detected, with Wilson interval", xlim=(-0.03, 1.03))


def _sizes(axes: Axes, table: Table) -> list[float]:
    """Places of the sampled faces along a logarithm, and their words below."""
    words = [str(cell) for cell in table.column("faces sampled")]
    largest = max(float(word) for word in words if word != ALL)
    places = [BEYOND_LARGEST * largest if word == ALL else float(word) for word in words]
    axes.set_xscale("log", base=2)
    axes.set_xticks(places, words)
    axes.minorticks_off()
    axes.set_xlabel("faces sampled of each mesh")
    return places


def _coverage(axes: Axes, table: Table, family: str) -> None:
    axes.errorbar(_sizes(axes, table), *_intervals(table, "rate"), **BARS | {"fmt": "o-"})
    axes.set(title=f"8: coverage, {family}", ylim=(-0.03, 1.03))


def _search(rates: Axes, work: Axes, table: Table) -> None:
    missed = next(heading for heading in table.head if heading.startswith("misses at"))
    spent = next(heading for heading in table.head if heading.startswith("evaluations") and "covered" in heading)
    for search in _distinct(table, "search"):
        part = table.where(search=search)
        rates.errorbar(_sizes(rates, part), *_intervals(part, "rate"), **BARS | {"fmt": "o-"})
        work.plot(_sizes(work, part), _numbers(part.column(spent)), "o-", label=str(search))
    # A logarithm cannot show a panel in which nothing was measured.
    measured = any(number > 0 for number in _numbers(table.column(spent)))
    rates.set(title=f"8: {missed} evaluations", ylim=(-0.03, 1.03))
    work.set(title=f"8: {spent} poses", yscale="log" if measured else "linear")
    work.yaxis.set_major_formatter("{x:,.0f}")
