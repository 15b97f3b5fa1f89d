import pytest
from support.study_samples import CODEBOOK

from replay.errors import StudyError
from replay.studies.class_study.codebook import read_codebook


def read(tmp_path, text):
    """The codebook that a YAML file with this text holds."""
    file = tmp_path / "codebook.yaml"
    file.write_text(text, encoding="utf-8")
    return read_codebook(file)


def test_codebook_gives_construct_and_direction_of_every_item(tmp_path):
    """CODEBOOK has three items on each of two constructs; item e3 is asked the other way round."""
    book = read(tmp_path, CODEBOOK)
    assert book.student == "who"
    assert book.constructs == {"ease of use": ["e1", "e2", "e3"], "motivation": ["m1", "m2", "m3"]}
    assert [item.name for item in book.items if item.reversed] == ["e3"]
    assert book.questions[1] == ("motivation", "contacts_per_min", "grasps")
    assert book.groups == ()


def test_groups_and_an_items_own_scale_are_read(tmp_path):
    """A column of students that is not named is called ``student``."""
    book = read(tmp_path, "items: {a1: {construct: a, scale: [0, 10]}}\ngroups: {column: arm, names: [first, second]}")
    assert book.items[0].scale == (0.0, 10.0) and (book.group_column, book.groups) == ("arm", ("first", "second"))
    assert book.student == "student"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[]", ""), ("items: {a: &x {}, b: *x}", ""),
        ("items: [a]", "items must be a table of tables"), ("items: {a: b}", "items must be a table of tables"),
        ("regressions: {a: {}}", "regressions must be a list of tables"),
        ("regressions: [a]", "regressions must be a list of tables"),
        ("items: {a1: {construct: a}}\ngroups: {column: arm, names: [first]}", "at least two groups"),
        ("items: {a1: {construct: a}}\ngroups: {column: arm, names: first}", "at least two groups"),
        ("items: {a1: {construct: a}}\ngroups: {column: arm, names: [a, b], colour: red}", "unknown key 'colour'"),
    ],
)  # fmt: skip
def test_codebook_of_another_form_is_refused(tmp_path, text, message):
    """``message``: words of the refusal, after the name of the file."""
    with pytest.raises(StudyError, match=rf"codebook\.yaml.*{message}"):
        read(tmp_path, text)
