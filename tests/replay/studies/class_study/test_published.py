from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from replay.studies.class_study.published import (
    KIND_AGREES,
    KIND_INCONSISTENT,
    KIND_WEAK,
    adjusted_fit,
    check_published,
    implied_correlation,
    p_of_correlation,
)

EXAMPLE = Path(str(files("replay.studies.class_study").joinpath("published_example.toml")))


@pytest.fixture(scope="module")
def remarks():
    return check_published(EXAMPLE)


EXPECTED = {
    (KIND_INCONSISTENT, "PU on attitude"): ("-0.008", "0.172", "r = 0.434", "p = 0.0013", "p = 0.45", "0.002"),
    (KIND_INCONSISTENT, "label"): ("7 of 8", "n = 52", "one predictor each"),
    (KIND_WEAK, "n"): ("2.7 persons per item",),
    (KIND_WEAK, "kmo"): ("mediocre",),
    (KIND_WEAK, "groups"): ("0.456", "0.467"),
    (KIND_AGREES, "df"): ("171",),
    (KIND_AGREES, "p"): ("4e-26",),
    (KIND_AGREES, "alpha"): ("0.159",),
}


@pytest.mark.parametrize("expected", EXPECTED)
def test_printed_tables_contradictions_are_explained(remarks, expected):
    reported = " ".join(item.message for item in remarks if (item.kind, item.row) == expected)
    assert all(text in reported for text in EXPECTED[expected])
    others = {(item.kind, item.row) for item in remarks} - EXPECTED.keys()
    assert all(kind == KIND_AGREES and " on " in row for kind, row in others) and len(others) == 7


@pytest.mark.parametrize("r", [0.107, 0.412, -0.6, 0.9])
def test_fit_correlation_and_p_agree_with_regression(r):
    import statsmodels.api as sm

    x, rest = np.linalg.qr(np.column_stack([np.ones(52), np.random.default_rng(1).normal(size=(52, 2))]))[0][:, 1:].T
    fitted = sm.OLS(r * x + np.sqrt(1 - r * r) * rest, sm.add_constant(x)).fit()
    fit = adjusted_fit(r, 52)
    assert (fit, p_of_correlation(r, 52)) == pytest.approx((fitted.rsquared_adj, fitted.pvalues[1]), rel=1e-9)
    assert implied_correlation(fit, 52) == pytest.approx(abs(r), abs=1e-12)


def test_a_true_multiple_regression_keeps_its_label(tmp_path):
    rows = ", ".join(
        f'{{outcome = "y", predictor = "{name}", beta = {beta}, adjusted_fit = 0.5, p = 0.0}}'
        for name, beta in (("a", 0.7), ("b", 0.71))
    )
    file = tmp_path / "t.toml"
    file.write_text(f'n = 52\n[[regression]]\ntable = "T"\nlabel = "multiple"\nrows = [{rows}]\n')
    assert "label" not in {item.row for item in check_published(file)}
