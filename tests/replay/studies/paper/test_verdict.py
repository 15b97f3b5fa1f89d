"""Every sentence holds the cells of its table; figures 7 and 8 are drawn from cells alone."""

import io
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.image import imread

from replay.outputs.paper_table import shown
from replay.studies.paper.experiment import FULL, QUICK
from replay.studies.paper.pictures import figure_7, figure_8, write_pictures


def test_full_is_table_1_with_20_poses_and_1000_near_ones():
    assert (FULL.targets[0], FULL.targets[-1], len(FULL.targets), FULL.poses, FULL.near) == (100, 1000, 10, 20, 1000)
    assert set(QUICK.targets) < set(FULL.targets)


DRAWN = {
    figure_7: {"F7ab": "mean", "F7c": "median, ms", "F7e": "rate"},
    figure_8: {"F8 coverage": "rate", "F8 search": "rate"},
}
"""Figure -> the tables it is drawn from, and a column of each that it must show."""


@pytest.mark.slow
def test_two_pictures_are_written_and_each_changes_with_every_table_it_is_drawn_from(small, tmp_path):
    tables = {one.key: one for one in small.tables}
    written = write_pictures(small.tables, tmp_path / "out")
    assert sorted((tmp_path / "out").iterdir()) == written and [one.name for one in written] == [
        "figure_7.png", "figure_8.png",
    ]  # fmt: skip
    for file, (draw, columns) in zip(written, DRAWN.items(), strict=True):
        png = file.read_bytes()
        assert draw(tables) == png
        assert (np.ptp(imread(io.BytesIO(png), format="png")[..., :3], axis=-1) > 0.3).mean() > 0.0005
        for key, heading in columns.items():
            table, place = tables[key], tables[key].head.index(heading)
            rows = tuple((*row[:place], 0.5, *row[place + 1 :]) for row in table.rows)
            assert draw({**tables, key: replace(table, rows=rows)}) != png, key


@pytest.mark.parametrize(
    ("cell", "text"),
    [(None, "-"), (1234, "1,234"), (0.123456, "0.1235"), (1.0, "1"), ("a", "a"), (2e-9, "2e-09"),
     (21850.4, "21,850"), (999.96, "1000")],
)  # fmt: skip
def test_a_cell_is_shown_as(cell, text):
    assert shown(cell) == text
