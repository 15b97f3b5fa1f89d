"""One call fills every table; tables, sentences, pictures, statistics and files say the same."""

import io
import json
import re
from html import escape

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.image import imread
from rerun.chunk import RrdReader

from replay.outputs.paper_table import PaperTable, shown
from replay.outputs.rerun_log.paper_recording import as_markdown, entity_of, record
from replay.studies.paper.calibration import CalibrationError, write_calibration
from replay.studies.paper.experiment import FULL, QUICK, run_paper
from replay.studies.paper.fixtures import TARGETS
from replay.studies.paper.pictures import PICTURES, pictures_of
from replay.studies.paper.printed import ACCURACY, OURS, PRINTED, TABLE_1, TIME_TO_RAPID, VARIANCE
from replay.studies.paper.table_one import quartiles, spread
from replay.studies.paper.verdict import verdict_of
from replay.studies.paper.writing import write_paper


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
    text = as_markdown(PaperTable("T 1", "title", ("who", "n"), (("x", 1234), ("y", None)), "a note"))
    assert text.splitlines()[0] == "# T 1: title" and "a note" in text
    assert text.splitlines()[-4:] == ["| who | n |", "| --- | --- |", "| x | 1,234 |", "| y | - |"]


@pytest.mark.parametrize(
    ("cell", "text"),
    [
        (None, "-"), (1234, "1,234"), (0.123456, "0.1235"), (1.0, "1"), ("a", "a"), (2e-9, "2e-09"),
        (21850.4, "21,850"), (999.96, "1000"),
    ],
)  # fmt: skip
def test_a_cell_is_shown_as(cell, text):
    assert shown(cell) == text


def test_a_column_is_found_by_its_heading():
    one = PaperTable("T", "title", ("a", "b"), ((1, 2), (3, 4)))
    assert one.column("b") == [2, 4] and one.as_json()["rows"] == ((1, 2), (3, 4))


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
def test_every_file_is_there_and_says_the_same(small, tmp_path):
    paths = {path.name: path for path in write_paper(small, tmp_path / "out")}
    assert {"calibration.json", "paper.json", "paper.html", "paper.rrd", "table_1.png"} <= set(paths)
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == sorted(paths)
    told = json.loads(paths["paper.json"].read_text())
    assert [one["key"] for one in told["tables"]] == [one.key for one in small.tables]
    assert len(told["fixtures"]) == 2 and told["fixtures"][0]["pairs_sha256"]
    page = paths["paper.html"].read_text()
    words = re.sub(r"base64,[A-Za-z0-9+/=]+", "", page)  # in which any four letters stand now and then
    assert PRINTED in words and "http" not in words.replace("http://www.w3.org", "")
    assert {name for name in paths if name.endswith(".png")} == {name for name, _ in PICTURES.values()}
    assert page.count("<img") == page.count("<table") == len(small.tables)
    for sentence in told["verdict"]:
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


def test_a_known_sample_has_the_known_mean_deviation_and_variance():
    one = spread([2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0])
    assert (one.n, one.mean) == (8, 5.0)
    assert one.variance == pytest.approx(32 / 7) and one.sd == pytest.approx((32 / 7) ** 0.5)


@given(st.lists(st.floats(0, 1), min_size=1, max_size=40))
def test_the_interval_lies_within_the_values_and_the_same_values_give_the_same(values):
    one = spread(values)
    assert min(values) - 1e-12 <= one.low <= one.high <= max(values) + 1e-12
    assert one == spread(values)


def test_95_percent_intervals_cover_the_true_mean_about_that_often():
    rng = np.random.default_rng(1)
    covered = sum(one.low <= 0.5 <= one.high for one in (spread(rng.uniform(size=40)) for _ in range(300)))
    assert 0.89 < covered / 300 < 0.99


def test_nothing_measured_is_refused():
    with pytest.raises(ValueError, match="nothing was measured"):
        spread([])


def test_quartiles_of_one_to_five():
    assert quartiles([5, 1, 4, 2, 3]) == (2.0, 3.0, 4.0)


def test_row_means_and_deviations_of_table_1_are_those_checked_by_hand():
    known = {"solid-style": (0.8659, 0.0472), "rapid-style": (0.8803, 0.0615), "hybrid-qaco": (0.9567, 0.0215)}
    for name, (mean, deviation) in known.items():
        shares = [TABLE_1[name][target] / target for target in TARGETS]
        assert abs(np.mean(shares) - mean) < 5e-5 and abs(np.std(shares) - deviation) < 5e-5
    assert sum(TABLE_1["solid-style"].values()) == 4658


def test_every_printed_row_has_a_row_here_and_all_counts_are_even():
    assert set(TABLE_1) == set(OURS) == set(ACCURACY) == set(VARIANCE) == set(TIME_TO_RAPID)
    assert all(count % 2 == 0 for row in TABLE_1.values() for count in row.values())
    assert (99 / 132, round(105 / 132, 3)) == (TIME_TO_RAPID["hybrid-qaco"], TIME_TO_RAPID["solid-style"])
