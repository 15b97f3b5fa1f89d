"""A study from answers and metrics: what is found, refused and said, and its page and files."""

import csv
import json
import re
from dataclasses import replace
from functools import cache
from io import StringIO
from types import SimpleNamespace

import numpy as np
import pytest
from pandas import concat
from rich.console import Console
from support.study_samples import ITEMS, a_class, codebook, made_class, metrics, questionnaire

from replay.cli.study_tables import study_tables as study_tables_screen
from replay.errors import OutputError, StudyError
from replay.studies.class_study import groups
from replay.studies.class_study.analysis import Sensitivity, analyse
from replay.studies.class_study.class_runs import read_class
from replay.studies.class_study.class_tables import places
from replay.studies.class_study.folder import as_json, write_study
from replay.studies.class_study.page import Heading, study_html
from replay.studies.class_study.refusals import StudyRefusedError
from replay.studies.class_study.regression import Finding
from replay.studies.class_study.tables import (
    CELL_TEXTS,
    families_text,
    headlines,
    opening_sentence,
    result_name,
    study_tables,
    undecided_text,
)

GROUP_NAMES = ("first", "second")
EASE, CONTACTS = ("motivation", "ease of use"), ("motivation", "contacts_per_min")
"""Outcome and predictor of a regression."""
NO_REGRESSIONS = codebook(questions=())
TWO_REGRESSIONS = codebook((EASE, CONTACTS))
TWO_REGRESSIONS_AND_GROUPS = codebook((EASE, CONTACTS), groups=("arm", GROUP_NAMES))
"""Codebooks; ``arm`` is the column that says in which group a student is."""
GROUP_OF_EACH_STUDENT = [*GROUP_NAMES] * 20
"""40 students, in the two groups in turn."""


@cache
def study_of_class(count=40, other="hybrid", *, recall=0.9, scattered=False, arms=False):
    """A study by exact in which contacts go with motivation, ease of use does not; again with the other detector.

    The other one finds ``recall`` of the contacts of each student; ``scattered``: those of another student. ``arms``:
    exact counts nine contacts a minute more in one of two groups, which hides that contacts go with motivation.
    """
    answers, contacts = a_class(count, seed=1, slope=0.0, contacts=0.75)
    detectors, recalls = (("exact", other), (1.0, recall)) if other else (("exact",), (1.0,))
    table = metrics(contacts, detectors=detectors, recall=recalls)
    is_other = table["detector"] == other
    if scattered:
        table.loc[is_other, "contacts_per_min"] = np.random.default_rng(0).permutation(contacts)
    if arms:
        table.loc[~is_other, "contacts_per_min"] += 9.0 * (np.arange(count) % 2)
    if arms:
        answered = questionnaire(answers, GROUP_OF_EACH_STUDENT)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(groups, "PERMUTATIONS", 999)  # of 4,999: enough for a p below 0.05 of three outcomes
            return analyse(TWO_REGRESSIONS_AND_GROUPS, answered, table)
    return analyse(TWO_REGRESSIONS, questionnaire(answers), table)


def rules_of_refusals(result):
    """Rules by which a study refused something."""
    return {refused.rule for refused in result.refusals}


def test_study_finds_only_the_planted_association():
    """Ease of use goes with motivation in 52 students (0.7 in the model); contacts a minute go with nothing."""
    answers, contacts = a_class(count=52, seed=3)
    study = analyse(TWO_REGRESSIONS, questionnaire(answers), metrics(contacts))
    ease, moved = study.coefficients
    assert ease.associated and ease.low < ease.beta < ease.high
    assert ease.beta > 0.3, "0.7, less what answers on a scale from 1 to 5 lose"
    assert not moved.associated
    assert (study.students, study.rows, study.detector, study.recall) == (52, 52, "exact", 1.0)
    assert not study.refusals


def finding_of_contacts(low, high, p):
    """Finding of a regression of motivation on contacts, 40 students: the 95 % interval of beta, and p."""
    ends = {"beta": (low + high) / 2, "low": low, "high": high, "p": p, "p_holm": p}
    return Finding(name="contacts_per_min", kind="simple", variables=CONTACTS, students=40, **ends)


