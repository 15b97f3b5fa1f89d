"""Guesses of an import that nobody has decided, as sentences."""

import subprocess
import sys

import pytest
from support.planted_sessions import write_scene

from replay.advice.open_guesses import (
    guess_lines,
    open_guesses_line,
    open_rows,
    undecided_sentence,
    untried_lines,
    untried_rows,
)
from sessions import Session
from sessions.importers import import_session
from sessions.model.assumption import ASSUMPTIONS_FACT, Assumption, Confidence, Origin, Subject, assumptions_fact


def session_with(*rows):
    """A session of one body with these rows of assumptions."""
    poses = {"a": ([[0, 0, 0]], [[0, 0, 0, 1]])}
    return Session.from_arrays([0], poses, {}, facts={ASSUMPTIONS_FACT: assumptions_fact(rows)})


def test_a_sentence_names_value_alternatives_and_the_option(tmp_path):
    """A recording in the axes of ROS with meshes in STL files, which say no axes: the import took those of the poses.

    The sentence about that open guess has its value ("body"), others, and the commands that show and decide it.
    """
    write_scene(tmp_path, "ros", "stl")
    meshes = {name: tmp_path / f"{name}.stl" for name in ("tool", "plate")}
    session = import_session("csv", tmp_path / "take.csv", mapping=tmp_path / "map.toml", meshes=meshes)
    (guess,) = open_rows(session)
    assert undecided_sentence(guess, "s.mcap") == (
        "Not decided: axes of tool.stl and plate.stl. Taken for body; others: y-up, gltf. To see what each would "
        "change: replay doctor s.mcap --look. To decide: --mesh-axes when you import it"
    )


def test_guess_that_needs_another_import_names_its_key():
    """The unit of angles was guessed, degrees; angles are read once, so that no replay can try radians.

    The sentence names the reason of the guess and the key of the import's mapping.
    """
    guess = Assumption(
        Subject.ANGLE_UNIT,
        value="deg",
        origin=Origin.GUESS,
        confidence=Confidence.OPEN,
        reason="the largest number is 3.1",
        alternatives=("deg", "rad"),
    )
    (line,) = untried_lines(session_with(guess))
    assert line == (
        "Not decided: unit of angles. Taken for deg: the largest number is 3.1. To decide: angle_unit in the mapping "
        "(deg or rad), and import again."
    )


def test_guesses_that_no_replay_changes_need_another_import():
    """Three assumptions: the unit of angles is stated; those of lengths and of times are open guesses.

    A replay can try another unit of lengths (``open_rows``), but not of times (``untried_rows``).
    """
    stated = Assumption(Subject.ANGLE_UNIT, "deg", Origin.FILE)
    of_lengths = Assumption(Subject.LENGTH_UNIT, "m", Origin.GUESS, Confidence.OPEN, alternatives=("m", "cm"))
    of_times = Assumption(Subject.TIME_UNIT, "s", Origin.GUESS, Confidence.OPEN, alternatives=("s", "ms"))
    session = session_with(stated, of_lengths, of_times)
    assert [row.subject for row in untried_rows(session)] == [Subject.TIME_UNIT]
    assert [row.subject for row in open_rows(session)] == [Subject.LENGTH_UNIT]


def test_screen_lists_guesses_and_omits_stated_facts():
    """The unit of times is a guess, that of lengths stood in the file; without a guess there is no line."""
    guess = Assumption(Subject.TIME_UNIT, "s", Origin.GUESS)
    stated = Assumption(Subject.LENGTH_UNIT, "m", Origin.FILE)
    assert guess_lines(session_with(guess, stated)) == [
        "Guessed by the import: unit of times (s). Why: replay info FILE.mcap -v"
    ]
    assert guess_lines(session_with(stated)) == []


def test_decisions_of_an_import_load_nothing_of_a_run():
    """A program of its own imports what decides guesses: no module that detects, cuts, audits or compiles comes along.

    These would double the time that a short command takes to start.
    """
    program = "import sys, replay.advice.open_guesses, replay.advice.sampled_contacts; print(*sys.modules)"
    printed = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout
    modules = printed.split()
    assert "replay.advice.sampled_contacts" in modules
    modules_of_a_run = ("replay.cutting", "replay.detection", "replay.auditing", "numba")
    assert [name for name in modules if name.startswith(modules_of_a_run)] == []


@pytest.mark.parametrize(
    ("sessions", "text"),
    [
        pytest.param(["a", "b", "c", "d"], "(a, b, c, d)", id="four: all named"),
        pytest.param(["a", "b", "c", "d", "e"], "(a, b, c, d, ...)", id="five: the first four"),
    ],
)
def test_four_undecided_sessions_are_named_and_more_are_implied(sessions, text):
    """A line about a batch of nine sessions, of which these have open guesses."""
    (line,) = open_guesses_line(sessions, 9)
    assert f"in {len(sessions)} of 9 sessions" in line
    assert text in line
