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
def test_pictures_change_with_every_table_they_draw(tables_of_small_experiment, tmp_path):
    """Figures 7 and 8 have some coloured pixels; 0.5 in place of all figures of a column changes the picture."""
    tables = tables_of_small_experiment
    written = write_pictures([*tables.values()], tmp_path / "out")
    assert [file.name for file in written] == ["figure_7.png", "figure_8.png"]
    assert sorted((tmp_path / "out").iterdir()) == written
    for file, (draw, columns) in zip(written, DRAWN.items(), strict=True):
        png = file.read_bytes()
        red_green_blue = imread(io.BytesIO(png), format="png")[..., :3]
        is_coloured = np.ptp(red_green_blue, axis=-1) > 0.3  # from 0 to 1; grey has equal channels
        assert is_coloured.mean() > 0.0005, "lines and marks are thin"
        for key, heading in columns.items():
            table, index = tables[key], tables[key].head.index(heading)
            rows = tuple((*row[:index], 0.5, *row[index + 1 :]) for row in table.rows)
            assert draw({**tables, key: replace(table, rows=rows)}) != png, key


@pytest.fixture
def drawn_figures(monkeypatch):
    """Figures that a test draws, kept in place of the second that their PNG takes."""
    drawn = []
    monkeypatch.setattr(Figure, "savefig", lambda figure, *_, **__: drawn.append(figure))
    return drawn


def answers_in_seconds(*seconds):
    """Poses of 100 faces in which 5 of 10 faces were found, in so many seconds each."""
    answer = {"target": 100, "faces": 5, "true_faces": 10, "pairs": 4, "true_pairs": 4, "right_pairs": 4}
    return np.array([(*answer.values(), 5, second) for second in seconds], ANSWER_DTYPE)  # 5 operations


def test_figure_7_has_a_panel_for_budgets_time_and_families(drawn_figures):
    """Four panels of accuracy within a budget, one of time, and two of poses about first touch, one a family.

    Each algorithm answers in 2 ms (the median of 1, 2 and 3) and finds 5 of 10 faces; about first touch it detects a
    fraction of 0.7, with an interval from 0.4 to 0.9. Algorithms stand from top to bottom, fractions from 0 to 1.
    """
    complete = {name: answers_in_seconds(0.001, 0.002, 0.003) for name in ROWS}
    cut_short = dict.fromkeys(BUDGET_FRACTIONS, complete)
    fraction, interval = 0.7, (0.4, 0.9)
    counts = {"colliding": 10, "detected": 7.0, "fewest": 6, "most": 8}
    rate = ("exact", *counts.values(), fraction, *interval, 4, 0, None, None)  # 4 free poses, 0 reported
    rates, _ablation = colony_tables([([("torus", *rate), ("flask", *rate)], [])], search_seeds=1)
    tables = [accuracy_table(cut_short), time_table(complete), rates]
    figure_7({table.key: table for table in tables})
    (figure,) = drawn_figures
    *budgets, time, torus, flask = figure.axes
    assert [axes.get_title() for axes in budgets] == [f"7a, b: accuracy, B = {b:g}" for b in BUDGET_FRACTIONS]
    assert torus.get_title() == "7e: random collisions, torus"
    assert flask.get_title() == "7e: random collisions, flask"
    assert set(budgets[0].lines[0].get_xdata()) == {5 / 10}
    assert set(time.lines[0].get_xdata()) == {2.0}
    assert set(torus.lines[0].get_xdata()) == {fraction}
    (segment,) = torus.collections[0].get_segments()
    assert segment[:, 0].tolist() == [*interval]
    assert all(axes.yaxis_inverted() for axes in (budgets[0], time, torus, flask))
    assert all(left < 0.0 and right > 1.0 for left, right in (axes.get_xlim() for axes in (budgets[0], torus, flask)))


@pytest.mark.parametrize(("evaluations", "scale"), [(None, "linear"), (50.0, "log")], ids=["no evaluations", "some"])
def test_figure_8_has_coverage_misses_and_evaluations_of_covered(drawn_figures, evaluations, scale):
    """Samples of 50 faces have no pair that meets in 0.2 of 10 poses; the search misses 0.25 of the 8 others.

    ``evaluations``: within which the search hits 90 %; without any the axis has no logarithm to draw.
    """
    no_pair = {"50": 0.2, "all": 0.0}
    coverage = [("torus", size, 10, round(10 * rate), rate, 0.1, 0.4) for size, rate in no_pair.items()]
    missed, missed_interval, success = 0.25, (0.1, 0.6), 0.6
    search = [
        ("torus", "local", size, 8, 2, missed, *missed_interval, success, evaluations, 99.0) for size in ("50", "all")
    ]
    any_searches = SampleSearches("torus", {size: [1] for size in SAMPLE_SIZES}, defaultdict(list))
    coverage_table, search_table = feature_sample_tables([any_searches])
    tables = [replace(coverage_table, rows=tuple(coverage)), replace(search_table, rows=tuple(search))]
    figure_8({table.key: table for table in tables})
    (figure,) = drawn_figures
    uncovered, missing, work = figure.axes
    assert uncovered.lines[0].get_xdata().tolist() == [50.0, 75.0], "all faces stand at 1.5 times the largest sample"
    assert uncovered.lines[0].get_ydata().tolist() == [0.2, 0.0]
    assert missing.lines[0].get_ydata().tolist() == [0.25, 0.25]
    assert work.get_yscale() == scale
    assert evaluations is None or work.lines[0].get_ydata().tolist() == [50.0, 50.0]
    assert all(bottom < 0.0 and top > 1.0 for bottom, top in (uncovered.get_ylim(), missing.get_ylim()))
