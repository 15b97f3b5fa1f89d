"""One call measures once and fills every table; files, pictures and the recording hold them whole."""

import io
import json
import re
from html import escape

import numpy as np
import pytest
from matplotlib.image import imread
from rerun.chunk import RrdReader

from replay.outputs.paper_table import PaperTable, shown
from replay.outputs.rerun_log.paper_recording import entity_of, record
from replay.outputs.tables import markdown
from replay.studies.paper.calibration import CalibrationError, write_calibration
from replay.studies.paper.experiment import FULL, QUICK, run_paper
from replay.studies.paper.feature_samples import SEARCHERS
from replay.studies.paper.pictures import PICTURES, pictures_of
from replay.studies.paper.printed import PRINTED
from replay.studies.paper.writing import verdict_of, write_paper


@pytest.mark.slow
def test_every_file_is_there_and_says_the_same(small, tmp_path):
    paths = {path.name: path for path in write_paper(small, tmp_path / "out")}
    assert {"calibration.json", "paper.json", "paper.html", "paper.rrd", "table_1.png"} <= set(paths)
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == sorted(paths)
    report = json.loads(paths["paper.json"].read_text())
    assert [one["key"] for one in report["tables"]] == [one.key for one in small.tables]
    assert len(report["fixtures"]) == 2 and report["fixtures"][0]["pairs_sha256"]
    page = paths["paper.html"].read_text()
    words = re.sub(r"base64,[A-Za-z0-9+/=]+", "", page)  # in which any four letters stand now and then
    assert PRINTED in words and "http" not in words.replace("http://www.w3.org", "").replace("http-equiv", "")
    assert {name for name in paths if name.endswith(".png")} == {name for name, _ in PICTURES.values()}
    assert page.count("<img") == page.count("<table") == len(small.tables)
    for sentence in report["verdict"]:
        assert escape(sentence) in page


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


@pytest.mark.slow
def test_a_calibration_of_other_options_is_refused_before_any_work(small, tmp_path):
    write_calibration(small.calibration, tmp_path / "one.json")
    with pytest.raises(CalibrationError, match="use the same options"):
        run_paper(targets=(100,), poses=3, near=40, calibration=tmp_path / "one.json")


def test_full_is_table_1_with_20_poses_and_1000_near_ones():
    assert (FULL.targets[0], FULL.targets[-1], len(FULL.targets), FULL.poses, FULL.near) == (100, 1000, 10, 20, 1000)
    assert set(QUICK.targets) < set(FULL.targets)


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


@pytest.mark.slow
def test_fixtures_accuracies_tables_and_pictures_are_there(small, pictures, tmp_path):
    path = tmp_path / "paper.rrd"
    record(small, pictures, path)
    entities = {str(chunk.entity_path) for chunk in RrdReader(str(path)).stream()}
    for part in ("/fixtures/torus-sphere/torus", "/fixtures/beaker-flask/flask", "/accuracy"):
        assert any(entity.startswith(part) for entity in entities)
    for one in small.tables:
        assert {f"/tables/{entity_of(one.key)}", f"/pictures/{entity_of(one.key)}"} <= entities


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
