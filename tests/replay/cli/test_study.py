import io
import json

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from rich.console import Console
from support.small_worlds import cubes
from support.study_samples import CODEBOOK, a_class, codebook, metrics, questionnaire, write_answers

from replay.cli.main import main
from replay.cli.study_runs import session_files
from replay.cli.study_tables import check_table, study_tables
from replay.errors import StudyError
from replay.studies.class_study.analysis import analyse
from replay.studies.class_study.published import Remark
from sessions import write_session


@pytest.fixture
def files(tmp_path):
    answers, contacts = a_class(30, seed=3)
    pq.write_table(pa.table(metrics(contacts).columns), tmp_path / "metrics.parquet")
    (tmp_path / "codebook.yaml").write_text(CODEBOOK)
    write_answers(tmp_path / "answers.csv", answers)
    return [
        str(tmp_path / "metrics.parquet"),
        str(tmp_path / "answers.csv"),
        "--codebook",
        str(tmp_path / "codebook.yaml"),
    ]


def test_analyse_prints_the_associations_and_writes_the_page(files, tmp_path, capsys):
    assert main(["study", "analyse", *files, "--out", str(tmp_path / "study"), "--title", "Class"]) == 0
    printed, said = capsys.readouterr()
    assert "Ease of use is associated with higher motivation" in printed
    assert "contacts by exact, recall 100.0%" in printed
    assert "study.html" in said and (tmp_path / "study" / "study.html").is_file()


