import numpy as np
import pytest
from support.study_samples import ITEMS, a_class, codebook, metrics, names, questionnaire, write_answers

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


def test_questionnaire_is_sorted_by_student_with_reversed_items_flipped(tmp_path):
    """The file has its 12 students in reverse order; item e3 asks the other way round, so that 1 is read as 5."""
    answers, _ = a_class(count=12)
    file = write_answers(tmp_path / "q.csv", answers[::-1], names(count=12)[::-1])
    read = read_questionnaire(file, codebook())
    assert read.index.tolist() == names(count=12)
    expected = answers.copy()
    e3 = ITEMS.index("e3")
    expected[:, e3] = 6 - answers[:, e3]
    assert read[[*ITEMS]].to_numpy().tolist() == expected.tolist()


def test_student_id_like_a_name_is_refused_without_repeating_it():
    """Row 1 has a code, S1. Codes have a digit and at most 32 letters, digits, - and _; row 2 breaks that.

    It is empty, may be a name or an address, has a space, or has 41 signs; the refusal does not repeat it.
    """
    for student in ("", "Ada Lovelace", "ada", "ada@school.edu", "S 1", "S" * 40 + "1"):
        with pytest.raises(StudyRefusedError) as refused:
            check_pseudonyms(["S1", student], "q.csv")
        assert refused.value.rule == "ids", student
        assert "data row 2:" in str(refused.value), student
        assert student == "" or student not in str(refused.value), student


@pytest.mark.parametrize(
    ("wrong_rows", "listed"), [(5, "data row 2, 3, 4, 5, 6:"), (6, "data row 2, 3, 4, 5, 6, ...:")]
)
def test_at_most_five_rows_with_wrong_ids_are_listed(wrong_rows, listed):
    """Row 1 has a code, S1; the ``wrong_rows`` below it have a name in its place."""
    with pytest.raises(StudyRefusedError) as refused:
        check_pseudonyms(["S1", *["ada"] * wrong_rows], "q.csv")
    assert listed in str(refused.value)


def test_a_group_that_was_not_declared_is_refused(tmp_path):
    """The codebook declares first and second in column ``arm``; a student is in the third."""
    answers, _ = a_class(count=4)
    book = codebook(groups=("arm", ("first", "second")))
    file = write_answers(tmp_path / "q.csv", answers, extra={"arm": ["first", "second", "third", "first"]})
    with pytest.raises(StudyRefusedError) as refused:
        read_questionnaire(file, book)
    assert refused.value.rule == "undeclared-groups"


def test_class_recall_is_weighted_by_contact_frames():
    """A recall of 1.0 in 30 frames with contact and of 0.5 in ten; the third session has no contact and no recall."""
    sessions = metrics(contacts=np.arange(3.0))
    sessions["recall"], sessions["contact_frames"] = [1.0, 0.5, np.nan], [30, 10, 0]
    assert recall_of(sessions) == pytest.approx((30 * 1.0 + 10 * 0.5) / 40)


@pytest.mark.parametrize(
    ("recall_by_session", "contact_frames"),
    [([1, np.nan], [9, 9]), ([1, 1], [9, np.nan]), ([np.nan, np.nan], [0, 0])],
    ids=["no recall of the second", "contacts of the second not counted", "no contacts at all"],
)
def test_recall_of_a_class_needs_a_recall_of_every_session(recall_by_session, contact_frames):
    """Two sessions, each with its recall and its frames in contact; NaN: not measured."""
    sessions = metrics(contacts=np.arange(2.0))
    sessions["recall"], sessions["contact_frames"] = recall_by_session, contact_frames
    assert recall_of(sessions) is None


