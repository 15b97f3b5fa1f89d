import json
import re

import pytest
from support.study_samples import CODEBOOK, a_class, made_class, write_answers

from replay.cli.main import main


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Run folders of a class of 30 students, which tests only read."""
    return made_class(tmp_path_factory.mktemp("class") / "runs", sessions=30, students=30, contacts=4)


@pytest.fixture
def files(tmp_path, runs):
    """The words of ``study page`` for a class of 30 students."""
    answers, _ = a_class(count=30, seed=3)
    write_answers(tmp_path / "answers.csv", answers, [f"S{k:03d}" for k in range(30)])
    (tmp_path / "codebook.yaml").write_text(CODEBOOK.replace("[contacts_per_min, grasps]", "[contacts_per_min]"))
    requested = ["--questionnaire", tmp_path / "answers.csv", "--codebook", tmp_path / "codebook.yaml"]
    return ["study", "page", *map(str, [runs, "--out", tmp_path / "study", *requested])]


def test_study_page_prints_associations_on_a_screen(files, tmp_path, capsys, monkeypatch, snapshot):
    """80 columns and at most 24 lines, with all headings of an answer."""
    monkeypatch.setenv("COLUMNS", "80")
    assert main(files) == 0
    printed, output = capsys.readouterr()
    assert printed == snapshot
    headings = re.findall(r"^  (\w+) ", printed, re.MULTILINE)
    assert headings == ["What", "When", "Why", "Do", "Cost", "Or", "Sure"]
    assert len(printed.splitlines()) <= 24 and max(map(len, printed.splitlines())) <= 80
    assert "study.html" in output and (tmp_path / "study" / "study.html").is_file()


@pytest.mark.slow
def test_study_with_names_as_ids_is_refused_by_rule(files, tmp_path, capsys):
    """The rule is said, and no name of a student."""
    answers, _ = a_class(count=30)
    write_answers(tmp_path / "answers.csv", answers, [f"Ada {k}" for k in range(30)])
    assert main(files) == 1
    error = [line for line in capsys.readouterr().err.splitlines() if line.startswith("error: ")]
    assert len(error) == 1 and "ids" in error[0] and "Ada" not in error[0]


@pytest.mark.slow
def test_study_page_first_says_whether_the_detector_matters(files, tmp_path, capsys):
    """Without a questionnaire it is not known; a questionnaire without its codebook is a wrong call (2)."""
    text = [*files[:3], "--out"]
    assert main([*text, str(tmp_path / "alone")]) == 0
    printed, output = capsys.readouterr()
    assert "is not known, since there is no questionnaire." in " ".join(printed.split()) and "study.html" in output
    assert json.loads((tmp_path / "alone" / "study.json").read_text("utf-8"))["sessions"] == 30
    assert main([*files, "--format", "json", "-q"]) == 0
    reported = json.loads(capsys.readouterr().out)
    assert (
        reported["sessions"] == reported["students"] == 30 and reported["associations"][0]["predictor"] == "ease of use"
    )
    assert {row["detector"] for row in reported["sensitivity"]} == {"slow", "coarse"}
    page = (tmp_path / "study" / "study.html").read_text("utf-8")
    assert page.index("no association with behaviour was found") < page.index("Sessions to look at first")
    assert main([*text, str(tmp_path / "half"), *files[-2:]]) == 2
    assert "a questionnaire and its codebook go together" in capsys.readouterr().err


def test_study_without_pandas_names_the_pip_command(files, monkeypatch, capsys):
    """pandas comes with an extra of the package."""
    import sys

    monkeypatch.setitem(sys.modules, "pandas", None)
    assert main(files) == 1
    assert 'pip install "vrlab-replay[study]"' in capsys.readouterr().err
