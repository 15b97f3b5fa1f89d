"""Figures 7 and 8 are drawn from the cells of the tables alone."""

import io
from collections import defaultdict
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.image import imread

from replay.studies.paper.colony import colony_tables
from replay.studies.paper.feature_samples import SAMPLE_SIZES, SampleSearches, feature_sample_tables
from replay.studies.paper.pictures import figure_7, figure_8, write_pictures
from replay.studies.paper.rows import ANSWER_DTYPE, ROWS
from replay.studies.paper.table_one import BUDGET_FRACTIONS, accuracy_table, time_table

DRAWN = {
    figure_7: {"F7ab": "mean", "F7c": "median, ms", "F7e": "rate"},
    figure_8: {"F8 coverage": "rate", "F8 search": "rate"},
}
"""Figure -> the tables it is drawn from, and a column of each that it must show."""


@pytest.mark.slow
def test_pictures_change_with_every_table_they_draw(small, tmp_path):
    """Coloured pixels show that something is drawn; a column of 0.5 in place of its figures changes the picture."""
    written = write_pictures([*small.values()], tmp_path / "out")
    assert sorted((tmp_path / "out").iterdir()) == written and len(written) == 2
    for file, (draw, columns) in zip(written, DRAWN.items(), strict=True):
        png = file.read_bytes()
        assert (np.ptp(imread(io.BytesIO(png), format="png")[..., :3], axis=-1) > 0.3).mean() > 0.0005
        for key, heading in columns.items():
            table, index = small[key], small[key].head.index(heading)
            rows = tuple((*row[:index], 0.5, *row[index + 1 :]) for row in table.rows)
            assert draw({**small, key: replace(table, rows=rows)}) != png, key


@pytest.fixture
def drawn_figures(monkeypatch):
    """Figures that were drawn, without the second that their PNG takes."""
    drawn = []
    monkeypatch.setattr(Figure, "savefig", lambda figure, *_, **__: drawn.append(figure))
    return drawn


def answers_in_seconds(*seconds):
    """Poses of Table I in which 5 of 10 faces were found, in so many seconds each."""
    return np.array([(100, 5, 10, 4, 4, 4, 5, second) for second in seconds], ANSWER_DTYPE)


def test_figure_7_has_a_panel_for_budgets_time_and_families(drawn_figures):
    """Bars go from the lower to the upper end of each row; algorithms stand from top to bottom.

    Each algorithm answers in 2 ms (the median of 1, 2 and 3) and finds 5 of 10 faces; of 10 random collisions of the
    colony it finds a fraction of 0.7, with an interval from 0.4 to 0.9.
    """
    complete = {name: answers_in_seconds(0.001, 0.002, 0.003) for name in ROWS}
    cut_short = dict.fromkeys(BUDGET_FRACTIONS, complete)
    fraction, interval = 0.7, (0.4, 0.9)
    rate = ("torus", "exact", 10, 7.0, 6, 8, fraction, *interval, 4, 0, None, None)
    rates, _ = colony_tables([([rate, ("flask", *rate[1:])], [])], 1)
    tables = [accuracy_table(cut_short), time_table(complete), rates]
    figure_7({table.key: table for table in tables})
    (figure,) = drawn_figures
    *budgets, time, torus, flask = figure.axes
    assert [axes.get_title() for axes in budgets] == [f"7a, b: accuracy, B = {b:g}" for b in BUDGET_FRACTIONS]
    assert [axes.get_title() for axes in (torus, flask)] == [f"7e: random collisions, {n}" for n in ("torus", "flask")]
    assert [set(axes.lines[0].get_xdata()) for axes in (budgets[0], time, torus)] == [{5 / 10}, {2.0}, {fraction}]
    (segment,) = torus.collections[0].get_segments()
    assert segment[:, 0].tolist() == [*interval]
    assert all(axes.yaxis_inverted() for axes in (budgets[0], time, torus, flask))
    assert all(left < 0.0 and right > 1.0 for left, right in (axes.get_xlim() for axes in (budgets[0], torus, flask)))


@pytest.mark.parametrize(("evaluations", "scale"), [(None, "linear"), (50.0, "log")])
def test_figure_8_has_coverage_misses_and_evaluations_of_covered(drawn_figures, evaluations, scale):
    """Rows of the tables: samples of 50 faces fail to cover 0.2 of 10 poses; the search misses 0.25 of 8 covered."""
    coverage = [("torus", size, 10, 2, rate, 0.1, 0.4) for size, rate in (("50", 0.2), ("all", 0.0))]
    search = [("torus", "local", size, 8, 2, 0.25, 0.1, 0.6, 0.6, evaluations, 99.0) for size in ("50", "all")]
    shapes = feature_sample_tables([SampleSearches("torus", {size: [1] for size in SAMPLE_SIZES}, defaultdict(list))])
    tables = [replace(table, rows=tuple(rows)) for table, rows in zip(shapes, (coverage, search), strict=True)]
    figure_8({table.key: table for table in tables})
    (figure,) = drawn_figures
    covered, missed, work = figure.axes
    assert covered.lines[0].get_xdata().tolist() == [50.0, 75.0], "all faces stand to the right of the largest sample"
    assert covered.lines[0].get_ydata().tolist() == [0.2, 0.0] and missed.lines[0].get_ydata().tolist() == [0.25] * 2
    assert work.get_yscale() == scale and (evaluations is None or work.lines[0].get_ydata().tolist() == [50.0] * 2)
    assert all(bottom < 0.0 and top > 1.0 for bottom, top in (covered.get_ylim(), missed.get_ylim()))