def association(sign=1):
    """A finding of contacts with p below 0.05 and an interval without zero, positive or negative."""
    low, high = sorted((sign * 0.1, sign * 1.2))
    return finding_of_contacts(low, high, p=0.04)


def no_association():
    """A finding of contacts with p far above 0.05 and an interval that holds zero."""
    return finding_of_contacts(-0.1, 0.2, p=0.5)


def with_hybrid(by_exact, by_hybrid):
    """A result by exact, and by the detector hybrid."""
    return Sensitivity("hybrid", recall=0.9, before=by_exact, after=by_hybrid)


INTERVAL_HOLDS_ZERO = finding_of_contacts(-0.1, 1.2, p=0.04)
ABOVE_THE_LEVEL = finding_of_contacts(0.1, 1.2, p=0.06)
WITHOUT_P = finding_of_contacts(0.1, 1.2, p=None)


@pytest.mark.parametrize(
    ("finding", "conclusion"),
    [
        pytest.param(association(sign=1), "associated", id="positive"),
        pytest.param(association(sign=-1), "associated", id="negative"),
        pytest.param(INTERVAL_HOLDS_ZERO, "undecided: interval holds zero", id="interval holds zero"),
        pytest.param(ABOVE_THE_LEVEL, "not distinguished from chance", id="p above 0.05"),
        pytest.param(WITHOUT_P, "not tested", id="no p"),
    ],
)
def test_association_needs_p_below_the_level_and_interval_without_zero(finding, conclusion):
    """The level is 0.05; a finding has its interval of beta and its p, and the id says which is no association's."""
    assert finding.conclusion == conclusion


@pytest.mark.parametrize(
    ("by_exact", "by_hybrid", "conclusion"),
    [
        pytest.param(association(), INTERVAL_HOLDS_ZERO, "another conclusion", id="association lost"),
        pytest.param(INTERVAL_HOLDS_ZERO, association(), "another conclusion", id="association gained"),
        pytest.param(association(sign=1), association(sign=-1), "another conclusion", id="other sign"),
        pytest.param(INTERVAL_HOLDS_ZERO, ABOVE_THE_LEVEL, "the same", id="no association for another reason"),
        pytest.param(association(), None, "not tested", id="no finding by hybrid"),
    ],
)
def test_detector_changes_a_conclusion_with_an_association_or_its_sign(by_exact, by_hybrid, conclusion):
    """The same result by exact, the reference, and by the detector hybrid, the id says how they differ."""
    assert with_hybrid(by_exact, by_hybrid).conclusion == conclusion


UNKNOWN = "whether the detector changes a conclusion is not known, since"

STATES = {
    "no questionnaire": (lambda: None, f"{UNKNOWN} there is no questionnaire."),
    "one detector": (
        lambda: study_of_class(other=""),
        f"{UNKNOWN} no result about contacts could be compared between detectors.",
    ),
    "hybrid finds 90 % of the contacts of each student": (study_of_class, "the detector changes no conclusion."),
    "hybrid counts the contacts of other students": (
        lambda: study_of_class(scattered=True),
        "the detector changes 1 conclusion: the association of contacts per minute with motivation holds with exact, "
        "not with hybrid.",
    ),
    "exact counts more contacts in one of two groups": (
        lambda: study_of_class(arms=True, recall=1.0),
        "the detector changes 2 conclusions: the association of contacts per minute with motivation holds with hybrid, "
        "not with exact; "
        "the difference in contacts per minute (group second less group first) holds with exact, not with hybrid.",
    ),
    "nine students, of whom nothing is tested": (
        lambda: study_of_class(count=9),
        f"{UNKNOWN} no result could be tested with another detector.",
    ),
}


@pytest.mark.parametrize(("make_study", "sentence"), STATES.values(), ids=STATES)
def test_study_headline_states_whether_a_conclusion_changes(make_study, sentence):
    """The study is that of 40 students by exact, and again by the detector hybrid; the id says what differs."""
    assert opening_sentence(make_study(), "40 students") == f"40 students: {sentence}"


RESULT = "the association of contacts per minute with motivation"


