import subprocess
import sys

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
    """Poses in axes of ROS, and STL files, which say no axes of their own."""
    write_scene(tmp_path, "ros", "stl")
    meshes = {name: tmp_path / f"{name}.stl" for name in ("tool", "plate")}
    session = import_session("csv", tmp_path / "take.csv", mapping=tmp_path / "map.toml", meshes=meshes)
    (row,) = open_rows(session)
    assert undecided_sentence(row, "s.mcap") == (
        "Not decided: axes of tool.stl and plate.stl. Taken for body; others: y-up, gltf. To see what each would "
        "change: replay doctor s.mcap --look. To decide: --mesh-axes when you import it"
    )


def test_guess_that_needs_another_import_names_its_key():
    """Angles are read once, so that no replay can try radians."""
    row = Assumption(
        Subject.ANGLE_UNIT,
        "deg",
        Origin.GUESS,
        Confidence.OPEN,
        reason="the largest number is 3.1",
        alternatives=("deg", "rad"),
    )
    (line,) = untried_lines(session_with(row))
    assert line == (
        "Not decided: unit of angles. Taken for deg: the largest number is 3.1. To decide: angle_unit in the mapping "
        "(deg or rad), and import again."
    )


def test_guesses_that_no_replay_changes_need_another_import():
    """A stated unit of angles, an open unit of lengths, which a replay can change, and an open unit of times."""
    stated = Assumption(Subject.ANGLE_UNIT, "deg", Origin.FILE)
    changeable, needs_import = (
        Assumption(subject, value, Origin.GUESS, Confidence.OPEN, alternatives=alternatives)
        for subject, value, alternatives in (
            (Subject.LENGTH_UNIT, "m", ("m", "cm")),
            (Subject.TIME_UNIT, "s", ("s", "ms")),
        )
    )
    session = session_with(stated, changeable, needs_import)
    assert [row.subject for row in untried_rows(session)] == [Subject.TIME_UNIT]
    assert [row.subject for row in open_rows(session)] == [Subject.LENGTH_UNIT]


def test_screen_lists_guesses_and_omits_stated_facts():
    """The unit of times is a guess, that of lengths stood in the file."""
    guess = Assumption(Subject.TIME_UNIT, "s", Origin.GUESS)
    stated = Assumption(Subject.LENGTH_UNIT, "m", Origin.FILE)
    assert guess_lines(session_with(guess, stated)) == [
        "Guessed by the import: unit of times (s). Why: replay info FILE.mcap -v"
    ]
    assert guess_lines(session_with(stated)) == []


def test_decisions_of_an_import_load_nothing_of_a_run():
    """Detectors, cutters and documents of a run would double the imports of a short command."""
    program = "import sys, replay.advice.open_guesses, replay.advice.sampled_contacts; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout.split()
    rooms = ("replay.cutting", "replay.detection", "replay.auditing", "numba")
    assert not [name for name in loaded if name.startswith(rooms)]


def test_four_undecided_sessions_are_named_and_more_are_implied():
    """Sessions are called a to e, of nine in all."""
    (four,), (five,) = (open_guesses_line("abcde"[:count], 9) for count in (4, 5))
    assert "in 4 of 9 sessions" in four and "(a, b, c, d)" in four
    assert "in 5 of 9 sessions" in five and "(a, b, c, d, ...)" in five
