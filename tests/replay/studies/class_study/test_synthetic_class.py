import json

import numpy as np
import pytest

from replay.errors import OutputError
from replay.studies.class_study import synthetic_class
from replay.studies.class_study.codebook import read_codebook
from replay.studies.class_study.joining import read_questionnaire
from replay.studies.class_study.synthetic_class import draw_class, make_class
from sessions import read_session


def scale_means(students, scale):
    """Each student's mean of the four answers on a scale (ease, mot, imm or use), of which the fourth is reversed."""
    answers = np.array([[student.answers[f"{scale}{k}"] for k in (1, 2, 3, 4)] for student in students], dtype=float)
    answers[:, 3] = 6.0 - answers[:, 3]
    return answers.mean(axis=1)


def test_made_up_students_are_numbered_and_take_turns_in_groups():
    """The first and third of four students are in one group, the second and fourth in the other."""
    students = draw_class(4)
    assert [student.pseudonym for student in students] == ["S01", "S02", "S03", "S04"]
    first, second, third, fourth = (student.group for student in students)
    assert first == third != second == fourth


@pytest.fixture(scope="module")
def large_class():
    """1,500 students of the model: their correlations scatter by at most 1 / sqrt(1500) = 0.026."""
    return draw_class(1500)


FOUR_ANSWERS = 0.82
"""Reliability of a scale: a trait has variance 1, the mean of four answers beside it noise of 0.8^2 / 4 and rounding.

1 / (1 + 0.16 + 1 / 48) is 0.85, and answers are cut at 1 and 5.
"""


def test_answers_are_1_to_5_and_touches_at_most_8(large_class):
    """Every answer from 1 to 5 and every number of touches from 0 to 8 occurs among 1,500 students."""
    assert {answer for student in large_class for answer in student.answers.values()} == {1, 2, 3, 4, 5}
    assert {len(student.touches) for student in large_class} == {0, 1, 2, 3, 4, 5, 6, 7, 8}


def test_traits_go_together_as_the_model_says(large_class):
    """The model's correlations with motivation, 0.6 of ease and 0.3 of immersion, times the scales' reliability, 0.82.

    To 0.06: more than two standard errors of 1,500 students, 0.026 each.
    """
    motivation = scale_means(large_class, "mot")
    ease, immersion = scale_means(large_class, "ease"), scale_means(large_class, "imm")
    assert np.corrcoef(ease, motivation)[0, 1] == pytest.approx(0.6 * FOUR_ANSWERS, abs=0.06)
    assert np.corrcoef(immersion, motivation)[0, 1] == pytest.approx(0.3 * FOUR_ANSWERS, abs=0.06)


def test_touches_go_with_ease_as_the_model_says(large_class):
    """The model's correlation, -0.6, times the square root of the scale's reliability, 0.82; touches have no error.

    To 0.06: more than two standard errors of 1,500 students, 0.026 each.
    """
    touches = [len(student.touches) for student in large_class]
    ease = scale_means(large_class, "ease")
    assert np.corrcoef(ease, touches)[0, 1] == pytest.approx(-0.6 * np.sqrt(FOUR_ANSWERS), abs=0.06)


def test_near_misses_and_usefulness_go_with_nothing(large_class):
    """In the model neither is associated with motivation: two standard errors of 1,500 students are 0.05."""
    motivation = scale_means(large_class, "mot")
    near_misses = [student.near for student in large_class]
    assert abs(np.corrcoef(near_misses, motivation)[0, 1]) < 0.05
    assert abs(np.corrcoef(scale_means(large_class, "use"), motivation)[0, 1]) < 0.05


def test_motivation_scatters_as_much_as_other_traits(large_class):
    """Every trait has a deviation of 1, though motivation is a sum: 3 % for the scatter of 1,500 students."""
    assert np.std(scale_means(large_class, "mot")) == pytest.approx(np.std(scale_means(large_class, "ease")), rel=0.03)


def test_made_up_students_who_find_tasks_hard_touch_briefly():
    """About half of 200 students find tasks hard: they touch 12 to 14 times for 0.013 s (a sample of 50 Hz: 0.02 s).

    The others touch 10 to 12 times for 0.15 s. Answers are those of the class without brief touches; on their scale
    from 1 to 5 the middle is 3.
    """
    usual, students = draw_class(200), draw_class(200, are_touches_brief=True)
    assert [student.answers for student in students] == [student.answers for student in usual]
    is_brief = np.array([student.touches[0] == 0.013 for student in students])
    assert 0.4 < is_brief.mean() < 0.6
    for student, brief in zip(students, is_brief, strict=True):
        assert set(student.touches) == {0.013 if brief else 0.15}
    counts = np.array([len(student.touches) for student in students])
    assert set(counts[is_brief]) == {12, 13, 14} and set(counts[~is_brief]) == {10, 11, 12}
    ease, middle_of_scale = scale_means(students, "ease"), 3.0
    assert ease[is_brief].mean() < middle_of_scale < ease[~is_brief].mean()


def test_larger_class_contains_the_smaller_class():
    """The first four of nine students are those of a class of four of the same seed; another seed has others."""
    assert draw_class(students=9, seed=3)[:4] == draw_class(students=4, seed=3)
    assert draw_class(students=4, seed=3) != draw_class(students=4, seed=4)


@pytest.mark.slow
def test_class_on_disk_reads_back_and_keeps_existing_sessions(tmp_path):
    """Three students; the session of S02 is deleted, and is the only one that is made the second time.

    ``make_class`` returns the sessions that could not be made: none.
    """
    out, finished = tmp_path / "class", []
    assert make_class(out, students=3, seed=1) == {}
    answers = read_questionnaire(out / "questionnaire.csv", read_codebook(out / "codebook.yaml"))
    assert answers.index.tolist() == ["S01", "S02", "S03"]
    assert read_session(out / "sessions" / "S03.mcap").facts["pseudonym"] == "S03"
    assert json.loads((out / "truth.json").read_text())["model"]["ease_motivation"] == 0.6
    (out / "sessions" / "S02.mcap").unlink()
    assert make_class(out, students=3, seed=1, on_done=lambda *event: finished.append(event)) == {}
    assert finished == [("S02", "done")]
    assert (out / "sessions" / "S02.mcap").is_file()


def test_made_up_class_overwrites_no_other_file(tmp_path):
    """The folder in which a class of five students is to be made holds a text of the user."""
    (tmp_path / "mine.txt").write_text("x")
    with pytest.raises(OutputError, match="something else"):
        make_class(tmp_path, students=5)


def test_made_up_class_overwrites_no_other_class(tmp_path, monkeypatch):
    """The folder holds a class of one student with usual touches: six students, or brief touches, are another class.

    The session of the student is not recorded, since only the folder's other files say which class it is.
    """
    monkeypatch.setattr(synthetic_class, "record_student", lambda *_: "")
    make_class(tmp_path / "class", students=1)
    with pytest.raises(OutputError, match="another seed or size"):
        make_class(tmp_path / "class", students=6)
    with pytest.raises(OutputError, match="another seed or size"):
        make_class(tmp_path / "class", students=1, brief=True)
