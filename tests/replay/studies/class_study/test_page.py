import re
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
from support.study_samples import a_class, codebook, metrics, questionnaire

from replay.errors import StudyError
from replay.studies.class_study.analysis import analyse
from replay.studies.class_study.page import CAUSAL, CAVEAT, headlines, study_html
from replay.studies.class_study.published import (
    AGREES,
    INCONSISTENT,
    WEAK,
    adjusted_fit,
    check_published,
    implied_correlation,
    p_of_correlation,
)
from replay.studies.class_study.refusals import RefusedError

QUESTIONS = (("motivation", "ease of use"), ("motivation", "contacts_per_min", "grasps"))


@pytest.fixture(scope="module")
def study():
    answers, contacts = a_class(40, seed=3)
    table = metrics(contacts, detectors=("exact", "hybrid"), recall=(1.0, 0.9))
    return analyse(codebook(QUESTIONS), questionnaire(answers), table)


@pytest.fixture(scope="module")
def page(study):
    return study_html(study, "Class of 2026")


def words_of(page):
    return re.sub(r"<[^>]+>", " ", re.sub(r"<(style|svg)\b.*?</\1>", " ", page, flags=re.S))


def test_the_first_sentence_is_the_association_with_its_interval_and_n(study, page):
    first = headlines(study)[0]
    assert first.startswith("Ease of use is associated with higher motivation: +") and "n = 40" in first
    assert first in page


def test_every_result_stands_with_its_n_its_detector_and_what_that_misses(study, page):
    assert "40 students, 40 sessions, contacts as exact sees them, which finds 100.0% of contact frames" in page
    for one in study.regressions:
        for c in one.coefficients:
            assert f">{c.beta:+.3f}<" in page
    assert "90.0%" in page and "No conclusion changes when hybrid decides" in page


def test_nothing_on_the_page_claims_a_cause(page):
    assert CAVEAT in page
    assert not CAUSAL.search(words_of(page))


@pytest.mark.parametrize("title", ["How VR improves learning", "The effect of contacts", "What leads to motivation"])
def test_a_title_that_claims_a_cause_is_refused(study, title):
    with pytest.raises(RefusedError) as refused:
        study_html(study, title)
    assert refused.value.rule == "causal-wording"


def test_no_association_is_said_as_such():
    answers, _ = a_class(30, slope=0.0, seed=8)
    study = analyse(codebook(), questionnaire(answers))
    assert headlines(study) == ["No association was told from chance in 30 students"]
    assert "questionnaire alone" in study_html(study, "t")


def test_a_refusal_is_on_the_page_with_what_lifts_it():
    answers, contacts = a_class(9)
    page = study_html(analyse(codebook(QUESTIONS), questionnaire(answers), metrics(contacts, recall=(None,))), "t")
    assert "few-students" in page and "at least 10 students" in page and "provenance" in page


def test_no_pseudonym_is_on_the_page(page):
    assert not re.search(r"\bS\d\d\b", words_of(page))


def test_one_study_gives_one_page_to_the_byte(study, page):
    assert study_html(study, "Class of 2026") == page


def test_a_page_of_refusals_alone_is_still_a_page():
    answers, contacts = a_class(9)
    book = codebook((("motivation", "contacts_per_min"),))
    assert "Results not given" in study_html(
        analyse(book, questionnaire(answers), metrics(contacts, recall=(None,))), "t"
    )


def test_a_coefficient_of_several_is_told_from_one_of_a_single_predictor_in_the_plot(page):
    plot = re.search(r"<svg\b.*?</svg>", page, flags=re.S).group()
    assert "grasps – motivation, others held equal" in plot
    assert re.search(r"ease of use – motivation(?!,)", plot)


EXAMPLE = Path(str(files("replay.studies.class_study").joinpath("published_example.toml")))


@pytest.fixture(scope="module")
def remarks():
    return check_published(EXAMPLE)


