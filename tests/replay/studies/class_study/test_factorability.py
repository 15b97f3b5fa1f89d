import json
from pathlib import Path

import numpy as np
import pytest

from replay.studies.class_study.refusals import RefusedError
from replay.studies.class_study.reliability import bartlett, chi_square_tail, kaiser_word, kmo

REFERENCE = json.loads(Path(__file__).with_name("reference.json").read_text("utf-8"))
ANSWERS = np.array(REFERENCE["answers"], dtype=np.float64)


def test_kmo_and_bartlett_equal_the_stored_values_of_factor_analyzer():
    assert kmo(ANSWERS) == pytest.approx(REFERENCE["kmo"], abs=1e-10)
    found = bartlett(ANSWERS)
    assert found.chi_square == pytest.approx(REFERENCE["bartlett"][0], rel=1e-10)
    assert found.p == pytest.approx(REFERENCE["bartlett"][1], rel=1e-9, abs=1e-10)
    assert found.degrees == 171


def test_kmo_of_items_with_one_common_correlation_is_the_closed_form():
    """Partial correlations of an equicorrelated matrix are r / (1 + (k - 2) r), so KMO follows by hand."""
    k, r = 5, 0.5
    root = np.linalg.cholesky((1 - r) * np.eye(k) + r)
    raw = np.random.default_rng(0).normal(size=(40, k))
    raw -= raw.mean(axis=0)
    white = np.linalg.qr(raw)[0]
    partial = r / (1 + (k - 2) * r)
    assert kmo(white @ root.T) == pytest.approx(r * r / (r * r + partial * partial), abs=1e-12)


@pytest.mark.parametrize(
    "answers, rule",
    [
        (ANSWERS[:, :1], "one-item"),
        (np.column_stack([ANSWERS[:, :3], ANSWERS[:, :1]]), "singular"),
        (ANSWERS[:19], "singular"),
        (np.column_stack([ANSWERS[:, :3], np.full(52, 3.0)]), "no-variance"),
    ],
)
def test_what_has_no_inverse_has_no_kmo(answers, rule):
    with pytest.raises(RefusedError) as refused:
        kmo(answers)
    assert refused.value.rule == rule


def test_bartlett_gives_no_p_for_nine_students():
    assert bartlett(ANSWERS[:10, :3]).p <= 1.0
    with pytest.raises(RefusedError, match=r"few-students.*at least 10 students"):
        bartlett(ANSWERS[:9, :3])


def test_kaisers_words_change_at_his_limits():
    assert [kaiser_word(value) for value in (0.9, 0.89, 0.652, 0.5, 0.49)] == [
        "marvellous", "meritorious", "mediocre", "miserable", "unacceptable",
    ]  # fmt: skip


def test_the_tail_of_a_chi_square_with_two_degrees_is_exponential():
    assert chi_square_tail(7.0, 2) == pytest.approx(np.exp(-3.5), rel=1e-12)
