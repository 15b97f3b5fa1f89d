import csv
import json

import numpy as np
import pytest
from support.study_samples import CODEBOOK, a_class, codebook, metrics, questionnaire

from replay.errors import OutputError, StudyError
from replay.studies.class_study.analysis import analyse
from replay.studies.class_study.codebook import Question, read_codebook
from replay.studies.class_study.folder import (
    SCHEMA,
    as_json,
    association_rows,
    check_study_target,
    reliability_rows,
    write_study,
)
from replay.studies.class_study.joining import read_questionnaire
from replay.studies.class_study.refusals import RefusedError
from replay.studies.class_study.synthetic_class import Model, Student, draw_class, make_class, record_student
from sessions import read_session


@pytest.fixture(scope="module")
def study():
    answers, contacts = a_class(20)
    book = codebook((("motivation", "ease of use"), ("motivation", "contacts_per_min")))
    return analyse(book, questionnaire(answers), metrics(contacts, detectors=("exact", "hybrid"), recall=(1.0, 0.8)))


def test_page_tables_and_json_tell_the_same_figures(study, tmp_path):
    out = write_study(study, tmp_path / "study", title="Class", inputs={"seed": "0"})
    told = json.loads((out / "study.json").read_text("utf-8"))
    assert told["schema"] == SCHEMA and told["inputs"] == {"seed": "0"}
    page = (out / "study.html").read_text("utf-8")
    with (out / "associations.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(told["associations"]) == 2
    for row, again in zip(rows, told["associations"], strict=True):
        assert float(row["beta"]) == again["beta"] and f"{again['beta']:+.3f}" in page
        assert row["students"] == "20" and row["detector"] == "exact" and float(row["recall"]) == 1.0
    with (out / "reliability.csv").open(newline="") as file:
        assert [float(row["alpha"]) for row in csv.DictReader(file)] == [r["alpha"] for r in told["reliability"]]
    with (out / "sensitivity.csv").open(newline="") as file:
        assert [row["detector"] for row in csv.DictReader(file)] == ["hybrid"]


def test_a_folder_is_not_replaced_unless_forced_and_only_if_it_is_a_study(study, tmp_path):
    out = write_study(study, tmp_path / "study", title="Class", inputs={})
    with pytest.raises(OutputError, match="--force"):
        write_study(study, out, title="Class", inputs={})
    write_study(study, out, title="Again", inputs={}, force=True)
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "chapter.txt").write_text("years of work")
    with pytest.raises(OutputError, match="is not a study folder"):
        check_study_target(tmp_path / "thesis", force=True)


def test_a_title_that_claims_a_cause_leaves_nothing_behind(study, tmp_path):
    with pytest.raises(RefusedError):
        write_study(study, tmp_path / "study", title="The effect of VR", inputs={})
    assert list(tmp_path.iterdir()) == []


def test_refusals_are_in_the_json_with_what_lifts_them():
    answers, contacts = a_class(9)
    book = codebook((("motivation", "contacts_per_min"),))
    told = as_json(analyse(book, questionnaire(answers), metrics(contacts, recall=(None,))))
    assert {row["rule"] for row in told["refused"]} >= {"provenance"} and all(row["lift"] for row in told["refused"])
    json.dumps(told, allow_nan=False)


def test_no_file_holds_a_pseudonym(study, tmp_path):
    out = write_study(study, tmp_path / "study", title="Class", inputs={})
    for file in out.iterdir():
        assert "S07" not in file.read_text("utf-8"), file.name


def test_rows_have_one_construct_and_one_coefficient_each(study):
    assert [row["construct"] for row in reliability_rows(study)] == ["ease of use", "motivation"]
    assert [row["predictor"] for row in association_rows(study)] == ["ease of use", "contacts_per_min"]


def read(tmp_path, text):
    file = tmp_path / "codebook.yaml"
    file.write_text(text, encoding="utf-8")
    return read_codebook(file)


def test_a_codebook_says_construct_scale_and_direction_of_every_item(tmp_path):
    book = read(tmp_path, CODEBOOK)
    assert book.student == "who"
    assert {name: [item.name for item in items] for name, items in book.constructs.items()} == {
        "ease of use": ["e1", "e2", "e3"],
        "motivation": ["m1", "m2", "m3"],
    }
    assert [item.name for item in book.items if item.reversed] == ["e3"]
    assert book.questions[1] == Question("motivation", ("contacts_per_min", "grasps"))
    assert book.groups is None


def test_groups_and_an_items_own_scale_are_read(tmp_path):
    book = read(tmp_path, "items: {a1: {construct: a, scale: [0, 10]}}\ngroups: {column: arm, names: [first, second]}")
    assert book.items[0].scale == (0.0, 10.0) and book.groups == ("arm", ("first", "second"))
    assert book.student == "student"


