import json

import numpy as np
import pytest

from replay.errors import OutputError
from replay.studies.class_study.codebook import read_codebook
from replay.studies.class_study.joining import read_questionnaire
from replay.studies.class_study.synthetic_class import draw_class, make_class
from sessions import read_session


def scale_means(drawn, short):
    """Each student's mean of the four answers of a scale, the fourth reversed."""
    answers = np.array([[item.answers[f"{short}{k}"] for k in range(1, 5)] for item in drawn], dtype=float)
    answers[:, 3] = 6.0 - answers[:, 3]
    return answers.mean(axis=1)


def test_made_up_students_are_numbered_and_take_turns_in_groups():
    """The first and third of four students are in one group, the second and fourth in the other."""
    drawn = draw_class(4)
    assert [student.pseudonym for student in drawn] == ["S01", "S02", "S03", "S04"]
    assert drawn[0].group == drawn[2].group != drawn[1].group == drawn[3].group


def test_traits_and_touches_go_together_as_the_model_says():
    """The model's correlations (0.6, 0.3, -0.6) times the reliability of the answers, of 1,500 students."""
    drawn = draw_class(1500)
    ease, motivation = scale_means(drawn, "ease"), scale_means(drawn, "mot")
    touches = [len(item.touches) for item in drawn]
    near = [item.near for item in drawn]
    assert np.corrcoef(ease, motivation)[0, 1] == pytest.approx(0.6 * 0.82, abs=0.06)
    assert np.corrcoef(scale_means(drawn, "imm"), motivation)[0, 1] == pytest.approx(0.3 * 0.82, abs=0.06)
    assert np.std(motivation) == pytest.approx(np.std(ease), rel=0.03)
    assert np.corrcoef(ease, touches)[0, 1] == pytest.approx(-0.6 * 0.9, abs=0.06)
    assert abs(np.corrcoef(near, motivation)[0, 1]) < 0.05
    assert abs(np.corrcoef(scale_means(drawn, "use"), motivation)[0, 1]) < 0.05


def test_made_up_students_who_find_tasks_hard_touch_briefly():
    """Brief touches last less than 0.02 s; about half of 400 students touch so, and two times more."""
    plain, drawn = draw_class(400), draw_class(400, are_touches_brief=True)
    assert [item.answers for item in plain] == [item.answers for item in drawn]
    lengths = {len(set(item.touches)) for item in drawn}
    brief = np.array([item.touches[0] < 0.02 for item in drawn])
    counts = np.array([len(item.touches) for item in drawn])
    assert lengths == {1} and 0.4 < brief.mean() < 0.6
    assert set(counts[brief]) == {12, 13, 14} and set(counts[~brief]) == {10, 11, 12}
    assert scale_means(drawn, "ease")[brief].mean() < 3.0 < scale_means(drawn, "ease")[~brief].mean()


def test_larger_class_contains_the_smaller_class():
    """The first four of nine students are those of a class of four, of the same seed."""
    assert draw_class(students=9, seed=3)[:4] == draw_class(students=4, seed=3) != draw_class(students=4, seed=4)


@pytest.mark.slow
def test_class_on_disk_reads_back_and_keeps_existing_sessions(tmp_path):
    """The session of S02 is deleted: the second time it is the only one that is made."""
    out, done = tmp_path / "class", []
    assert make_class(out, students=3, seed=1) == {}
    answers = read_questionnaire(out / "questionnaire.csv", read_codebook(out / "codebook.yaml"))
    assert answers.index.tolist() == ["S01", "S02", "S03"]
    assert read_session(out / "sessions" / "S03.mcap").facts["pseudonym"] == "S03"
    assert json.loads((out / "truth.json").read_text())["model"]["ease_motivation"] == 0.6
    (out / "sessions" / "S02.mcap").unlink()
    assert make_class(out, students=3, seed=1, on_done=lambda *one: done.append(one)) == {}
    assert done == [("S02", "done")] and (out / "sessions" / "S02.mcap").is_file()


def test_made_up_class_overwrites_no_folder_of_another_kind(tmp_path):
    """The folder holds another file, or a class of one student where six, or brief touches, are asked for."""
    (tmp_path / "mine.txt").write_text("x")
    with pytest.raises(OutputError, match="something else"):
        make_class(tmp_path, students=5)
    make_class(tmp_path / "class", students=1)
    with pytest.raises(OutputError, match="another seed or size"):
        make_class(tmp_path / "class", students=6)
    with pytest.raises(OutputError, match="another seed or size"):
        make_class(tmp_path / "class", students=1, brief=True)
