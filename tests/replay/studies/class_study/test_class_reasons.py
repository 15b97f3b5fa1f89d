"""The most frequent cause of misses is reported where five students or more had it."""

from types import SimpleNamespace

import numpy as np
import pytest

from replay.studies.class_study.class_reasons import reason


def tables_of(**counts_of_cause):
    """Tables of a class whose hull50 missed contacts: cause -> misses of each student."""
    counts = {("hull50", cause): np.array(misses, dtype=float) for cause, misses in counts_of_cause.items()}
    return SimpleNamespace(counts=lambda *_: counts, students_with=np.count_nonzero)


@pytest.mark.parametrize(
    ("counts_of_cause", "sentences"),
    [
        ({"slow": [2] * 6, "thin": [1] * 5}, ["hull50 is wrong: slow (12 of 17 missed or late contacts)."]),
        ({"slow": [2] * 6, "thin": [9, 0, 0, 0, 0, 0]}, ["hull50 is wrong: slow (most missed or late contacts)."]),
        ({"slow": [2] * 6, "": [9] * 6}, ["hull50 is wrong: slow (most missed or late contacts)."]),
        (
            {"slow": [1] * 5, "thin": [1] * 5},
            [
                "hull50 is wrong: slow (5 of 10 missed or late contacts).",
                "hull50 is wrong: thin (5 of 10 missed or late contacts).",
            ],
        ),
        ({"slow": [9, 9, 9, 9, 0]}, []),
        ({}, []),
    ],
    ids=["most frequent", "of one student", "unknown", "tie", "four students", "no misses"],
)
def test_cause_of_most_misses_is_reported_with_its_count(counts_of_cause, sentences):
    """A number from which that of fewer than five students follows is not printed."""
    first, *others = sentences or [""]
    result = reason(tables_of(**counts_of_cause), study=None)
    assert (result.text, result.figures) == (first, " ".join(others))
