import pytest
from support.study_samples import CODEBOOK

from replay.errors import StudyError
from replay.studies.class_study.codebook import read_codebook


def read(tmp_path, text):
    file = tmp_path / "codebook.yaml"
    file.write_text(text, encoding="utf-8")
    return read_codebook(file)


def test_a_codebook_says_construct_scale_and_direction_of_every_item(tmp_path):
    book = read(tmp_path, CODEBOOK)
    assert book.student == "who"
    assert book.constructs == {"ease of use": ["e1", "e2", "e3"], "motivation": ["m1", "m2", "m3"]}
    assert [item.name for item in book.items if item.reversed] == ["e3"]
    assert book.questions[1] == ("motivation", "contacts_per_min", "grasps")
    assert book.groups == ()


def test_groups_and_an_items_own_scale_are_read(tmp_path):
    book = read(tmp_path, "items: {a1: {construct: a, scale: [0, 10]}}\ngroups: {column: arm, names: [first, second]}")
    assert book.items[0].scale == (0.0, 10.0) and (book.group_column, book.groups) == ("arm", ("first", "second"))
    assert book.student == "student"


@pytest.mark.parametrize(
    "text, words",
    [
        ("items: [", "cannot be read as YAML"),
        ("a: &a [x, x]\nitems: {a: *a}", "aliases .* are not read"),
        ("student: 2024-01-01\nitems: {}", "items is empty"),
        ("- 3", "must be a table"),
        ("itmes: {}", "unknown key 'itmes'; did you mean 'items'"),
        ("items: {}", "items is empty"),
        ("items: {a: {}}", r"\[items.a\]: construct is missing"),
        ("items: {a: {construct: x, scale: [5, 1]}}", r"\[items.a\]: scale must rise"),
        ("items: {a: {construct: x, scale: 5}}", "2 finite numbers"),
        ("items: {a: {construct: x, scale: [true, 5]}}", "2 finite numbers"),
        ("items: {a: {construct: x, reversed: often}}", "reversed is 'often'; give true or false"),
        ("items: {a: {construct: x}}\nregressions: 4", "regressions must be a list"),
        ("items: {a: {construct: x}}\nregressions: [{outcome: x}]", "predictors is empty"),
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
