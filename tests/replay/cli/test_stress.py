"""``replay stress`` prints each word of the audit, writes what failed, and exits with 4 for a broken promise."""

import json

import numpy as np
import pytest
from support.stress_files import read_cases

from replay.cli.main import main
from replay.studies.stress import runner


def test_one_detector_gets_a_row_per_family_and_the_seed(capsys):
    assert main(["stress", "--detector", "hybrid", "--family", "1,10", "--pairs", "50", "--seed", "7"]) == 0
    printed = capsys.readouterr().out
    assert "seed 7, 50 pairs of each family" in printed
    for words in ("01 generic control", "10 point on a face", "missed", "invented", "within tolerance", "refused"):
        assert words in printed


def test_several_detectors_are_asked_with_commas_between_them(capsys):
    words = ["stress", "--family", "3", "--pairs", "5", "--format", "json", "--detectors"]
    for named in ("hybrid,exact", "hybrid, exact,hybrid,"):
        assert main([*words, named]) == 0
        assert [one["detector"] for one in json.loads(capsys.readouterr().out)["tallies"]] == ["hybrid", "exact"]
    assert main([*words, "exact,hybird"]) == 1
    assert "hybird" in capsys.readouterr().err
    assert main([*words, ","]) == 1
    assert "names no detector; there are: " in capsys.readouterr().err


def test_failing_pairs_are_written_to_files_that_load(capsys, tmp_path):
    assert main(["stress", "--detector", "hybrid", "--family", "16", "--pairs", "100", "--out", str(tmp_path)]) == 0
    (path,) = tmp_path.iterdir()
    assert path.name in capsys.readouterr().out.replace("\n", "")
    assert len(read_cases(path).row) > 0


def test_a_wrong_answer_of_exact_exits_with_4(capsys, monkeypatch):
    monkeypatch.setattr(runner, "verdicts_of", lambda name, pairs: np.zeros(len(pairs), dtype=np.uint8))
    assert main(["stress", "--detector", "exact", "--family", "3", "--pairs", "5"]) == 4
    said = capsys.readouterr().err
    assert "gate: exact claims exactness" in said and "5 of 5" in said and "03 shared vertex" in said


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--detector", "spoon"], "no detector 'spoon'"),
        (["--family", "44"], "no family '44'"),
        (["--case", "26"], "no case '26'"),
        (["--case", "40"], "no case '40'"),
    ],
)
def test_what_means_nothing_is_one_sentence(capsys, words, sentence):
    assert main(["stress", "--pairs", "1", *words]) == 1
    assert sentence in capsys.readouterr().err


def test_cases_alone_are_asked_and_say_why(capsys):
    assert main(["stress", "--detector", "hybrid", "--case", "28,32"]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "28 cavity" in printed and "passed" in printed and "3 missed" in printed and "decides at frames" in printed
    assert "pairs of each family" not in printed
