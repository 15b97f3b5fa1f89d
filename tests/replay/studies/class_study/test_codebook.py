from textwrap import dedent

import pytest

from replay.errors import StudyError
from replay.studies.class_study.codebook import read_codebook


def codebook_of(tmp_path, text):
    """The codebook that a YAML file with this text holds."""
    file = tmp_path / "codebook.yaml"
    file.write_text(text, encoding="utf-8")
    return read_codebook(file)


def test_codebook_gives_construct_and_direction_of_every_item(tmp_path):
    """Three items on each of two constructs, of which e3 is reversed; a regression is an outcome and its predictors."""
    text = """
        student: who
        items:
          e1: {construct: ease of use}
          e2: {construct: ease of use}
          e3: {construct: ease of use, reversed: true}
          m1: {construct: motivation}
        regressions:
          - {outcome: motivation, predictors: [contacts_per_min, grasps]}
    """
    codebook = codebook_of(tmp_path, dedent(text))
    assert codebook.student == "who"
    assert codebook.constructs == {"ease of use": ["e1", "e2", "e3"], "motivation": ["m1"]}
    assert [item.name for item in codebook.items if item.reversed] == ["e3"]
    assert codebook.questions == (("motivation", "contacts_per_min", "grasps"),)
    assert codebook.groups == ()


def test_groups_and_an_items_own_scale_are_read(tmp_path):
    """Item a1 is answered from 0 to 10; the column ``arm`` says in which group a student is."""
    codebook = codebook_of(
        tmp_path, "items: {a1: {construct: a, scale: [0, 10]}}\ngroups: {column: arm, names: [first, second]}"
    )
    assert codebook.items[0].scale == (0.0, 10.0)
    assert (codebook.group_column, codebook.groups) == ("arm", ("first", "second"))


def test_column_of_pseudonyms_and_scale_have_defaults(tmp_path):
    """A codebook that names neither: the column is called ``student``, and answers go from 1 to 5."""
    codebook = codebook_of(tmp_path, "items: {a1: {construct: a}}")
    assert codebook.student == "student"
    assert codebook.items[0].scale == (1.0, 5.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        pytest.param("[]", "must be a table of names and values", id="list"),
        pytest.param(
            "items: {a: &x {}, b: *x}", "aliases .* are not read", id="alias, which could unfold to gigabytes"
        ),
        pytest.param("items: [a]", "items must be a table of tables", id="list of items"),
        pytest.param("items: {a: b}", "items must be a table of tables", id="item that is a text"),
        pytest.param("regressions: {a: {}}", "regressions must be a list of tables", id="table of regressions"),
        pytest.param("regressions: [a]", "regressions must be a list of tables", id="regression that is a text"),
        pytest.param(
            "items: {a1: {construct: a}}\ngroups: {column: arm, names: [first]}", "at least two groups", id="one group"
        ),
        pytest.param(
            "items: {a1: {construct: a}}\ngroups: {column: arm, names: first}", "at least two groups", id="no list"
        ),
        pytest.param(
            "items: {a1: {construct: a}}\ngroups: {column: arm, names: [a, b], colour: red}",
            "unknown key 'colour'",
            id="unknown key",
        ),
    ],
)
def test_codebook_of_another_form_is_refused(tmp_path, text, message):
    """``message``: words of the refusal, after the name of the file."""
    with pytest.raises(StudyError, match=rf"codebook\.yaml.*{message}"):
        codebook_of(tmp_path, text)
