"""The first line of a page, in every state."""

from dataclasses import replace

import numpy as np
import pytest
from support.study_samples import a_class, codebook, metrics, questionnaire

from replay.studies.class_study.analysis import analyse
from replay.studies.class_study.tables import changes, sensitivity_table

ASKED = (("motivation", "ease of use"), ("motivation", "contacts_per_min"))


def study(count=40, other="hybrid", turned=False, groups=None, recall=0.9):
    answers, contacts = a_class(count, seed=1, slope=0.0, contacts=0.75)
    table = metrics(contacts, detectors=("exact", other)[: 1 + bool(other)], recall=(1.0, recall)[: 1 + bool(other)])
    if turned:
        place = [k for k, name in enumerate(table.columns["detector"]) if name == other]
        for row, seen in zip(place, np.random.default_rng(0).permutation(contacts), strict=True):
            table.columns["contacts_per_min"][row] = seen
    if groups:
        later = np.arange(count) % 2
        for row in range(len(table.columns["student"])):
            shift = 4.0 * later[int(table.columns["student"][row][1:])]
            table.columns["contacts_per_min"][row] += shift if table.columns["detector"][row] == "exact" else 0.0
    half = [groups[k % 2] for k in range(count)] if groups else ()
    declared = ("arm", groups) if groups else None
    return analyse(codebook(ASKED, declared), questionnaire(answers, half), table)


UNKNOWN = "Whether a conclusion changes with the detector is not known: "
STATES = {
    "none": (lambda: None, UNKNOWN + "there is no questionnaire."),
    "one detector": (
        lambda: study(other=""),
        UNKNOWN + "no result about contacts could be compared between detectors.",
    ),
    "the same": (study, "No conclusion changes when hybrid decides what a contact was: 1 tested, n = 40."),
    "another": (
        lambda: study(turned=True),
        "1 of 1 conclusion changed with the detector: contacts per minute with motivation (seen by hybrid).",
    ),
    "nobody tested": (
        lambda: study(9),
        "Whether a conclusion changes when hybrid decides what a contact was is not known: none was tested.",
    ),
}


@pytest.mark.parametrize("state", STATES)
def test_the_first_line_says_whether_a_conclusion_changes(state):
    make, said = STATES[state]
    assert changes(make()) == said


def test_what_another_detector_does_not_let_be_fitted_is_counted_as_not_tested():
    answers, contacts = a_class(40, seed=1)
    table = metrics(contacts, detectors=("exact", "blind"), recall=(1.0, 0.0))
    table.columns["grasps"] = [float(row // 2 % 7) for row in range(80)]
    asked = codebook((*ASKED, ("motivation", "grasps")))
    found = analyse(asked, questionnaire(answers), table)
    words = {row.predictor: row.conclusion for row in found.sensitivity}
    assert words == {"contacts_per_min": "not tested", "grasps": "the same"}
    assert changes(found).endswith(": 1 tested, n = 40; 1 could not be tested.")
    assert ["none" in str(row) for row in sensitivity_table(found).rows] == [True, False]


def test_a_comparison_of_groups_that_hangs_on_the_detector_is_among_the_conclusions():
    found = study(groups=("first", "second"), recall=1.0)
    row = next(row for row in found.sensitivity if row.predictor == "second against first")
    assert row.changes and row.outcome == "contacts_per_min" and row.conclusion == "another conclusion"
    assert "second against first with contacts per minute (seen by hybrid)" in changes(found)
    assert "Of groups, beta is the difference of their means." in sensitivity_table(found).notes


def test_students_are_said_as_a_range_where_results_use_different_ones():
    found = study()
    (row,) = found.sensitivity
    more = replace(found, sensitivity=(row, replace(row, students=31)))
    assert changes(more).endswith("2 tested, n = 31 to 40.")
