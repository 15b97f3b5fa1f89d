"""Figures 7 and 8, drawn from the cells of the tables alone, so that neither shows what no table says."""

import io
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

import numpy as np

from cdcore.numerics import FloatArray
from replay.document.tables import Table
from replay.errors import OutputError
from replay.studies.paper.feature_samples import ALL_FACES
from replay.studies.paper.printed import PRINTED_LABEL
from sessions.whole_files import whole_file

Axes = Any
GREY: Final = "#777777"
BEYOND_LARGEST: Final = 1.5
"""Sampled faces are drawn on a logarithm; *all* of them stand this factor right of the largest sample."""

ROWS_OF_8: Final = ("contacts of which no pair is in the sample", "share of covered poses missed", "evaluations")


def require_matplotlib() -> None:
    """Raise ``OutputError`` where the library that draws the figures is not installed."""
    if find_spec("matplotlib") is None:
        raise OutputError('figures need matplotlib, which is not installed; pip install "vrlab-replay[plots]"')


def write_pictures(tables: Sequence[Table], out: Path) -> list[Path]:
    """Write ``figure_7.png`` and ``figure_8.png`` into a folder, which is made; returns their paths."""
    by_key = {table.key: table for table in tables}
    out.mkdir(parents=True, exist_ok=True)
    written_files = []
    for name, draw in (("figure_7.png", figure_7), ("figure_8.png", figure_8)):
        written_files.append(out / name)
        with whole_file(written_files[-1], OutputError) as file:
            file.write(draw(by_key))
    return written_files


def figure_7(tables: Mapping[str, Table]) -> bytes:
    """A PNG: accuracy at equal wall times above; below, wall times and the rates of poses about first touch."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(14.0, 9.0), dpi=110, layout="constrained")
    subfigures: Any = figure.subfigures(2, 1)
    accuracy_table, time_table, rate_table = (tables[key] for key in ("F7ab", "F7c", "F7e"))
    budgets, families = _distinct_values(accuracy_table, "B"), _distinct_values(rate_table, "family")
    upper_axes = subfigures[0].subplots(1, len(budgets), squeeze=False, sharey="row")[0]
    for axes, budget in zip(upper_axes, budgets, strict=True):
        budget_rows = accuracy_table.where(B=budget)
        algorithm_names = _plot_by_algorithm(axes, budget_rows, "mean", "mean, low", "mean, high")
        axes.plot(
            _column_numbers(budget_rows, f"mean: {PRINTED_LABEL}"),
            algorithm_names,
            "x",
            color=GREY,
            label=PRINTED_LABEL,
        )
        axes.set(title=f"7a, b: accuracy, B = {budget:g}", xlabel="face recall of a pose", xlim=(-0.05, 1.05))
    upper_axes[0].invert_yaxis()
    _legend(subfigures[0], upper_axes[0])
    first, *others = subfigures[1].subplots(1, 1 + len(families))
    _plot_by_algorithm(first, time_table, "median, ms", "lower quartile, ms", "upper quartile, ms")
    first.set(title="7c: time of a pose", xlabel="ms for all faces: median, lower to upper quartile", xscale="log")
    first.xaxis.set_major_formatter("{x:g}")
    for axes, family in zip(others, families, strict=True):
        _plot_by_algorithm(axes, rate_table.where(family=family), "rate", "low", "high")
        axes.set(title=f"7e: random collisions, {family}", xlabel="share detected, with Wilson interval")
        axes.set_xlim(-0.03, 1.03)
    for axes in (first, *others):
        axes.invert_yaxis()
    return _png(figure)


def figure_8(tables: Mapping[str, Table]) -> bytes:
    """A PNG with a column for each family: misses for want of a sampled pair, misses of the search, and its work."""
    from matplotlib.figure import Figure

    coverage_table, search_table = tables["F8 coverage"], tables["F8 search"]
    misses_heading = next(heading for heading in search_table.head if heading.startswith("misses at"))
    evaluations_heading = next(
        heading for heading in search_table.head if heading.startswith("evaluations") and "covered" in heading
    )
    families = _distinct_values(coverage_table, "family")
    figure = Figure(figsize=(12.0, 10.0), dpi=110, layout="constrained")
    panels = figure.subplots(3, len(families), squeeze=False, sharey="row")
    for (coverage_axes, rate_axes, work_axes), family in zip(panels.T, families, strict=True):
        rows, family_searches = coverage_table.where(family=family), search_table.where(family=family)
        _plot_by_size(coverage_axes, rows)
        coverage_axes.set(title=f"8: coverage, {family}", ylim=(-0.03, 1.03))
        for name in _distinct_values(search_table, "search"):
            rows = family_searches.where(search=name)
            _plot_by_size(rate_axes, rows)
            work_axes.plot(
                _size_positions(work_axes, rows), _column_numbers(rows, evaluations_heading), "o-", label=name
            )
        rate_axes.set(title=f"8: {misses_heading} evaluations", ylim=(-0.03, 1.03))
        # A logarithm cannot show a panel in which nothing was measured.
        has_values = (_column_numbers(family_searches, evaluations_heading) > 0).any()
        work_axes.set(title=f"8: {evaluations_heading} poses", yscale="log" if has_values else "linear")
        work_axes.yaxis.set_major_formatter("{x:,.0f}")
    for axes, label in zip(panels[:, 0], ROWS_OF_8, strict=True):
        axes.set_ylabel(label)
    _legend(figure, panels[2, 0])
    return _png(figure)


def _plot_by_algorithm(axes: Axes, table: Table, *columns: str) -> list[str]:
    """A bar a row, of a value between its ends; returns the names of the rows."""
    algorithm_names = table.column("algorithm")
    middle, lower, upper = (_column_numbers(table, column) for column in columns)
    (line,) = axes.plot(middle, algorithm_names, "o", label="mean, with bootstrap interval")
    axes.hlines(algorithm_names, lower, upper, color=line.get_color())
    return algorithm_names


def _plot_by_size(axes: Axes, table: Table) -> None:
    """Rates over the sampled faces, each with its interval."""
    positions = _size_positions(axes, table)
    (line,) = axes.plot(positions, _column_numbers(table, "rate"), "o-")
    axes.vlines(positions, _column_numbers(table, "low"), _column_numbers(table, "high"), color=line.get_color())


def _legend(figure: Any, axes: Axes) -> None:
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=5, fontsize=8, frameon=False)


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


def _column_numbers(table: Table, column_name: str) -> FloatArray:
    """A column, nan where nothing was measured."""
    return np.array(table.column(column_name), dtype=np.float64)


def _distinct_values(table: Table, column_name: str) -> list[Any]:
    return list(dict.fromkeys(table.column(column_name)))


def _size_positions(axes: Axes, table: Table) -> list[float]:
    """Places of the sampled faces along a logarithm, and their words below."""
    cells = table.column("faces sampled")
    largest = max(float(word) for word in cells if word != ALL_FACES)
    positions = [BEYOND_LARGEST * largest if word == ALL_FACES else float(word) for word in cells]
    axes.set_xscale("log", base=2)
    axes.set_xticks(positions, cells)
    axes.minorticks_off()
    axes.set_xlabel("faces sampled of each mesh")
    return positions
