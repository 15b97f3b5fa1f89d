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
    """Written to the text of a fact and read again; facts without that text have none."""
    rows = (GUESS, Assumption(Subject.CLOCK, "column t, s", Origin.USER))
    assert assumptions_of({"assumptions": assumptions_fact(rows)}) == rows and assumptions_of({}) is None


@pytest.mark.parametrize(
    "text", ["", "{", "[1]", "[[]]", '[{"subject": "hue"}]', '[{"subject": "clock", "origin": "x"}]', "[" * 9999]
)
def test_damaged_text_is_refused_in_a_sentence(text):
    """Text that is no JSON, JSON of another form, an unknown subject or origin, and JSON that is nested too deeply."""
    with pytest.raises(SessionError, match=r"cannot be read .*; import it again"):
        assumptions_of({"assumptions": text})


def test_only_an_unsure_guess_between_alternatives_is_open():
    """GUESS is open.

    Sure, without a second alternative, or said by the user or the file, it is not; what is not known is.
    """
    fields = json.loads(assumptions_fact([GUESS]))[0]
    closed = (
        {"confidence": "sure"},
        {"alternatives": ["body"]},
        {"origin": "you said it"},
        {"origin": "the file says it"},
    )
    for change in closed:
        (row,) = assumptions_of({"assumptions": json.dumps([fields | change])})
        assert not row.is_open
    (unknown,) = assumptions_of({"assumptions": json.dumps([fields | {"origin": "not known", "confidence": "sure"}])})
    assert GUESS.is_open and unknown.is_open


def test_answered_assumption_remembers_the_first_guess():
    """GUESS is "body"; the user answers "x-flipped" and then "gltf". The sentence says who said it."""
    once = GUESS.answered("x-flipped", "X flipped")
    twice = once.answered("gltf")
    assert (twice.guessed_value, twice.origin, twice.is_open) == ("body", Origin.USER, False)
    assert once.sentence == "x-flipped (X flipped); you said it"
    assert GUESS.sentence == "body (as the poses (unity)); guessed, not sure: OBJ files say no axes"
    assert GUESS.title == "axes of cup.obj and rod.obj" and GUESS.title_by_bodies == "axes of meshes of cup and rod"