@pytest.mark.parametrize(
    ("by_a", "by_others", "text"),
    [
        pytest.param(
            association(),
            {"b": no_association(), "c": no_association(), "d": no_association()},
            f"{RESULT} holds with a, not with b, c or d",
            id="lost with three",
        ),
        pytest.param(
            no_association(),
            {"b": association(), "c": association()},
            f"{RESULT} holds with b and c, not with a",
            id="gained with two",
        ),
        pytest.param(
            association(sign=1),
            {"b": no_association(), "c": association(sign=-1)},
            f"{RESULT} holds with a, not with b; {RESULT} has another sign with c than with a",
            id="lost with one, reversed with another",
        ),
    ],
)
def test_detectors_changing_the_same_conclusion_share_a_sentence(by_a, by_others, text):
    """The study counts contacts with detector a; ``by_others``: the same result again with other detectors."""
    rows = [Sensitivity(label, recall=0.9, before=by_a, after=finding) for label, finding in by_others.items()]
    study = SimpleNamespace(detector="a", sensitivity=rows, findings=[by_a])
    assert opening_sentence(study, "9 students") == f"9 students: the detector changes 1 conclusion: {text}."


WHICHEVER = "whichever collision detector counts the contacts"


@pytest.mark.parametrize(
    ("retested", "findings", "answer"),
    [
        pytest.param(
            [with_hybrid(no_association(), no_association()), with_hybrid(association(), association())],
            [no_association(), association()],
            "the detector changes no conclusion",
            id="contacts associated, by both detectors",
        ),
        pytest.param(
            [with_hybrid(no_association(), no_association())],
            [no_association(), association()],
            f"no association with behaviour was found, {WHICHEVER}",
            id="only answers associated, which no detector counts",
        ),
        pytest.param(
            [with_hybrid(no_association(), no_association())],
            [no_association()],
            f"no association was found, {WHICHEVER}",
            id="nothing associated",
        ),
        pytest.param(
            [with_hybrid(no_association(), no_association())],
            [no_association(), INTERVAL_HOLDS_ZERO],
            f"no clear association was found, {WHICHEVER}",
            id="one result undecided",
        ),
    ],
)
def test_study_headline_states_where_no_association_was_found(retested, findings, answer):
    """``retested``: results about contacts by exact and by hybrid; ``findings``: all results by exact."""
    study = SimpleNamespace(sensitivity=retested, findings=findings)
    assert opening_sentence(study, "40 students") == f"40 students: {answer}."


def undecided_coefficient():
    """A coefficient of ease of use beside other predictors: p is 0.04, and not below 0.05 after Holm's correction."""
    return SimpleNamespace(
        students=40,
        p=0.04,
        kind="multiple",
        name="ease of use",
        outcome="motivation",
        conclusion="undecided after Holm",
    )


def study_with_findings(*findings):
    """Stands for a study of which no result is an association."""
    return SimpleNamespace(coefficients=(), groups=(), findings=findings)


def test_headline_states_the_student_count_once():
    """Two results of the same 40 students, neither an association."""
    finding = SimpleNamespace(students=40, p=0.5, conclusion="")
    (line,) = headlines(study_with_findings(finding, finding))
    assert line == "No association could be distinguished from chance in 40 students"


def test_headline_names_two_undecided_results():
    """A result is undecided if p is not below 0.05 after Holm's correction: one of two, or all of three are.

    Two of the three are named.
    """
    undecided, decided = undecided_coefficient(), SimpleNamespace(students=40, p=0.5, conclusion="")
    named = "ease of use with motivation, others held constant"
    (line,) = headlines(study_with_findings(decided, undecided))
    assert line == f"1 of 2 results is undecided: {named}. The others may be chance"
    (line,) = headlines(study_with_findings(undecided, undecided, undecided))
    assert line == f"3 of 3 results are undecided: among them {named}; {named}"


def test_tables_mark_only_associations():
    """The cell of a conclusion; a marked cell is printed bold."""
    conclusion_cell = CELL_TEXTS["conclusion"]
    assert conclusion_cell("associated").mark != ""
    assert conclusion_cell("refused").mark == ""


AFTER_HOLM = replace(finding_of_contacts(0.1, 1.2, p=0.017), p_holm=0.1)
AFTER_HOLM_SENTENCE = (
    "Undecided means here: p is 0.017 alone, which is below 0.05, but 0.100 after correction for 3 associations tested "
    "together."
)
HOLDS_ZERO_TEXT = "p is 0.040, which is below 0.05, but the 95 % interval holds zero."


