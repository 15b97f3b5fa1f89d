"""Every sentence holds the cells of its table; figures 7 and 8 are drawn from cells alone."""

import io
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.image import imread

from replay.outputs.paper_table import PaperTable, shown
from replay.outputs.tables import markdown
from replay.studies.paper.experiment import FULL, QUICK
from replay.studies.paper.feature_samples import SEARCHERS
from replay.studies.paper.pictures import figure_7, figure_8, write_pictures
from replay.studies.paper.verdict import verdict_of


def test_every_sentence_holds_the_cells_of_its_table():
    names = ("exact", "qaco memetic", "qaco local", "qaco corrected", "qaco random", "qaco printed")
    cells = {
        "T1a": ("algorithm|poses|poses with every pair|precision", ("a", 20, 20, 1.0), ("obb", 20, 19, 0.5)),
        "T1c": ("contacts|face recall", (1, 0.1), (1, 0.254), (1, None), (10, 0.5), (10, 0.5)),
        "T1d": ("looks a second|contacts|missed, mean|missed seconds, share", (90, 12, 0.0, None), (11, 12, 3.3, 0.5)),
        "F7e": ("algorithm|detected|family|colliding|reported though free",
                *((name, 9 - k, "rods", 9, k) for k, name in enumerate(names))),
        "ablation": ("family|variant|without|detected", ("rods", "b", "x", 7), ("rods", "b", "y", 8)),
        "F8 coverage": ("family|faces sampled|rate", ("rods", "64", 0.25), ("rods", "all", 0.0)),
        "F8 search": ("family|search|detected of all poses",
                      *(("rods", name, share) for name in SEARCHERS for share in (None, 0.5))),
    }  # fmt: skip
    best = ", ".join(f"{name} 50.0 % with all (50.0 % with all)" for name in SEARCHERS)
    said = verdict_of([PaperTable(key, "", tuple(head.split("|")), rows) for key, (head, *rows) in cells.items()])
    assert [one.rpartition(": ")[2] if one[0] == "T" else one for one in said] == [
        "every face pair of all 20 poses is found by a; the least precision of all rows is 0.5.",
        "10.0 % to 25.4 % after 1, 50.0 % after 10.",
        "0.0 (- of the seconds) at 90 looks a second, 3.3 (50.0 % of the seconds) at 11 looks a second.",
        f"F7e, rods: of 9 contacts about first touch: {', '.join(f'{name} {9 - k}' for k, name in enumerate(names))}; "
        "reported though free: 15.",
        "Ablation, rods: b without x 7, without y 8.",
        "F8, rods: a sample of so many faces holds no pair of a contact in 64: 25.0 %; at the same evaluations most "
        f"contacts are detected by {best}.",
    ]


@pytest.mark.slow
def test_the_options_are_named_and_rows_are_as_wide_as_their_heads(small):
    assert small.experiment == {"targets": [100], "poses": 2, "seed": 0, "near": 40, "sessions": 1}
    assert small.hard == sum(one.hard for one in small.fixtures)
    assert all(len(row) == len(one.head) for one in small.tables for row in one.rows)


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


@pytest.mark.slow
def test_a_search_that_covered_too_few_poses_is_drawn_without_its_evaluations(small):
    tables = {one.key: one for one in small.tables}
    search = tables["F8 search"]
    place = next(k for k, name in enumerate(search.head) if name.startswith("evaluations") and "covered" in name)
    rows = tuple((*row[:place], None, *row[place + 1 :]) for row in search.rows)
    assert figure_8({**tables, "F8 search": replace(search, rows=rows)}).startswith(b"\x89PNG")


def test_markdown_has_every_cell_in_its_column():
    text = markdown(PaperTable("T 1", "title", ("who", "n"), (("x", 1234), ("y", None)), "a note").plain, level=1)
    assert text.splitlines()[0] == "# T 1: title" and text.endswith("a note")
    assert text.splitlines()[2:6] == ["| who | n |", "|---|---|", "| x | 1,234 |", "| y | - |"]


@pytest.mark.parametrize(
    ("cell", "text"),
    [(None, "-"), (1234, "1,234"), (0.123456, "0.1235"), (1.0, "1"), ("a", "a"), (2e-9, "2e-09"),
     (21850.4, "21,850"), (999.96, "1000")],
)  # fmt: skip
def test_a_cell_is_shown_as(cell, text):
    assert shown(cell) == text