def test_of_the_printed_tables_exactly_one_row_and_the_label_contradict_themselves(remarks):
    wrong = {(one.table, one.row) for one in remarks if one.kind == INCONSISTENT}
    assert wrong == {("Table IV", "PU on attitude"), ("Table IV", "label")}


def test_the_impossible_row_is_told_with_what_it_would_need(remarks):
    told = " ".join(one.message for one in remarks if one.row == "PU on attitude")
    for figure in ("-0.008", "0.172", "r = 0.434", "p = 0.0013", "p = 0.45", "0.002"):
        assert figure in told


def test_seven_of_eight_rows_are_said_to_be_simple(remarks):
    told = next(one.message for one in remarks if one.row == "label")
    assert "7 of 8" in told and "n = 52" in told and "one predictor each" in told


def test_what_is_weak_is_said_and_is_no_contradiction(remarks):
    weak = {one.row: one.message for one in remarks if one.kind == WEAK}
    assert set(weak) == {"n", "kmo", "groups"}
    assert "2.7 persons per item" in weak["n"] and "mediocre" in weak["kmo"]
    assert "0.456" in weak["groups"] and "0.467" in weak["groups"]


def test_the_reliability_table_agrees_with_itself(remarks):
    assert [one.row for one in remarks if one.table == "Table III" and one.kind == AGREES] == ["df", "p", "alpha"]
    told = " ".join(one.message for one in remarks if one.table == "Table III")
    assert "171" in told and "4e-26" in told and "0.159" in told


@pytest.mark.parametrize("r", [0.107, 0.412, -0.6, 0.9])
def test_fit_correlation_and_p_agree_with_a_regression_of_such_data(r):
    import statsmodels.api as sm

    raw = np.random.default_rng(1).normal(size=(52, 2))
    basis = np.linalg.qr(np.column_stack([np.ones(52), raw]))[0][:, 1:]
    x, y = basis[:, 0], r * basis[:, 0] + np.sqrt(1 - r * r) * basis[:, 1]
    fitted = sm.OLS(y, sm.add_constant(x)).fit()
    assert adjusted_fit(r, 52) == pytest.approx(fitted.rsquared_adj, abs=1e-12)
    assert p_of_correlation(r, 52) == pytest.approx(fitted.pvalues[1], rel=1e-9)
    assert implied_correlation(adjusted_fit(r, 52), 52) == pytest.approx(abs(r), abs=1e-12)


def test_a_true_multiple_regression_keeps_its_label(tmp_path):
    rows = ", ".join(
        f'{{outcome = "y", predictor = "{name}", beta = {beta}, adjusted_fit = 0.5, p = 0.0}}'
        for name, beta in (("a", 0.7), ("b", 0.71))
    )
    file = tmp_path / "t.toml"
    file.write_text(f'n = 52\n[[regression]]\ntable = "T"\nlabel = "multiple"\nrows = [{rows}]\n')
    assert "label" not in {one.row for one in check_published(file)}


@pytest.mark.parametrize(
    "text, words",
    [
        ("n = 52", "neither"), ("n = [", "cannot be read"), ("n = 'many'", "n must be a number"),
        ("n = 3\n[reliability]\nitems = 3", "too few"), ("n = 52\n[reliability]\nitems = 3", "alpha must be a number"),
        ("n = 52\n[[regression]]\ntable = 'T'", "has no rows"),
        ("n = 52\n[[regression]]\nrows = [{outcome = 'y', predictor = 'x', beta = 1.2}]", "no correlation"),
        ("n = 52\n[[regression]]\nrows = [{predictor = 'x', beta = 0.2}]", "must be words"),
    ],
)  # fmt: skip
def test_a_table_that_cannot_be_checked_is_refused_in_a_sentence(tmp_path, text, words):
    file = tmp_path / "t.toml"
    file.write_text(text)
    with pytest.raises(StudyError, match=words):
        check_published(file)
