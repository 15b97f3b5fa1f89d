"""Every table has a picture of its own, drawn without what the table does not hold."""

import io

import numpy as np
import pytest
from matplotlib.image import imread

from replay.outputs.paper_table import PaperTable
from replay.studies.paper.pictures import PICTURES, pictures_of


def pixels(png):
    return imread(io.BytesIO(png), format="png")[..., :3]


@pytest.mark.slow
def test_every_table_has_a_picture_with_something_drawn_and_a_file_name_of_its_own(small, pictures):
    assert list(pictures) == [one.key for one in small.tables]
    names = [name for name, _ in pictures.values()]
    assert len(set(names)) == len(names) == len(PICTURES)
    for name, png in pictures.values():
        assert name.endswith(".png") and png.startswith(b"\x89PNG")
        coloured = np.ptp(pixels(png), axis=-1) > 0.3
        assert coloured.mean() > 0.0005


@pytest.mark.slow
def test_the_same_table_gives_the_same_bytes_and_other_cells_others(small):
    table = next(one for one in small.tables if one.key == "T1a")
    place = table.head.index("face recall")
    rows = tuple((*row[:place], 0.5, *row[place + 1 :]) for row in table.rows)
    changed = PaperTable(table.key, table.title, table.head, rows, table.note)
    one, again, other = (pictures_of([some])["T1a"][1] for some in (table, table, changed))
    assert one == again != other


@pytest.mark.slow
def test_a_search_that_covered_too_few_poses_is_drawn_without_its_evaluations():
    head = ("family", "search", "faces sampled", "misses at 100", "rate", "low", "high", "evaluations of covered")
    rows = tuple(("rods", name, "64", 1, 0.5, 0.1, 0.9, None) for name in ("cold", "warm"))
    ((_, png),) = pictures_of([PaperTable("F8 search", "What a search takes", head, rows, "")]).values()
    assert png.startswith(b"\x89PNG")
