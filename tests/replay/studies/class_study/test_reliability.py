import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from replay.studies.class_study.refusals import RefusedError
from replay.studies.class_study.reliability import cronbach_alpha, item_total, reliability

REFERENCE = json.loads(Path(__file__).with_name("reference.json").read_text("utf-8"))
ANSWERS = np.array(REFERENCE["answers"], dtype=np.float64)
LIKERT = arrays(np.float64, st.tuples(st.integers(3, 30), st.integers(2, 8)), elements=st.integers(1, 5).map(float))


@pytest.mark.parametrize("k, columns", list(enumerate([(0, 5), (5, 10), (10, 15), (15, 19), (0, 19)])))
def test_alpha_equals_the_stored_values_of_pingouin(k, columns):
    assert cronbach_alpha(ANSWERS[:, slice(*columns)]) == pytest.approx(REFERENCE["alpha"][k], abs=1e-10)


def test_one_item_has_no_alpha():
    with pytest.raises(RefusedError, match=r"one-item.*at least two items"):
        cronbach_alpha(ANSWERS[:, :1])


def test_equal_answers_have_no_alpha():
    with pytest.raises(RefusedError, match="no-variance"):
        cronbach_alpha(np.full((12, 3), 4.0))


def test_items_that_repeat_one_another_have_an_alpha_of_one():
    assert cronbach_alpha(np.repeat(ANSWERS[:, :1], 4, axis=1)) == pytest.approx(1.0, abs=1e-12)


@given(LIKERT)
def test_alpha_knows_neither_the_order_of_students_nor_an_offset_nor_a_turned_scale(answers):
    if not answers.sum(axis=1).var() > 0:
        return
    alpha = cronbach_alpha(answers)
    for same in (answers[::-1], answers + 7.0, 6.0 - answers):
        assert cronbach_alpha(same) == pytest.approx(alpha, abs=1e-9)


def test_the_interval_holds_alpha_and_narrows_with_the_class():
    random = np.random.default_rng(1)
    few = reliability(ANSWERS[:15, :5], random)
    many = reliability(np.tile(ANSWERS[:, :5], (6, 1)), random)
    assert few.low < few.alpha < few.high and many.low < many.alpha < many.high
    assert many.high - many.low < 0.5 * (few.high - few.low)
    assert (few.students, few.items) == (15, 5)


def test_item_total_correlations_leave_the_item_itself_out():
    answers = ANSWERS[:, :5]
    slow = [np.corrcoef(answers[:, i], np.delete(answers, i, axis=1).sum(axis=1))[0, 1] for i in range(5)]
    assert item_total(answers) == pytest.approx(slow, abs=1e-12)
    answers = answers.copy()
    answers[:, 2] = 3.0
    assert np.isnan(item_total(answers)[2])