def test_analyse_as_json_is_the_summary(files, capsys):
    assert main(["study", "analyse", *files, "--format", "json", "-q"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["students"] == 30 and told["associations"][0]["predictor"] == "ease of use"


def test_a_refusal_of_the_whole_study_is_one_sentence_with_its_rule(files, tmp_path, capsys):
    answers, _ = a_class(30)
    write_answers(tmp_path / "answers.csv", answers, [f"Ada {k}" for k in range(30)])
    assert main(["study", "analyse", *files]) == 1
    error = [line for line in capsys.readouterr().err.splitlines() if line.startswith("error: ")]
    assert len(error) == 1 and "ids" in error[0] and "Ada" not in error[0]


def test_an_existing_folder_is_refused_before_the_work(files, tmp_path, capsys):
    (tmp_path / "study").mkdir()
    (tmp_path / "study" / "mine.txt").write_text("x")
    assert main(["study", "analyse", *files, "--out", str(tmp_path / "study")]) == 1
    assert "--force" in capsys.readouterr().err


def test_check_tells_the_contradictions_of_the_papers_tables(capsys):
    assert main(["study", "check"]) == 0
    printed = capsys.readouterr().out
    assert "3 of 16 checks contradict the print" in printed and "PU on attitude" in printed


def test_check_strict_is_a_gate(tmp_path, capsys):
    assert main(["study", "check", "--strict", "--format", "json"]) == 4
    told = json.loads(capsys.readouterr().out)
    assert sum(row["kind"] == "inconsistent" for row in told) == 3
    good = tmp_path / "good.toml"
    good.write_text(
        "n = 52\n[reliability]\nitems = 19\nalpha = 0.9\nkmo = 0.8\nchi_square = 443.843\ndf = 171\np = 0.0\n"
    )
    assert main(["study", "check", str(good), "--strict"]) == 0


def test_without_the_extra_one_sentence_says_what_to_install(monkeypatch, capsys):
    import sys

    monkeypatch.setitem(sys.modules, "statsmodels", None)
    assert main(["study", "check"]) == 1
    assert 'pip install "vrlab-replay[study]"' in capsys.readouterr().err


def shown(group, width=120):
    console = Console(width=width, record=True, file=io.StringIO())
    console.print(group)
    return console.export_text()


def test_what_contradicts_comes_first_and_is_counted():
    text = shown(check_table([Remark("agrees", "T", "a", "fine"), Remark("inconsistent", "T", "b", "wrong")]))
    assert "1 of 2 checks contradict" in text and text.index("wrong") < text.index("fine")
    assert "every printed figure agrees" in shown(check_table([Remark("agrees", "T", "a", "fine")]))


def test_a_study_shows_associations_questionnaire_and_refusals():
    answers, contacts = a_class(9)
    book = codebook((("motivation", "ease of use"), ("motivation", "contacts_per_min")))
    text = shown(study_tables(analyse(book, questionnaire(answers), metrics(contacts, recall=(None,)))))
    assert "n = 9" in text and "questionnaire" in text and "not given" in text and "provenance" in text


def test_a_narrow_terminal_loses_no_figure():
    answers, contacts = a_class(30, seed=3)
    study = analyse(codebook(), questionnaire(answers), metrics(contacts))
    assert f"{study.regressions[0].coefficients[0].beta:+.3f}" in shown(study_tables(study), 80)


@pytest.fixture
def files_study_runs(tmp_path):
    for k in range(3):
        session = cubes({"a": [0.0] * 20, "b": list(np.linspace(3, 0.8 + 0.1 * k, 20))})
        session = type(session)(session.source, session.meshes, facts={"pseudonym": f"S{k}"})
        write_session(session, tmp_path / f"s{k}.mcap")
    return [str(tmp_path / f"s{k}.mcap") for k in range(3)]


def test_sessions_are_run_collected_and_run_again_for_nothing(files_study_runs, tmp_path, capsys):
    out = str(tmp_path / "runs")
    assert main(["study", "run", *files_study_runs, "--out", out, "--detectors", "hybrid", "--format", "json"]) == 0
    first = json.loads(capsys.readouterr().out)
    assert first["done"] == ["s0", "s1", "s2"] and first["kept"] == []
    assert main(["study", "run", *files_study_runs, "--out", out, "--detectors", "hybrid"]) == 0
    printed, said = capsys.readouterr()
    assert f"digest: {first['digest']}" in printed and said.count("kept") == 3
    assert main(["study", "collect", out, "--out", str(tmp_path / "m.parquet")]) == 0
    assert set(pq.read_table(tmp_path / "m.parquet")["student"].to_pylist()) == {"S0", "S1", "S2"}
    assert "6 rows of 3 students" in capsys.readouterr().err


def test_a_broken_session_is_listed_with_exit_code_three(files_study_runs, tmp_path, capsys):
    (tmp_path / "s1.mcap").write_bytes(b"no session")
    assert main(["study", "run", *files_study_runs, "--out", str(tmp_path / "runs"), "--detectors", "hybrid"]) == 3
    printed = capsys.readouterr().out
    assert "2 of 3 sessions" in printed and "failed: s1:" in printed and "digest: none" in printed


def test_a_folder_stands_for_the_session_files_in_it(files_study_runs, tmp_path):
    found = session_files([tmp_path, tmp_path / "s1.mcap"])
    assert [path.name for path in found] == ["s0.mcap", "s1.mcap", "s2.mcap", "s1.mcap"]
    (tmp_path / "empty").mkdir()
    with pytest.raises(StudyError, match="holds no session files"):
        session_files([tmp_path / "empty"])


def test_the_rest_of_the_time_is_told(files_study_runs, tmp_path, capsys):
    main(["study", "run", *files_study_runs, "--out", str(tmp_path / "runs"), "--detectors", "hybrid"])
    said = capsys.readouterr().err
    assert "1 of 3  s0: done, about" in said and "s left" in said


@pytest.mark.slow
def test_a_small_class_goes_the_whole_way_to_its_page(tmp_path, capsys):
    assert main(["study", "demo", "--out", str(tmp_path / "class"), "--students", "5"]) == 0
    printed, said = capsys.readouterr()
    assert "questionnaire" in printed and "few-students" in printed
    assert (tmp_path / "class" / "study" / "study.html").is_file() and "5 of 5  S05: done" in said
