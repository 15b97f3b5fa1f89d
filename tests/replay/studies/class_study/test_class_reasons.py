"""The most frequent cause of misses is reported where five students or more had it."""

from types import SimpleNamespace

import numpy as np
import pytest

from replay.studies.class_study.class_reasons import reason
from replay.studies.class_study.class_tables import Mistakes


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
    """Two causes, "slow" and "thin", with the misses of each student; hull50 is the detector that missed.

    A cause of fewer than five students is not named, nor one that is not known ("").
    "most" stands for a count from which the misses of such a cause would follow.
    """
    result = reason(tables_of(**misses_of_students), study=None)
    first, *others = sentences or [""]
    assert (result.text, result.figures) == (first, " ".join(others))


def study_of_change(mistakes_of, changing):
    """Tables of a class with the mistakes of each detector and no cause, and a study whose conclusions some change.

    The detector of the study itself is hull50.
    """
    runs = SimpleNamespace(audited_detectors=[*mistakes_of], titles={})
    tables = SimpleNamespace(counts=lambda *_: {}, mistakes=mistakes_of.get, runs=runs)
    return tables, SimpleNamespace(changing_detectors=changing, detector="hull50", retested_results=())


@pytest.mark.parametrize(("prolonging", "end"), [(4, "(all only prolong"), (3, "(3 only prolong"), (0, "contacts.")])
def test_false_contacts_that_only_prolong_are_counted(prolonging, end):
    """``prolonging``: of four false contacts those that begin or end at a true one."""
    mistakes = Mistakes(10, missed=1, late_or_cut_short=2, false_contacts=4, prolonging=prolonging)
    text = reason(*study_of_change({"hull50": mistakes}, changing=("hull50",))).text
    assert "missed 1 of 10 contacts, was late or cut short in 2 and reported 4 false contacts" in text
    assert f"4 false contacts {end}" in text or (not prolonging and text.endswith(end))


def test_detector_that_changes_a_conclusion_comes_first():
    """``slow`` changes it; hull50, with more wrong contacts, is the detector of the study, and sphere neither."""
    few = Mistakes(contacts=10, missed=1, late_or_cut_short=0, false_contacts=0)
    many = Mistakes(contacts=10, missed=5, late_or_cut_short=4, false_contacts=0)
    mistakes_of = {"sphere": many, "hull50": many, "slow": few}
    answer = reason(*study_of_change(mistakes_of, changing=("slow",)))
    assert answer.text.startswith("slow leads to another conclusion")
    assert answer.figures.startswith("hull50 missed 5 of 10") and "sphere" not in answer.figures


def test_detectors_without_a_mistake_explain_no_change():
    """``slow`` changes a conclusion, and neither it nor the detector of the study got a contact wrong."""
    right = Mistakes(contacts=10, missed=0, late_or_cut_short=0, false_contacts=0)
    tables, study = study_of_change({"hull50": right, "slow": right}, changing=("slow",))
    study.nothing_associated = False
    assert reason(tables, study).text == ""


@pytest.mark.parametrize(("contacts", "end"), [(10, "slow 1."), (12, "slow 1 of 12.")])
def test_mistakes_that_change_nothing_are_counted(contacts, end):
    """hull50 got 9 of 10 contacts wrong (5 missed, 4 late), ``slow`` one of 10 or 12, which is said if it differs."""
    hull50 = Mistakes(contacts=10, missed=5, late_or_cut_short=4, false_contacts=0)
    slow = Mistakes(contacts, missed=1, late_or_cut_short=0, false_contacts=0)
    tables, study = study_of_change({"hull50": hull50, "slow": slow}, changing=())
    study.nothing_associated, study.same_results = False, True
    study.retested_results = (SimpleNamespace(detector="slow"),)
    text = reason(tables, study).text
    assert "hull50 got 9 of 10 contacts wrong" in text and text.endswith(end)
