"""All files are written whole: the page stands alone, the JSON has every cell, the recording opens."""

import json
import re
from html import escape

import pytest

from replay.studies.paper.pictures import PICTURES
from replay.studies.paper.printed import PRINTED
from replay.studies.paper.writing import write_paper


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
