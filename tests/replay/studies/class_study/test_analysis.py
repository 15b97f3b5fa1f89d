import numpy as np
import pytest
from support.study_samples import a_class, codebook, metrics, questionnaire

from replay.errors import StudyError
from replay.studies.class_study.analysis import analyse
from replay.studies.class_study.refusals import StudyRefusedError
from replay.studies.class_study.regression import Finding

BEHAVIOUR = (("motivation", "ease of use"), ("motivation", "contacts_per_min"))


def test_a_planted_association_is_found_and_an_absent_one_is_not():
    answers, contacts = a_class(52, seed=3)
    study = analyse(codebook(BEHAVIOUR), questionnaire(answers), metrics(contacts))
    ease, moved = (one.coefficients[0] for one in study.regressions)
    assert ease.associated and ease.low < ease.beta < ease.high and ease.beta > 0.3
    assert not moved.associated
    assert (study.students, study.rows, study.detector, study.recall) == (52, 52, "exact", 1.0)
    assert not study.refusals


@pytest.mark.parametrize("sign", [1, -1])
def test_an_association_needs_both_its_p_and_its_interval(sign):
    def one(low, high, p):
        return Finding("contacts_per_min", 0.8 * sign, *sorted((low * sign, high * sign)), p, p_holm=p).associated

    assert one(0.1, 1.2, 0.04)
    assert not one(-0.1, 1.2, 0.04)
    assert not one(0.1, 1.2, 0.06)
    assert not one(0.1, 1.2, None)


def test_a_conclusion_that_hangs_on_the_detector_is_shown():
    answers, contacts = a_class(52, seed=1, slope=0.0, contacts=0.6)
    table = metrics(contacts, detectors=("exact", "blind"), recall=(1.0, 0.4))
    seen = np.random.default_rng(0).permutation(52)
    blind = [k for k, name in enumerate(table.columns["detector"]) if name == "blind"]
    for row, other in zip(blind, seen, strict=True):
        table.columns["contacts_per_min"][row] = contacts[other]
    study = analyse(codebook(BEHAVIOUR), questionnaire(answers), table)
    (row,) = [one for one in study.sensitivity if one.before.name == "contacts_per_min"]
    assert row.changes and row.detector == "blind" and row.recall == pytest.approx(0.4)
    assert not any(one.before.name == "ease of use" for one in study.sensitivity)


def test_the_detector_that_misses_least_is_chosen_and_another_on_request():
    answers, contacts = a_class(30)
    table = metrics(contacts, detectors=("hybrid", "exact"), recall=(0.8, 1.0))
    assert analyse(codebook(BEHAVIOUR), questionnaire(answers), table).detector == "exact"
    assert analyse(codebook(BEHAVIOUR), questionnaire(answers), table, detector="hybrid").recall == pytest.approx(0.8)
    even = metrics(contacts, detectors=("hull50", "exact"), recall=(1.0, 1.0))
    assert analyse(codebook(BEHAVIOUR), questionnaire(answers), even).detector == "exact"
    with pytest.raises(StudyError, match="there are: hybrid, exact"):
        analyse(codebook(BEHAVIOUR), questionnaire(answers), table, detector="exakt")


def test_without_a_measured_recall_no_result_about_behaviour_is_given():
    answers, contacts = a_class(30)
    study = analyse(codebook(BEHAVIOUR), questionnaire(answers), metrics(contacts, recall=(None,)))
    assert [one.outcome for one in study.regressions] == ["motivation"]
    (refused,) = study.refusals
    assert refused.rule == "provenance" and "contacts_per_min" in refused.what and "audited" in refused.lift


@pytest.mark.parametrize("count", [5, 9])
def test_fewer_than_ten_students_get_coefficients_without_p_and_the_rule_is_named(count):
    answers, contacts = a_class(count)
    study = analyse(codebook(), questionnaire(answers), metrics(contacts))
    (fit,) = study.regressions
    assert fit.students == count and fit.coefficients[0].p is None and study.bartlett is None
    assert {one.rule for one in study.refusals} >= {"few-students"}


def test_four_students_are_no_study():
    answers, contacts = a_class(4)
    with pytest.raises(StudyRefusedError) as refused:
        analyse(codebook(), questionnaire(answers), metrics(contacts))
    assert refused.value.rule == "small-cell"


