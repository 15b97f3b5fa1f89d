import numpy as np
import pytest
from support.study_samples import a_class, codebook, metrics, names, questionnaire, write_answers

from replay.errors import StudyError
from replay.studies.class_study.joining import (
    check_pseudonyms,
    means_of_students,
    read_questionnaire,
    read_rows,
    recall_of,
    unmatched_students,
)
from replay.studies.class_study.refusals import StudyRefusedError

BOOK = codebook()


def test_questionnaire_is_sorted_by_student_with_reversed_items_flipped(tmp_path):
    """The file has its 12 students in reverse; expected are the answers as they were made up."""
    answers, _ = a_class(count=12)
    file = write_answers(tmp_path / "q.csv", answers[::-1], names(count=12)[::-1])
    read = read_questionnaire(file, BOOK)
    assert read.equals(questionnaire(answers))


@pytest.mark.parametrize("student", ["", "Ada Lovelace", "ada", "ada@school.edu", "S 1", "S" * 40 + "1"])
def test_student_id_like_a_name_is_refused_without_repeating_it(student):
    """The first row is a code, 1, 5 or 6 rows follow with the name; up to five are listed."""
    for count, rows in ((1, "data row 2:"), (5, "data row 2, 3, 4, 5, 6:"), (6, "data row 2, 3, 4, 5, 6, ...:")):
        with pytest.raises(StudyRefusedError, match=rows) as refused:
            check_pseudonyms(["S1", *[student] * count], "q.csv")
    assert refused.value.rule == "ids"
    assert not student or student not in str(refused.value)


def test_a_group_that_was_not_declared_is_refused(tmp_path):
    """The codebook declares first and second; a student is in the third."""
    answers, _ = a_class(count=4)
    book = codebook(groups=("arm", ("first", "second")))
    file = write_answers(tmp_path / "q.csv", answers, extra={"arm": ["first", "second", "third", "first"]})
    with pytest.raises(StudyRefusedError) as refused:
        read_questionnaire(file, book)
    assert refused.value.rule == "undeclared-groups"


def test_class_recall_is_weighted_by_contact_frames():
    """Recalls of 1.0 in 30 frames and 0.5 in ten; a session without contact has none."""
    table = metrics(np.arange(3.0))
    table["recall"], table["contact_frames"] = [1.0, 0.5, np.nan], [30, 10, 0]
    assert recall_of(table) == pytest.approx((30 * 1.0 + 10 * 0.5) / 40)


@pytest.mark.parametrize(
    ("recall_by_session", "contact_frames"),
    [([1, np.nan], [9, 9]), ([1, 1], [9, np.nan]), ([np.nan, np.nan], [0, 0])],
    ids=["no recall of the second", "contacts of the second not counted", "no contacts at all"],
)
def test_recall_of_a_class_needs_a_recall_of_every_session(recall_by_session, contact_frames):
    two_sessions = metrics(np.arange(2.0))
    two_sessions["recall"], two_sessions["contact_frames"] = recall_by_session, contact_frames
    assert recall_of(two_sessions) is None


ROWS = [{"Code": "S01", "e1": "2.5"}, {"Code": "S02", "e1": ""}]


@pytest.mark.parametrize(
    "content",
    [
        b"Code,e1\nS01,2.5\nS02,\n",
        b"Code;e1\r\nS01;2,5\r\nS02;\r\n",
        b"\xef\xbb\xbfCode;e1\nS01;2,5\nS02\n",
        b"sep=;\r\nCode;e1\r\nS01;2,5\r\nS02;\r\n;\r\n",
        "Code\te1\r\nS01\t2,5\r\nS02\t\r\n".encode("utf-16"),
        b'"Code";"e1"\n"S01";"2,5"\n\n"S02";""\n',
        b" Code , e1 \n S01 , 2.5 \n S02 , \n",
    ],
)
def test_spreadsheet_formats_give_the_same_rows(content, tmp_path):
    """Commas, semicolons with decimal commas, tabs, marks of encodings, quotes, blanks and empty lines."""
    (tmp_path / "q.csv").write_bytes(content)
    assert read_rows(tmp_path / "q.csv") == ROWS


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"Code,e1\nS01,2,5\n", "data row 1: 3 cells below 2 names of columns"),
        (b"Code,e1,e1\nS01,2,5\n", "two columns 'e1'"),
        (b"Code;\xe41\n", None),
    ],
)
def test_row_that_does_not_fit_its_heading_is_refused(content, sentence, tmp_path):
    """``sentence``: of the refusal; None: a heading without rows, in Latin-1, is read as no row."""
    (tmp_path / "q.csv").write_bytes(content)
    if sentence is None:
        assert read_rows(tmp_path / "q.csv") == []
        return
    with pytest.raises(StudyError, match=sentence):
        read_rows(tmp_path / "q.csv")


@pytest.mark.parametrize(
    ("answering", "recorded", "meant"),
    [
        (["S07"], ["s07"], ["did you mean 's07'", "did you mean 'S07'"]),
        (["S7"], ["S07"], ["did you mean 'S07'", "did you mean 'S7'"]),
        (["S-07"], ["S07"], ["did you mean 'S07'", "did you mean 'S-07'"]),
        (["student17"], ["studnet17"], ["did you mean 'studnet17'", "did you mean 'student17'"]),
        (["S07"], ["X99"], ["matches no recording", "is not in the questionnaire"]),
        (["S07"], ["S07"], []),
    ],
)
def test_student_missing_in_a_file_is_named(answering, recorded, meant):
    """``meant``: of the sentences on the code in the questionnaire and on that in the recordings."""
    sentences = unmatched_students(answering, recorded)
    assert len(sentences) == len(meant)
    assert all(text in sentence for sentence, text in zip(sentences, meant, strict=True))


def test_students_are_joined_by_pseudonym_and_never_by_order():
    """The table of metrics is reversed."""
    answers, contacts = a_class(count=8)
    table = metrics(contacts)
    result = means_of_students(table[::-1], questionnaire(answers), ["contacts_per_min"])
    assert result["contacts_per_min"].to_numpy() == pytest.approx(contacts)


@pytest.mark.parametrize(("answer", "is_refused"), [(1.0, False), (5.0, False), (0.9, True), (5.1, True)])
def test_answer_beyond_its_scale_is_refused_with_its_row(tmp_path, answer, is_refused):
    """Items are answered from 1 to 5."""
    answers, _ = a_class(count=4)
    answers[1, 0] = answer
    file = write_answers(tmp_path / "q.csv", answers)
    if is_refused:
        with pytest.raises(StudyError, match=rf"data row 2, column e1: '{answer}' is not between 1 and 5"):
            read_questionnaire(file, codebook())
    else:
        assert read_questionnaire(file, codebook())["e1"].iloc[1] == answer