@pytest.mark.parametrize(
    ("coefficients", "text"),
    [
        pytest.param((no_association(), AFTER_HOLM, no_association()), AFTER_HOLM_SENTENCE, id="after Holm"),
        pytest.param(
            (no_association(), INTERVAL_HOLDS_ZERO),
            f"Undecided means here: {HOLDS_ZERO_TEXT}",
            id="interval holds zero",
        ),
        pytest.param(
            (INTERVAL_HOLDS_ZERO, AFTER_HOLM, no_association()),
            f"{AFTER_HOLM_SENTENCE} Undecided means also: {HOLDS_ZERO_TEXT}",
            id="both",
        ),
        pytest.param((no_association(),), "", id="nothing undecided"),
    ],
)
def test_undecided_is_defined_by_the_result_that_is(coefficients, text):
    """p is below 0.05 alone and above after Holm's correction for all coefficients, or the interval holds zero."""
    study = SimpleNamespace(coefficients=coefficients, groups=(), findings=coefficients)
    assert undecided_text(study) == text
    assert families_text(study) == "", "all results are associations"


def test_comparisons_of_groups_are_corrected_and_counted_apart():
    """A coefficient, and a difference of groups that is undecided after Holm's correction."""
    coefficients, groups = (no_association(),), (replace(AFTER_HOLM, kind="groups"),)
    study = SimpleNamespace(coefficients=coefficients, groups=groups, findings=coefficients + groups)
    assert undecided_text(study).endswith("after correction for 1 comparison of groups tested together.")
    assert families_text(study) == "The results are 1 association and 1 comparison of groups."


def test_detector_with_fewest_misses_is_chosen_unless_requested_otherwise():
    """The detector hull50 finds half of the contacts, hybrid 80 %: hybrid is chosen, or the one that is requested.

    A request for a detector without metrics ("exakt") is refused.
    """
    answers, contacts = a_class(count=30)
    table = metrics(contacts, detectors=("hull50", "hybrid"), recall=(0.5, 0.8))
    assert analyse(NO_REGRESSIONS, questionnaire(answers), table).detector == "hybrid"
    requested = analyse(NO_REGRESSIONS, questionnaire(answers), table, detector="hull50")
    assert (requested.detector, requested.recall) == ("hull50", pytest.approx(0.5))
    with pytest.raises(StudyError, match="there are: hull50, hybrid"):
        analyse(NO_REGRESSIONS, questionnaire(answers), table, detector="exakt")


def test_reference_is_chosen_of_detectors_that_miss_nothing():
    """The detector hull50 finds every contact too, but may report false ones: exact, the reference, is chosen."""
    answers, contacts = a_class(count=30)
    table = metrics(contacts, detectors=("hull50", "exact"), recall=(1.0, 1.0))
    assert analyse(NO_REGRESSIONS, questionnaire(answers), table).detector == "exact"


@pytest.mark.parametrize(
    ("recall", "first_letter", "rule"),
    [
        pytest.param(None, "S", "provenance", id="recall not measured"),
        pytest.param(1.0, "X", "ids", id="recorded students X00, X01, ... answered nothing"),
    ],
)
def test_behaviour_that_cannot_be_used_is_refused(class_runs, recall, first_letter, rule):
    """Students S00 to S29 answered: ease of use is analysed alone, and the refusal of contacts is in the file too."""
    answers, contacts = a_class(count=30)
    table = metrics(contacts, recall=(recall,))
    table["student"] = table["student"].str.replace("S", first_letter)
    study = analyse(TWO_REGRESSIONS, questionnaire(answers), table)
    assert [finding.variables for finding in study.coefficients] == [EASE]
    (refused,) = study.refusals
    assert refused.rule == rule and "contacts_per_min" in refused.what
    (written,) = json.loads(json.dumps(as_json(class_runs, study), allow_nan=False))["refused"]
    assert written["rule"] == rule
    assert written["lift"] != "", "what would lift the rule"


