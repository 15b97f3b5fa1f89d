"""Figures 7 and 8 are drawn from the cells of the tables alone."""

import io
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.image import imread

from replay.studies.paper.pictures import figure_7, figure_8, write_pictures

DRAWN = {
    figure_7: {"F7ab": "mean", "F7c": "median, ms", "F7e": "rate"},
    figure_8: {"F8 coverage": "rate", "F8 search": "rate"},
}
"""Figure -> the tables it is drawn from, and a column of each that it must show."""


@pytest.mark.slow
def test_pictures_change_with_every_table_they_draw(small, tmp_path):
    written = write_pictures([*small.values()], tmp_path / "out")
    assert sorted((tmp_path / "out").iterdir()) == written and len(written) == 2
    for file, (draw, columns) in zip(written, DRAWN.items(), strict=True):
        png = file.read_bytes()
        assert (np.ptp(imread(io.BytesIO(png), format="png")[..., :3], axis=-1) > 0.3).mean() > 0.0005
        for key, heading in columns.items():
            table, index = small[key], small[key].head.index(heading)
            rows = tuple((*row[:index], 0.5, *row[index + 1 :]) for row in table.rows)
            assert draw({**small, key: replace(table, rows=rows)}) != png, key