ARMS = codebook(groups=("arm", ("first", "second")))


def test_groups_are_compared_only_when_declared_and_large_enough():
    answers, contacts = a_class(40)
    study = analyse(ARMS, questionnaire(answers, ["first", "second"] * 20), metrics(contacts))
    assert [two.outcome for two in study.groups] == ["ease of use", "motivation"]
    study = analyse(ARMS, questionnaire(answers, ["first"] * 36 + ["second"] * 4), metrics(contacts))
    assert not study.groups and {one.rule for one in study.refusals} == {"small-cell"}
    assert study.group_sizes == {"first": "36", "second": "fewer than 5"}
    asked = codebook((("motivation", "arm"),), groups=ARMS.groups)
    with pytest.raises(StudyError, match=r"'arm'.*without a regression"):
        analyse(asked, questionnaire(answers, ["first", "second"] * 20), metrics(contacts))
    with pytest.raises(StudyError, match=r"'arm'.*no construct"):
        analyse(codebook((("motivation", "arm"),)), questionnaire(answers), metrics(contacts))


@pytest.mark.parametrize("left", [1, 4, 5])
def test_a_group_of_whom_fewer_than_five_answered_is_not_compared_however_many_it_has(left):
    answers, contacts = a_class(40)
    answers[1 : 40 - 2 * left : 2, 3] = np.nan
    study = analyse(ARMS, questionnaire(answers, ["first", "second"] * 20), metrics(contacts))
    assert [two.students for two in study.groups if two.outcome == "motivation"] == ([(20, 5)] if left == 5 else [])
    refused = [one.rule for one in study.refusals if "motivation between" in one.what]
    assert refused == ([] if left == 5 else ["small-cell"])


def test_a_name_nobody_knows_is_answered_with_the_nearest():
    answers, contacts = a_class(20)
    with pytest.raises(StudyError, match="did you mean 'contacts_per_min'"):
        analyse(codebook((("motivation", "contact_per_min"),)), questionnaire(answers), metrics(contacts))


def test_few_students_for_the_items_and_missing_answers_are_warned_of():
    answers, contacts = a_class(20)
    answers[0, 0] = np.nan
    study = analyse(codebook(), questionnaire(answers), metrics(contacts))
    assert any("3.3 per item" in words for words in study.warnings)
    assert any("fewer than 5 answers are missing" in words for words in study.warnings)
    assert study.reliabilities["ease of use"].students == 19


def test_a_construct_that_only_four_students_answered_has_no_figure():
    answers, contacts = a_class(20)
    answers[4:, 0] = np.nan
    study = analyse(codebook(), questionnaire(answers), metrics(contacts))
    assert "ease of use" not in study.reliabilities and "motivation" in study.reliabilities
    assert study.kmo is None and study.bartlett is None and not study.regressions
    assert {one.rule for one in study.refusals} == {"small-cell"}


def test_a_student_counts_once_with_the_mean_of_the_sessions_however_many_there_are():
    answers, contacts = a_class(30)
    plain, table = metrics(contacts), metrics(contacts, sessions=2)
    apart = np.repeat(np.random.default_rng(1).normal(size=30), 2) * np.tile([1.0, -1.0], 30)
    table.columns["contacts_per_min"] = (np.array(table.columns["contacts_per_min"]) + apart).tolist()
    for name, values in table.columns.items():
        values += values[:2] * 9 if name != "contacts_per_min" else [contacts[0]] * 18
    found, once = (analyse(codebook(BEHAVIOUR), questionnaire(answers), rows) for rows in (table, plain))
    assert (found.rows, found.students, found.regressions[1].students) == (78, 30, 30)
    for other, one in zip(found.regressions[1].coefficients, once.regressions[1].coefficients, strict=True):
        assert (other.beta, other.low, other.high, other.p) == pytest.approx((one.beta, one.low, one.high, one.p))


def test_a_student_in_one_file_only_refuses_behaviour_and_leaves_the_answers():
    answers, contacts = a_class(30)
    study = analyse(codebook(BEHAVIOUR), questionnaire(answers), metrics(contacts[:29]))
    assert [one.rule for one in study.refusals] == ["ids"] and len(study.regressions) == 1
