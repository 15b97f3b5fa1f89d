import json
import re
import sys

import pytest
from support.study_samples import CODEBOOK, a_class, made_class, write_answers

from replay.cli.main import main


@pytest.fixture(scope="module")
def run_folders(tmp_path_factory):
    """Run folders of a class of 20 students, which tests only read."""
    return made_class(tmp_path_factory.mktemp("class") / "runs", sessions=20, students=20, contacts=4)


@pytest.fixture
def questionnaire_options(tmp_path):
    """Options with the answers of 20 students to a questionnaire, and with the codebook that explains them."""
    answers, _model = a_class(count=20, seed=3)
    write_answers(tmp_path / "answers.csv", answers, [f"S{k:03d}" for k in range(20)])
    (tmp_path / "codebook.yaml").write_text(CODEBOOK.replace("[contacts_per_min, grasps]", "[contacts_per_min]"))
    return ["--questionnaire", str(tmp_path / "answers.csv"), "--codebook", str(tmp_path / "codebook.yaml")]


@pytest.fixture
def study_command(run_folders, tmp_path, questionnaire_options):
    """`replay study page` of a class of 20 students with their answers, into the folder ``study``."""
    return ["study", "page", str(run_folders), "--out", str(tmp_path / "study"), *questionnaire_options]


def test_study_page_prints_associations_on_a_screen(study_command, tmp_path, capsys, monkeypatch, snapshot):
    """The study of 20 students fits 80 columns and 24 lines, with all headings of an answer; its page is written."""
    monkeypatch.setenv("COLUMNS", "80")
    assert main(study_command) == 0
    printed, progress = capsys.readouterr()
    assert printed == snapshot
    headings = re.findall(r"^  (\w+) ", printed, re.MULTILINE)
    assert headings == ["What", "When", "Why", "Do", "Cost", "Or", "Sure"]
    assert len(printed.splitlines()) <= 24 and max(map(len, printed.splitlines())) <= 80
    assert "study.html" in progress and (tmp_path / "study" / "study.html").is_file()


@pytest.mark.slow
def test_study_with_names_as_ids_is_refused_by_rule(study_command, tmp_path, capsys):
    """Answers are of "Ada 0" and so on, not of ids: the error states the rule, and no name of a student."""
    answers, _model = a_class(count=20)
    write_answers(tmp_path / "answers.csv", answers, [f"Ada {k}" for k in range(20)])
    assert main(study_command) == 1
    (error,) = [line for line in capsys.readouterr().err.splitlines() if line.startswith("error: ")]
    assert "(ids)" in error and "Ada" not in error


@pytest.mark.slow
def test_study_without_a_questionnaire_cannot_say_whether_the_detector_matters(run_folders, tmp_path, capsys):
    """A class of 20 sessions without answers: whether another detector changes a conclusion is not known."""
    assert main(["study", "page", str(run_folders), "--out", str(tmp_path / "alone")]) == 0
    printed, progress = capsys.readouterr()
    assert "is not known, since there is no questionnaire." in " ".join(printed.split())
    assert "study.html" in progress
    assert json.loads((tmp_path / "alone" / "study.json").read_text("utf-8"))["sessions"] == 20


@pytest.mark.slow
def test_study_page_first_says_whether_the_detector_matters(study_command, tmp_path, capsys):
    """A class of 20 students, whose runs have detectors "slow" and "coarse", with answers.

    JSON has associations of motivation, first with ease of use, and how they depend on the detector. The page first
    says whether another detector changes a conclusion, which none does here, then which sessions to look at.
    """
    assert main([*study_command, "--format", "json", "-q"]) == 0
    reported = json.loads(capsys.readouterr().out)
    assert reported["sessions"] == reported["students"] == 20
    assert reported["associations"][0]["predictor"] == "ease of use"
    assert {row["detector"] for row in reported["sensitivity"]} == {"slow", "coarse"}
    page = (tmp_path / "study" / "study.html").read_text("utf-8")
    assert page.index("the detector changes no conclusion") < page.index("Sessions to look at first")


def test_questionnaire_without_its_codebook_is_refused(run_folders, tmp_path, questionnaire_options, capsys):
    """Either of both options alone is a wrong call (2)."""
    command = ["study", "page", str(run_folders), "--out", str(tmp_path / "half")]
    for alone in (questionnaire_options[:2], questionnaire_options[2:]):
        assert main([*command, *alone]) == 2
        assert "a questionnaire and its codebook go together" in capsys.readouterr().err


def test_study_without_pandas_names_the_pip_command(study_command, monkeypatch, capsys):
    """pandas, which comes with an extra of the package, cannot be imported."""
    monkeypatch.setitem(sys.modules, "pandas", None)
    assert main(study_command) == 1
    assert 'pip install "vrlab-replay[study]"' in capsys.readouterr().err