@pytest.mark.parametrize(
    "content",
    [
        pytest.param(b"Code,e1\nS01,2.5\nS02,\n", id="commas"),
        pytest.param(b"Code;e1\r\nS01;2,5\r\nS02;\r\n", id="semicolons and decimal commas"),
        pytest.param(b"\xef\xbb\xbfCode;e1\nS01;2,5\nS02\n", id="mark of UTF-8, and a short row"),
        pytest.param(b"sep=;\r\nCode;e1\r\nS01;2,5\r\nS02;\r\n;\r\n", id="line that names the separator"),
        pytest.param("Code\te1\r\nS01\t2,5\r\nS02\t\r\n".encode("utf-16"), id="tabs in UTF-16"),
        pytest.param(b'"Code";"e1"\n"S01";"2,5"\n\n"S02";""\n', id="quotes, and an empty line"),
        pytest.param(b" Code , e1 \n S01 , 2.5 \n S02 , \n", id="spaces"),
    ],
)
def test_spreadsheet_formats_give_the_same_rows(content, tmp_path):
    """The same table as different spreadsheets write it: student S01 answered 2.5 to item e1, S02 nothing."""
    (tmp_path / "q.csv").write_bytes(content)
    assert read_rows(tmp_path / "q.csv") == [{"Code": "S01", "e1": "2.5"}, {"Code": "S02", "e1": ""}]


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"Code,e1\nS01,2,5\n", "data row 1: 3 cells below 2 names of columns"),
        (b"Code,e1,e1\nS01,2,5\n", "two columns 'e1'"),
    ],
    ids=["decimal comma between commas", "name twice"],
)
def test_row_that_does_not_fit_its_heading_is_refused(content, sentence, tmp_path):
    """A questionnaire as CSV; ``sentence``: part of the refusal."""
    (tmp_path / "q.csv").write_bytes(content)
    with pytest.raises(StudyError, match=sentence):
        read_rows(tmp_path / "q.csv")


def test_heading_alone_has_no_rows(tmp_path):
    """The name of a column is written in Windows-1252, as old spreadsheets do: byte E4 is a letter."""
    (tmp_path / "q.csv").write_bytes("Code;\u00e41\n".encode("cp1252"))
    assert read_rows(tmp_path / "q.csv") == []


@pytest.mark.parametrize(
    ("answering", "recorded", "sentence_endings"),
    [
        pytest.param("S07", "s07", ["did you mean 's07'?", "did you mean 'S07'?"], id="case"),
        pytest.param("S7", "S07", ["did you mean 'S07'?", "did you mean 'S7'?"], id="leading zero"),
        pytest.param("S-07", "S07", ["did you mean 'S07'?", "did you mean 'S-07'?"], id="sign"),
        pytest.param(
            "student17", "studnet17", ["did you mean 'studnet17'?", "did you mean 'student17'?"], id="swapped letters"
        ),
        pytest.param("S07", "X99", ["matches no recording", "is not in the questionnaire"], id="unlike"),
        pytest.param("S07", "S07", [], id="equal"),
    ],
)
def test_student_missing_in_a_file_is_named(answering, recorded, sentence_endings):
    """One student answered and one is recorded: a sentence on the code of each, unless they are equal."""
    sentences = unmatched_students([answering], [recorded])
    assert len(sentences) == len(sentence_endings)
    assert all(sentence.endswith(ending) for sentence, ending in zip(sentences, sentence_endings, strict=True))


def test_students_are_joined_by_pseudonym_and_never_by_order():
    """Answers are those of S00 to S07, metrics stand in reverse order; the result is in the order of the answers."""
    answers, contacts = a_class(count=8)
    metrics_in_reverse = metrics(contacts)[::-1]
    means = means_of_students(metrics_in_reverse, questionnaire(answers), ["contacts_per_min"])
    assert means["contacts_per_min"].to_numpy() == pytest.approx(contacts)


@pytest.mark.parametrize("answer", [0.9, 5.1])
def test_answer_beyond_its_scale_is_refused_with_its_row(tmp_path, answer):
    """Items are answered from 1 to 5; the second of four students answers e1 beyond that."""
    answers, _ = a_class(count=4)
    answers[1, ITEMS.index("e1")] = answer
    file = write_answers(tmp_path / "q.csv", answers)
    with pytest.raises(StudyError, match=rf"data row 2, column e1: '{answer}' is not between 1 and 5"):
        read_questionnaire(file, codebook())


@pytest.mark.parametrize("answer", [1.0, 5.0])
def test_answers_at_the_ends_of_a_scale_are_read(tmp_path, answer):
    """Items are answered from 1 to 5; the second of four students answers e1 with one of these."""
    answers, _ = a_class(count=4)
    answers[1, ITEMS.index("e1")] = answer
    file = write_answers(tmp_path / "q.csv", answers)
    assert read_questionnaire(file, codebook())["e1"].iloc[1] == answer
