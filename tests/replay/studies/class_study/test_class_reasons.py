"""The most frequent cause of misses is reported where five students or more had it."""

from types import SimpleNamespace

import numpy as np
import pytest

from replay.studies.class_study.class_reasons import reason


def tables_of(**misses_of_students):
    """Tables of a class whose detector hull50 missed contacts: cause -> misses of each student."""
    counts = {("hull50", cause): np.array(misses, dtype=float) for cause, misses in misses_of_students.items()}
    return SimpleNamespace(counts=lambda *_: counts, students_with=np.count_nonzero)


@pytest.mark.parametrize(
    ("misses_of_students", "sentences"),
    [
        pytest.param(
            {"slow": [2, 2, 2, 2, 2, 2], "thin": [1, 1, 1, 1, 1]},
            ["hull50 is wrong: slow (12 of 17 missed or late contacts)."],
            id="most frequent of two causes",
        ),
        pytest.param(
            {"slow": [2, 2, 2, 2, 2, 2], "thin": [9, 0, 0, 0, 0, 0]},
            ["hull50 is wrong: slow (most missed or late contacts)."],
            id="other cause of a single student",
        ),
        pytest.param(
            {"slow": [2, 2, 2, 2, 2, 2], "": [9, 9, 9, 9, 9, 9]},
            ["hull50 is wrong: slow (most missed or late contacts)."],
            id="other cause not known",
        ),
        pytest.param(
            {"slow": [1, 1, 1, 1, 1], "thin": [1, 1, 1, 1, 1]},
            [
                "hull50 is wrong: slow (5 of 10 missed or late contacts).",
                "hull50 is wrong: thin (5 of 10 missed or late contacts).",
            ],
            id="two causes equally often",
        ),
        pytest.param({"slow": [9, 9, 9, 9, 0]}, [], id="four students"),
        pytest.param({}, [], id="no misses"),
    ],
)
def test_cause_of_most_misses_is_reported_with_its_count(misses_of_students, sentences):
    """Two causes, "slow" and "thin"; a cause of fewer than five students is not named, nor one that is not known.

    "most" stands for a count from which the misses of such a cause would follow.
    """
    result = reason(tables_of(**misses_of_students), study=None)
    first, *others = sentences or [""]
    assert (result.text, result.figures) == (first, " ".join(others))
