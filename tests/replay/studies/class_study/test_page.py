import re

import numpy as np
import pytest
from support.class_folders import made_class
from support.study_samples import a_class, codebook, metrics, questionnaire

from replay.studies.class_study.analysis import analyse
from replay.studies.class_study.class_runs import read_class
from replay.studies.class_study.class_tables import places
from replay.studies.class_study.page import study_html
from replay.studies.class_study.tables import (
    coefficient_table,
    headlines,
    reliability_table,
    sensitivity_table,
)

QUESTIONS = (("motivation", "ease of use"), ("motivation", "contacts_per_min", "grasps"))


@pytest.fixture(scope="module")
def study():
    answers, contacts = a_class(40, seed=3)
    table = metrics(contacts, detectors=("exact", "hybrid"), recall=(1.0, 0.9))
    return analyse(codebook(QUESTIONS), questionnaire(answers), table)


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    """The page of a study, over some runs."""
    top = tmp_path_factory.mktemp("class")
    runs = read_class(made_class(top / "runs", 6, 6, contacts=3))
    return lambda study, title="t": study_html(runs, places(runs, top), study, title)


@pytest.fixture(scope="module")
def page(study, shown):
    return shown(study, "Class of 2026")


def words_of(page):
    return re.sub(r"<[^>]+>", " ", re.sub(r"<(style|svg)\b.*?</\1>", " ", page, flags=re.S))


def test_the_first_sentence_is_the_association_with_its_interval_and_n(study, page):
    first = headlines(study)[0]
    assert first.startswith("Ease of use is associated with higher motivation: +") and "n = 40" in first
    assert first in page


def test_every_result_stands_with_its_n_its_detector_and_what_that_misses(study, page):
    assert "40 students, 40 sessions, contacts as exact sees them, which finds 100 % of contact frames" in page
    for one in study.regressions:
        for c in one.coefficients:
            assert f">{c.beta:+.3f}<" in page
    assert "90 %" in page and "Does the detector change a conclusion? No." in page


def test_every_n_is_that_of_the_rows_used_not_of_the_questionnaire(shown):
    answers, contacts = a_class(26, slope=0.0, seed=8)
    answers[:5, 3] = np.nan
    book = codebook((("motivation", "ease of use"), ("motivation", "contacts_per_min")))
    table = metrics(contacts, detectors=("exact", "hybrid"), recall=(1.0, 0.9), sessions=2)
    study = analyse(book, questionnaire(answers), table)
    assert headlines(study) == ["No association was told from chance in 21 students"]
    made = coefficient_table(study)
    assert made.column("students") == [21, 21]
    assert sensitivity_table(study).column("students") == [21]
    assert reliability_table(study).column("students") == [26, 21]
    page = words_of(shown(study))
    assert "n = 26" not in page and "26 students, 52 sessions" in page


def test_what_was_not_tested_is_not_said_to_be_chance():
    answers, contacts = a_class(9)
    assert headlines(analyse(codebook(), questionnaire(answers), metrics(contacts))) == ["No association was tested"]
