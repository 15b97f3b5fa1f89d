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


@pytest.mark.slow
def test_there_is_a_sentence_for_completion_caps_frames_and_per_family_colony_ablation_and_samples(small):
    said = verdict_of(small.tables)
    assert [re.match(r"[^:,]+", one).group() for one in said] == [
        "T1a", "T1c", "T1d", "F7e", "F7e", "Ablation", "Ablation", "F8", "F8",
    ]  # fmt: skip
    for name in ("exact", "rapid-style", "solid-style", "aabb", "obb", "hybrid-qaco mesh"):
        assert name in said[0]


@pytest.mark.slow
def test_a_row_that_lost_a_pair_is_no_longer_named_as_complete(small):
    def with_loss(table):
        if table.key != "T1a":
            return table
        place = table.head.index("poses with every pair")
        rows = [list(row) for row in table.rows]
        rows[[row[0] for row in rows].index("obb")][place] -= 1
        return PaperTable(table.key, table.title, table.head, tuple(map(tuple, rows)), table.note)

    assert re.search(r"\bobb\b", verdict_of(small.tables)[0])
    assert not re.search(r"\bobb\b", verdict_of([with_loss(one) for one in small.tables])[0])


@pytest.mark.slow
def test_the_numbers_of_the_colony_are_those_of_its_table(small):
    rates = next(one for one in small.tables if one.key == "F7e")
    said = next(one for one in verdict_of(small.tables) if one.startswith("F7e, torus-sphere"))
    for row in rates.rows:
        if row[0] == "torus-sphere" and row[1] in ("exact", "qaco memetic", "qaco random"):
            assert f"{row[1]} {row[3]}" in said and f"of {row[2]} contacts" in said


@pytest.mark.slow
def test_every_table_is_there_once_and_names_the_options(small):
    keys = [one.key for one in small.tables]
    assert set(keys) == set(PICTURES) and len(set(keys)) == len(keys)
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


def test_a_column_is_found_by_its_heading():
    one = PaperTable("T", "title", ("a", "b"), ((1, 2), (3, 4)))
    assert one.column("b") == [2, 4] and vars(one)["rows"] == ((1, 2), (3, 4))
