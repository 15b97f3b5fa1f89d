"""The sentence on colliders before and after says what falls, what rises, what stays, and the time if it is known."""

import pytest

from replay.document.before_after import Count, Errors, change_text, errors_of_row, worse_text


def errors_of_detector(false=0.86, missed=(0, 1, 0.5), late=(0, 0, 0.0), seconds=None, contacts=18):
    """Errors of a detector: the fraction of its contact time that is false, and contacts missed and late, of 18.

    ``missed``, ``late``: smallest, largest and mean number over the sampling offsets; ``seconds``: of a frame.
    """
    return Errors(contacts, false, Count(*missed), Count(*late), seconds)


BEFORE = errors_of_detector()

STATES = {
    "better": (
        errors_of_detector(false=0.19, missed=(0, 0, 0.0)),
        "False 86 % -> 19 %, missed up to 1 -> 0 of 18; 28 pieces",
        "",
    ),
    "worse in missed": (
        errors_of_detector(false=0.19, missed=(0, 2, 0.75)),
        "False 86 % -> 19 %, but missed up to 1 -> up to 2 of 18; 28 pieces",
        "More contacts are missed than before.",
    ),
    "worse in the mean alone": (
        errors_of_detector(false=0.19, missed=(0, 1, 0.75)),
        "False 86 % -> 19 %, but missed up to 1 of 18 (0.5 -> 0.75 on average); 28 pieces",
        "More contacts are missed than before.",
    ),
    "worse in late": (
        errors_of_detector(false=0.19, late=(5, 9, 7.0)),
        "False 86 % -> 19 %, missed up to 1 as before, but late or cut short 0 -> 5 to 9 of 18; 28 pieces",
        "More contacts are late or cut short than before.",
    ),
    "worse in both": (
        errors_of_detector(false=0.19, missed=(1, 2, 1.5), late=(5, 9, 7.0)),
        "False 86 % -> 19 %, but missed up to 1 -> 1 to 2 and late or cut short 0 -> 5 to 9 of 18; 28 pieces",
        "More contacts are missed, and more are late or cut short, than before.",
    ),
    "worse in false": (
        errors_of_detector(false=0.9, missed=(0, 0, 0.0)),
        "Missed up to 1 -> 0 of 18, but false 86 % -> 90 %; 28 pieces",
        "More contact time is false than before.",
    ),
    "worse in all": (
        errors_of_detector(false=0.9, missed=(1, 2, 1.5), late=(5, 9, 7.0)),
        "False 86 % -> 90 % and missed up to 1 -> 1 to 2 and late or cut short 0 -> 5 to 9 of 18; 28 pieces",
        "More contacts are missed, and more are late or cut short, and more contact time is false, than before.",
    ),
    "equal": (errors_of_detector(), "False 86 % as before, missed up to 1 of 18 as before; 28 pieces", ""),
}


@pytest.mark.parametrize(("after", "text", "worse"), STATES.values(), ids=STATES)
def test_change_sentence_names_values_before_and_after_a_fix(after, text, worse):
    """Before: 86 % false, up to 1 of 18 contacts missed (0.5 on average), none late; after: colliders of 28 pieces.

    ``worse``: the sentence on what has risen.
    """
    assert change_text(BEFORE, after, "28 pieces") == text
    assert worse_text(BEFORE, after) == worse


def test_errors_absent_before_and_after_share_one_clause():
    """86 % false contact goes with other colliders; nothing is missed or late before or after."""
    before, after = errors_of_detector(missed=(0, 0, 0.0)), errors_of_detector(false=0.0, missed=(0, 0, 0.0))
    assert change_text(before, after, "1 piece") == "False 86 % -> 0 %, none missed or late; 1 piece"


@pytest.mark.parametrize(
    ("seconds_before", "seconds_after", "text"),
    [
        (1e-5, 3e-5, "; 0.02 ms a frame more"),
        (3e-5, 1e-5, "; 0.02 ms a frame less"),
        (None, 1e-5, ""),
        (1e-5, None, ""),
    ],
)
def test_time_is_a_difference_where_both_were_measured(seconds_before, seconds_after, text):
    """Seconds of a frame with colliders before and after, None: not measured; 2e-5 s are 0.02 ms.

    Errors are the same, 86 % false.
    """
    before = errors_of_detector(missed=(0, 0, 0.0), seconds=seconds_before)
    after = errors_of_detector(missed=(0, 0, 0.0), seconds=seconds_after)
    assert change_text(before, after, "2 pieces") == f"False 86 % as before, none missed or late; 2 pieces{text}"


def test_row_of_scoring_is_read_with_its_ranges():
    """A row has mean, smallest and largest count over sampling offsets; false null, of nothing reported, is 0."""
    row = {
        "false": None,
        "missed": 0.5,
        "missed_smallest": 0.0,
        "missed_largest": 1.0,
        "late": 2.0,
        "late_smallest": 2.0,
        "late_largest": 2.0,
    }
    expected = errors_of_detector(false=0.0, missed=(0, 1, 0.5), late=(2, 2, 2.0), seconds=1e-3)
    assert errors_of_row(row, contacts=18, seconds=1e-3) == expected
