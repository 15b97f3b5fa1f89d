"""``replay paper`` prints the tables or JSON, writes where told, and repeats itself from a calibration."""

import json

import pytest

from replay.cli.main import main
from replay.paper import experiment

pytestmark = pytest.mark.slow


@pytest.fixture
def tiny(monkeypatch):
    monkeypatch.setattr(experiment, "QUICK", experiment.Size((100,), 2, 20))


def test_text_has_the_tables_and_a_bad_calibration_is_one_sentence(tiny, capsys, tmp_path):
    assert main(["paper", "--quick", "--out", str(tmp_path)]) == 0
    printed, said = capsys.readouterr()
    for words in ("Table I", "T1a", "F7e", "printed; hardware", "rapid-style"):
        assert words in printed
    assert "wrote" in said and (tmp_path / "paper.html").exists()
    assert main(["paper", "--quick", "--calibration", str(tmp_path / "paper.json")]) == 1
    assert "leave it out to measure" in capsys.readouterr().err


def test_the_same_calibration_prints_the_same_json_to_the_last_byte(tiny, capsys, tmp_path):
    assert main(["paper", "--quick", "--json", "--out", str(tmp_path)]) == 0
    first = capsys.readouterr().out
    again = ["paper", "--quick", "--json", "--calibration", str(tmp_path / "calibration.json")]
    assert main(again) == 0
    assert capsys.readouterr().out == first and json.loads(first)["tables"]


@pytest.mark.slow
def test_quick_runs_to_the_end_and_complete_rows_find_every_face(capsys):
    assert main(["paper", "--quick", "--json"]) == 0
    tables = {one["key"]: one for one in json.loads(capsys.readouterr().out)["tables"]}
    assert [row[3] for row in tables["T1a"]["rows"][:7]] == [1.0] * 7
    assert all(row[5] in (1.0, None) for row in tables["T1a"]["rows"])