def test_misspelt_student_leaves_the_others_in_the_study():
    """S07 of 30 students is s7 in the recordings: 29 count for contacts, 30 for the answers.

    The terminal is told both spellings; the warning, which is shared with the page, only that there are two.
    """
    answers, contacts = a_class(count=30)
    table = metrics(contacts).replace({"student": {"S07": "s7"}})
    study = analyse(TWO_REGRESSIONS, questionnaire(answers), table)
    assert [(finding.variables, finding.students) for finding in study.coefficients] == [(EASE, 30), (CONTACTS, 29)]
    assert study.unmatched == (
        "'S07' of the questionnaire matches no recording; did you mean 's7'?",
        "'s7' of the recordings is not in the questionnaire; did you mean 'S07'?",
    )
    (warning,) = [sentence for sentence in study.warnings if "only one file" in sentence]
    assert warning.startswith("2 students") and "S07" not in warning


@pytest.mark.parametrize("count", [5, 9])
def test_below_ten_students_there_is_no_p(count):
    """So many students have a coefficient of ease of use on motivation, without a p-value and Bartlett's test."""
    answers, contacts = a_class(count)
    study = analyse(codebook((EASE,)), questionnaire(answers), metrics(contacts))
    (coefficient,) = study.coefficients
    assert (coefficient.students, coefficient.p) == (count, None)
    assert study.bartlett is None
    assert "few-students" in rules_of_refusals(study)
    assert headlines(study) == ["No association was tested"]


def test_study_of_four_students_is_refused():
    """No output summarises fewer than five students, who could be recognised: the rule ``small-cell``."""
    answers, contacts = a_class(count=4)
    with pytest.raises(StudyRefusedError, match="small-cell"):
        analyse(codebook((EASE,)), questionnaire(answers), metrics(contacts))


@pytest.mark.parametrize(
    ("predictor", "text"),
    [
        pytest.param("arm", r"'arm'.*without a regression", id="column of groups"),
        pytest.param("contact_per_min", "did you mean 'contacts_per_min'", id="letter missing"),
    ],
)
def test_unknown_name_in_a_codebook_is_refused_with_a_suggestion(predictor, text):
    """A regression of motivation on what is neither a scale nor a metric."""
    answers, contacts = a_class(count=40)
    book = codebook((("motivation", predictor),), groups=("arm", GROUP_NAMES))
    with pytest.raises(StudyError, match=text):
        analyse(book, questionnaire(answers, GROUP_OF_EACH_STUDENT), metrics(contacts))


@pytest.fixture
def few_permutations(monkeypatch):
    """Groups are compared by 99 permutations, which is enough where no p and no interval is looked at."""
    monkeypatch.setattr(groups, "PERMUTATIONS", 99)
    monkeypatch.setattr(groups, "STUDENTISED_DRAWS", 99)


@pytest.mark.usefixtures("few_permutations")
@pytest.mark.parametrize(
    ("answering", "sizes", "rules"),
    [
        (5, {"ease of use": (20, 20), "motivation": (20, 5)}, set()),
        (4, {"ease of use": (20, 20)}, {"small-cell"}),
    ],
)
def test_group_with_fewer_than_five_answers_is_not_compared(answering, sizes, rules):
    """Two groups of 20; of the second only ``answering`` students answered item m1, without which is no motivation.

    ``sizes``: outcome -> students of both groups, where compared; ``rules``: those by which a comparison was refused.
    """
    answers, contacts = a_class(count=40)
    students_of_second_group = np.arange(1, 40, 2)
    answers[students_of_second_group[: 20 - answering], ITEMS.index("m1")] = np.nan
    book = codebook(questions=(), groups=("arm", GROUP_NAMES))
    study = analyse(book, questionnaire(answers, GROUP_OF_EACH_STUDENT), metrics(contacts))
    assert {pair.outcome: (pair.first_students, pair.second_students) for pair in study.groups} == sizes
    assert rules_of_refusals(study) == rules


@pytest.mark.usefixtures("few_permutations")
def test_size_of_a_group_below_five_is_not_printed():
    """40 students are in three groups, of 31, 5 and 4: the last size is "fewer than 5"."""
    answers, contacts = a_class(count=40)
    group_of_each = ["first"] * 31 + ["second"] * 5 + ["third"] * 4
    book = codebook(questions=(), groups=("arm", ("first", "second", "third")))
    study = analyse(book, questionnaire(answers, group_of_each), metrics(contacts))
    assert study.group_sizes == {"first": "31", "second": "5", "third": "fewer than 5"}


