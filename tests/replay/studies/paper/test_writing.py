"""All files are written whole: the page stands alone, the JSON has every cell, the recording opens."""

import json
import re
from html import escape

import pytest

from replay.outputs.paper_table import PaperTable
from replay.studies.paper.pictures import PICTURES
from replay.studies.paper.printed import PRINTED
from replay.studies.paper.writing import verdict_of, write_paper


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
