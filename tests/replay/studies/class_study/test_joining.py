import numpy as np
import pytest
from support.study_samples import a_class, codebook, metrics, names, questionnaire, write_answers

from replay.errors import StudyError
from replay.studies.class_study.joining import check_pseudonyms, means_of_students, read_questionnaire
from replay.studies.class_study.refusals import StudyRefusedError

BOOK = codebook()


def test_answers_are_read_sorted_by_student_and_turned_where_reversed(tmp_path):
    answers, _ = a_class(12)
    file = write_answers(tmp_path / "q.csv", answers[::-1], names(12)[::-1])
    read = read_questionnaire(file, BOOK)
    assert list(read.students) == names(12)
    assert read.answers["m2"] == pytest.approx(answers[:, 4])
    assert read.answers["e3"] == pytest.approx(6.0 - answers[:, 2])
    assert read.scores(BOOK.constructs["motivation"]) == pytest.approx(answers[:, 3:].mean(axis=1))


@pytest.mark.parametrize(
    "value, words", [(6.0, "data row 3, column m1: 6 is off the scale 1 to 5"), (0.0, "off the scale")]
)
def test_an_answer_off_its_scale_is_refused_with_row_and_column(tmp_path, value, words):
    answers, _ = a_class(12)
    answers[2, 3] = value
    with pytest.raises(StudyError, match=words):
        read_questionnaire(write_answers(tmp_path / "q.csv", answers), BOOK)


def test_words_for_an_answer_are_refused(tmp_path):
    file = tmp_path / "q.csv"
    file.write_text("who,e1,e2,e3,m1,m2,m3\nS1,1,2,3,often,5,4\n")
    with pytest.raises(StudyError, match="data row 1, column m1: 'often' is no number"):
        read_questionnaire(file, BOOK)


@pytest.mark.parametrize("text, words", [("", "no rows"), ("who,e1\nS1,2\n", "lacks the column 'e2'")])
def test_a_file_without_the_columns_is_refused(tmp_path, text, words):
    file = tmp_path / "q.csv"
    file.write_text(text)
    with pytest.raises(StudyError, match=words):
        read_questionnaire(file, BOOK)


@pytest.mark.parametrize("student", ["", "Ada Lovelace", "ada", "ada@school.edu", "S 1", "S" * 40 + "1"])
def test_what_may_be_a_name_is_refused_and_not_repeated(student):
    with pytest.raises(StudyRefusedError) as refused:
        check_pseudonyms(["S1", student], "q.csv")
    assert refused.value.rule == "ids" and "data row 2" in str(refused.value)
    assert not student or student not in str(refused.value)


def test_a_student_who_answered_twice_is_refused(tmp_path):
    answers, _ = a_class(3)
    with pytest.raises(StudyRefusedError, match=r"ids.*") as refused:
        read_questionnaire(write_answers(tmp_path / "q.csv", answers, ["S1", "S2", "S1"]), BOOK)
    assert "S1 answered more than once" in str(refused.value)


def test_a_group_that_was_not_declared_is_refused(tmp_path):
    answers, _ = a_class(4)
    book = codebook(groups=("arm", ("first", "second")))
    file = write_answers(tmp_path / "q.csv", answers, extra={"arm": ["first", "second", "third", "first"]})
    with pytest.raises(StudyRefusedError) as refused:
        read_questionnaire(file, book)
    assert refused.value.rule == "undeclared-groups"


def test_recall_of_a_class_counts_every_contact_frame_once_and_students_without_any_not_at_all():
    table = metrics(np.arange(3.0))
    table.columns["recall"] = [1.0, 0.5, None]
    table.columns["contact_frames"] = [30, 10, 0]
    assert table.recall() == pytest.approx((30 * 1.0 + 10 * 0.5) / 40)


@pytest.mark.parametrize("recall, frames", [([1.0, None], [10, 10]), ([1.0, 1.0], [10, None]), ([None, None], [0, 0])])
def test_a_recall_that_was_not_measured_everywhere_is_none(recall, frames):
    table = metrics(np.arange(2.0))
    table.columns["recall"], table.columns["contact_frames"] = recall, frames
    assert table.recall() is None


def test_students_are_joined_by_pseudonym_and_never_by_place():
    answers, contacts = a_class(8)
    table = metrics(contacts)
    turned = type(table)({name: values[::-1] for name, values in table.columns.items()})
    found = means_of_students(turned, questionnaire(answers), ["contacts_per_min"])
    assert found["contacts_per_min"] == pytest.approx(contacts)


def test_a_student_in_one_file_only_is_refused_by_pseudonym():
    answers, contacts = a_class(8)
    with pytest.raises(StudyRefusedError, match="S07 in one of the files only"):
        means_of_students(metrics(contacts[:7]), questionnaire(answers), [])
