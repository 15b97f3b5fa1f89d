"""The first line of a page, in every state."""

from dataclasses import replace

import numpy as np
import pytest
from support.study_samples import a_class, codebook, metrics, questionnaire

from replay.studies.class_study.analysis import analyse, compared, findings_of
from replay.studies.class_study.tables import opening, sensitivity_table

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


STATES = {
    "none": (lambda: None, "Not known: there is no questionnaire."),
    "one detector": (
        lambda: study(other=""), "Not known: no result about contacts could be compared between detectors.",
    ),
    "the same": (study, "No."),
    "another": (
        lambda: study(turned=True),
        "Yes: contacts per minute with motivation holds with exact, not with hybrid.",
    ),
    "nobody tested": (lambda: study(9), "Not known: no result could be tested with another detector."),
}  # fmt: skip


@pytest.mark.parametrize("state", STATES)
def test_the_first_line_says_whether_a_conclusion_changes(state):
    make, answer = STATES[state]
    assert opening(make(), "40 students") == f"40 students. Does the detector change a conclusion? {answer}"


def test_what_another_detector_does_not_let_be_fitted_is_counted_as_not_tested():
    answers, contacts = a_class(40, seed=1)
    table = metrics(contacts, detectors=("exact", "blind"), recall=(1.0, 0.0))
    table.columns["grasps"] = [float(row // 2 % 7) for row in range(80)]
    asked = codebook((*ASKED, ("motivation", "grasps")))
    found = analyse(asked, questionnaire(answers), table)
    words = {row.before.name: row.conclusion for row in found.sensitivity}
    assert words == {"contacts_per_min": "not tested", "grasps": "the same"}
    assert [row is None for row in sensitivity_table(found).column("beta")] == [True, False]


def test_a_comparison_of_groups_that_hangs_on_the_detector_is_among_the_conclusions():
    found = study(groups=("first", "second"), recall=1.0)
    row = next(row for row in found.sensitivity if row.before.name == "second against first")
    assert row.changes and row.outcome == "contacts_per_min" and row.conclusion == "another conclusion"
    assert "second against first with contacts per minute holds with" in opening(found, "40 students")
    assert "Of groups, beta is the difference of their means." in sensitivity_table(found).notes


def test_a_conclusion_changes_where_one_detector_leaves_it_open():
    found = study()
    (one,) = [r for r in found.regressions if r.coefficients[0].name == "contacts_per_min"]
    table = metrics(np.arange(40.0), detectors=("exact",))
    open_ = replace(one, coefficients=(replace(one.coefficients[0], low=-0.1, p=0.01),))
    for before, after in ((one, open_), (open_, one), (open_, open_), (one, one)):
        (row,) = compared(findings_of([before], ()), findings_of([after], ()), table)
        assert row.changes == (before is not after)
