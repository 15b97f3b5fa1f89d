import json

import pytest

from sessions.errors import SessionError
from sessions.model.assumption import Assumption, Confidence, Origin, Subject, assumptions_fact, assumptions_of

GUESS = Assumption(
    Subject.MESH_AXES,
    "body",
    Origin.GUESS,
    Confidence.OPEN,
    bodies=("cup", "rod"),
    files=("cup.obj", "rod.obj"),
    description="as the poses (unity)",
    reason="OBJ files say no axes",
    alternatives=("body", "x-flipped"),
)


def test_assumptions_are_kept_as_they_were():
    """Two assumptions are written to a text among the facts of a session and read again."""
    rows = (GUESS, Assumption(Subject.CLOCK, "column t, s", Origin.USER))
    assert assumptions_of({"assumptions": assumptions_fact(rows)}) == rows


def test_facts_without_assumptions_have_none():
    """An older session file has no such text."""
    assert assumptions_of({}) is None


@pytest.mark.parametrize(
    "text",
    [
        pytest.param("", id="nothing"),
        pytest.param("{", id="half an object"),
        pytest.param("[1]", id="a number"),
        pytest.param("[[]]", id="a list"),
        pytest.param('[{"subject": "hue"}]', id="an unknown subject"),
        pytest.param('[{"subject": "clock", "origin": "x"}]', id="an unknown origin"),
        pytest.param("[" * 9999, id="nested too deeply"),
    ],
)
def test_damaged_text_is_refused_in_a_sentence(text):
    """The text on assumptions must be a JSON list of objects with known values."""
    with pytest.raises(SessionError, match=r"cannot be read .*; import it again"):
        assumptions_of({"assumptions": text})


@pytest.mark.parametrize(
    ("change", "is_open"),
    [
        pytest.param({}, True, id="a guess"),
        pytest.param({"confidence": "sure"}, False, id="a sure guess"),
        pytest.param({"alternatives": ["body"]}, False, id="no alternative"),
        pytest.param({"origin": "you said it"}, False, id="the user's word"),
        pytest.param({"origin": "the file says it"}, False, id="the file's word"),
        pytest.param({"origin": "not known", "confidence": "sure"}, True, id="not known"),
    ],
)
def test_only_an_unsure_guess_between_alternatives_is_open(change, is_open):
    """GUESS, which is unsure and has two alternatives, is read from its text with some fields changed.

    Open is a question to the user; so is what is not known at all.
    """
    (fields,) = json.loads(assumptions_fact([GUESS]))
    (row,) = assumptions_of({"assumptions": json.dumps([fields | change])})
    assert row.is_open == is_open


def test_answered_assumption_remembers_the_first_guess():
    """GUESS is "body"; the user answers "x-flipped" and then "gltf", and so it is no open question any more."""
    twice_answered = GUESS.answered("x-flipped", "X flipped").answered("gltf")
    assert twice_answered.value == "gltf"
    assert twice_answered.guessed_value == "body"
    assert twice_answered.origin is Origin.USER
    assert not twice_answered.is_open


def test_sentence_of_an_assumption_names_its_origin():
    """The value of GUESS, its description in brackets, its origin and its reason; then that of the user's answer."""
    assert GUESS.sentence == "body (as the poses (unity)); guessed, not sure: OBJ files say no axes"
    assert GUESS.answered("x-flipped", "X flipped").sentence == "x-flipped (X flipped); you said it"


def test_title_of_an_assumption_names_its_files_or_bodies():
    """GUESS is about the axes of the meshes of cup and rod, which stand in the files cup.obj and rod.obj."""
    assert GUESS.title == "axes of cup.obj and rod.obj"
    assert GUESS.title_by_bodies == "axes of meshes of cup and rod"