@pytest.mark.parametrize(
    "text, words",
    [
        ("items: [", "cannot be read as YAML"),
        ("- 3", "must be a table"),
        ("itmes: {}", "unknown field 'itmes'; did you mean 'items'"),
        ("items: {}", "items is empty"),
        ("items: {a: {}}", "items: a: construct: must be a word"),
        ("items: {a: {construct: x, scale: [5, 1]}}", "items: a: scale: must rise"),
        ("items: {a: {construct: x, scale: 5}}", "two numbers"),
        ("items: {a: {construct: x, scale: [true, 5]}}", "two numbers"),
        ("items: {a: {construct: x, reversed: often}}", "reversed must be true or false"),
        ("items: {a: {construct: x}}\nregressions: 4", "regressions must be a list"),
        ("items: {a: {construct: x}}\nregressions: [{outcome: x}]", "predictors must be a list"),
        ("items: {a: {construct: x}}\nregressions: [{outcome: x, predictors: [x]}]", "differ"),
        ("items: {a: {construct: x}}\ngroups: {column: c, names: [one]}", "at least two groups"),
    ],
)
def test_what_is_wrong_is_said_with_its_place(tmp_path, text, words):
    with pytest.raises(StudyError, match=words):
        read(tmp_path, text)


def test_yaml_that_would_build_objects_builds_none(tmp_path):
    with pytest.raises(StudyError, match="cannot be read as YAML"):
        read(tmp_path, "items: !!python/object/apply:os.getcwd []")


def scores(drawn, short):
    answers = np.array([[one.answers[f"{short}{k}"] for k in range(1, 5)] for one in drawn], dtype=float)
    answers[:, 3] = 6.0 - answers[:, 3]
    return answers.mean(axis=1)


def test_traits_and_touches_go_together_as_the_model_says():
    drawn = draw_class(2500)
    ease, motivation = scores(drawn, "ease"), scores(drawn, "mot")
    touches = [len(one.touches) for one in drawn]
    near = [one.near for one in drawn]
    assert np.corrcoef(ease, motivation)[0, 1] == pytest.approx(0.6 * 0.82, abs=0.06)
    assert np.corrcoef(ease, touches)[0, 1] < -0.4
    assert abs(np.corrcoef(near, motivation)[0, 1]) < 0.05
    assert abs(np.corrcoef(scores(drawn, "use"), motivation)[0, 1]) < 0.05


def test_without_an_association_in_the_model_there_is_none_in_the_class():
    drawn = draw_class(2500, model=Model(ease_motivation=0.0, ease_touches=0.0))
    assert abs(np.corrcoef(scores(drawn, "ease"), scores(drawn, "mot"))[0, 1]) < 0.05
    assert abs(np.corrcoef(scores(drawn, "ease"), [len(one.touches) for one in drawn])[0, 1]) < 0.05


def test_a_larger_class_has_the_smaller_one_in_it():
    assert draw_class(9, 3)[:4] == draw_class(4, 3) != draw_class(4, 4)


def test_a_class_on_disk_reads_back_and_a_session_that_is_there_is_kept(tmp_path):
    out = tmp_path / "class"
    assert make_class(out, students=3, seed=1) == {}
    book = read_codebook(out / "codebook.yaml")
    assert len(read_questionnaire(out / "questionnaire.csv", book).students) == 3
    assert read_session(out / "sessions" / "S03.mcap").facts["pseudonym"] == "S03"
    with (out / "questionnaire.csv").open(newline="") as file:
        assert [row["student"] for row in csv.DictReader(file)] == ["S01", "S02", "S03"]
    assert json.loads((out / "truth.json").read_text())["model"]["ease_motivation"] == 0.6
    before = {path.name: path.stat().st_mtime_ns for path in (out / "sessions").iterdir()}
    (out / "sessions" / "S02.mcap").unlink()
    told = []
    assert make_class(out, students=3, seed=1, told=lambda *one: told.append(one)) == {}
    assert told == [("S02", "done")]
    after = {path.name: path.stat().st_mtime_ns for path in (out / "sessions").iterdir()}
    assert {name for name in after if after[name] != before[name]} == {"S02.mcap"}


def test_a_folder_of_something_else_or_of_another_class_is_left_alone(tmp_path):
    (tmp_path / "mine.txt").write_text("x")
    with pytest.raises(OutputError, match="something else"):
        make_class(tmp_path, students=5)
    make_class(tmp_path / "class", students=1)
    with pytest.raises(OutputError, match="another seed or size"):
        make_class(tmp_path / "class", students=6)


def test_a_session_that_cannot_be_made_is_told(tmp_path):
    (tmp_path / "S01.mcap").mkdir()
    assert record_student(Student("S01", {}, (-1.0,), 0), tmp_path / "S01.mcap", 0) != ""