def test_a_construct_that_only_four_students_answered_has_no_figure():
    """All of 20 students but four left out item e1, the first of ease of use; motivation is answered by all."""
    answers, contacts = a_class(count=20)
    answers[4:, ITEMS.index("e1")] = np.nan
    study = analyse(codebook((EASE,)), questionnaire(answers), metrics(contacts))
    assert [*study.reliabilities] == ["motivation"]
    assert study.kmo is None and study.bartlett is None, "they are of all items together"
    assert not study.coefficients
    assert rules_of_refusals(study) == {"small-cell"}


def test_student_with_several_sessions_counts_once_by_mean():
    """30 students with two sessions each, as far above their mean as below, and 18 more of the first at the mean.

    These 78 rows give the figures of a study with one session a student, at the mean.
    """
    answers, contacts = a_class(count=30)
    at_the_mean, two_each = metrics(contacts), metrics(contacts, sessions=2)
    two_each["contacts_per_min"] += np.repeat(np.random.default_rng(1).normal(size=30), 2) * np.tile([1.0, -1.0], 30)
    many = concat([two_each, *[at_the_mean[:1]] * 18])
    study = analyse(TWO_REGRESSIONS, questionnaire(answers), many)
    expected = analyse(TWO_REGRESSIONS, questionnaire(answers), at_the_mean)
    assert (study.rows, study.students) == (78, 30)
    for row, expected_row in zip(study.coefficients, expected.coefficients, strict=True):
        figures = (expected_row.beta, expected_row.low, expected_row.high, expected_row.p)
        assert (row.beta, row.low, row.high, row.p) == pytest.approx(figures)


def test_detector_of_constant_contacts_counts_as_not_tested():
    """``blind`` never reports a contact, a constant that goes with nothing; of grasps both have the same numbers."""
    answers, contacts = a_class(count=40, seed=1)
    table = metrics(contacts, detectors=("exact", "blind"), recall=(1.0, 0.0))
    table["grasps"] = np.repeat(np.arange(40), 2) % 7  # two rows a student, one a detector
    study = analyse(codebook((EASE, CONTACTS, ("motivation", "grasps"))), questionnaire(answers), table)
    conclusions = {row.before.name: row.conclusion for row in study.sensitivity}
    assert conclusions == {"contacts_per_min": "not tested", "grasps": "the same"}
    beta_by_blind = study_tables(study)["sensitivity"].column("beta")
    assert [beta is None for beta in beta_by_blind] == [True, False]


@pytest.fixture(scope="module")
def class_runs(tmp_path_factory):
    """Run folders of six students with a session each; ``slow`` used other settings in the third."""
    result = read_class(made_class(tmp_path_factory.mktemp("class"), sessions=6, students=6, contacts=3))
    result.metrics["run002"]["slow"]["settings"] = "other"
    return result


@pytest.fixture(scope="module")
def study_of_everything():
    """A study of 40 students, 31 and 9 in two groups, with two sessions each by exact and hybrid.

    Five students left out item m1; all stirred equally often, which is refused as a result.
    """
    answers, contacts = a_class(count=40, seed=3)
    answers[:5, ITEMS.index("m1")] = np.nan
    table = metrics(contacts, detectors=("exact", "hybrid"), recall=(1.0, 0.9), sessions=2)
    table["stirs"] = 1.0
    regressions = (EASE, (*CONTACTS, "grasps"), ("ease of use", "stirs"))
    group_of_each = ["first"] * 31 + ["second"] * 9
    return analyse(codebook(regressions, groups=("arm", GROUP_NAMES)), questionnaire(answers, group_of_each), table)


def test_the_page_of_a_study_reads_so(class_runs, study_of_everything, snapshot):
    """Text of a page, without figures, styles and tags, a block a line, is as in the snapshot file.

    40 students (31 and 9 in two groups) by exact and hybrid; six others are recorded. Five left out item m1, so n is 35
    where it is needed. All stirred equally often: both results about stirs, a regression and a comparison, are refused.
    """
    links = places(class_runs, class_runs.top)
    page = study_html(class_runs, links, study_of_everything, Heading("Class of 2026"))
    page = re.sub(r"<(style|script|svg)\b.*?</\1>", "", page, flags=re.S)
    page = re.sub(r"</(td|th)>", " | ", re.sub(r"</(p|tr|h[1-6]|li|summary|caption)>", "\n", page))
    assert re.sub(r"[ \n]*\n[ \n]*", "\n", re.sub("<[^>]+>", "", page)) == snapshot


@pytest.mark.parametrize("has_bartlett", [True, False])
def test_page_tests_all_items_together_where_students_are_enough(class_runs, study_of_everything, has_bartlett):
    """Bartlett's test of all items needs ten students; without it the page of a study has no such heading."""
    study = study_of_everything if has_bartlett else replace(study_of_everything, bartlett=None)
    page = study_html(class_runs, places(class_runs, class_runs.top), study, Heading("Class of 2026"))
    assert ("All items together" in page) == has_bartlett


TABLE_OF_RESULTS = r"result +figure +conclusion"
"""Heading of the table of all results in the terminal."""


def test_verbose_terminal_lists_associated_results_first(class_runs, tmp_path):
    """Only the second of two results, of contacts, is an association; both are in the order of the codebook."""
    study = study_of_class()
    not_associated, associated = study.findings
    assert (not_associated.conclusion, associated.conclusion) == ("not distinguished from chance", "associated")
    console = Console(width=200, file=StringIO())
    console.print(study_tables_screen(study, class_runs, tmp_path, verbose=True))
    _, table = re.split(TABLE_OF_RESULTS, console.file.getvalue())
    assert table.index(result_name(associated)) < table.index(result_name(not_associated))


def test_only_the_verbose_terminal_lists_all_results(class_runs, tmp_path):
    """A study of two results, printed without ``verbose``: the table of all results is left out."""
    console = Console(width=200, file=StringIO())
    console.print(study_tables_screen(study_of_class(), class_runs, tmp_path, verbose=False))
    assert console.file.getvalue().strip() != ""
    assert not re.search(TABLE_OF_RESULTS, console.file.getvalue())


@pytest.fixture(scope="module")
def study_folder(class_runs, tmp_path_factory):
    """The files of the study of 40 students and two regressions."""
    return write_study(class_runs, study_of_class(), tmp_path_factory.mktemp("written") / "study", inputs={})


def test_counts_of_students_are_integers_in_the_files(study_folder):
    """The file associations.csv has a row for each of two results of 40 students: "40", not "40.0".

    Motivation goes with contacts and not with ease of use: ``associated`` is True of the second alone.
    """
    with (study_folder / "associations.csv").open(newline="", encoding="utf-8-sig") as file:
        rows = [*csv.DictReader(file)]
    assert [(row["students"], row["associated"]) for row in rows] == [("40", "False"), ("40", "True")]


def test_study_folder_holds_no_pseudonym(study_folder):
    """Students S00 to S39 answered and are in no file; recorded students, S000 to S005, are links of the page.

    The file associations.csv has a row for each of two regressions.
    """
    texts = [file.read_text("utf-8") for file in study_folder.iterdir()]
    assert [re.findall(r"\bS\d\d\b", text) for text in texts] == [[]] * len(texts)
    heading, *rows = (study_folder / "associations.csv").read_text("utf-8-sig").splitlines()
    assert heading.startswith("outcome,predictor,") and len(rows) == 2


def test_study_folder_is_replaced_by_force_alone(class_runs, tmp_path):
    """A study is written twice to one folder; a folder that is no study is not replaced even by force."""
    study = study_of_class()
    out = write_study(class_runs, study, tmp_path / "study", inputs={})
    with pytest.raises(OutputError, match="--force"):
        write_study(class_runs, study, out, inputs={})
    write_study(class_runs, study, out, inputs={}, force=True)
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "chapter.txt").write_text("years of work")
    with pytest.raises(OutputError, match="is not a study folder"):
        write_study(class_runs, study, tmp_path / "thesis", inputs={}, force=True)
