from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from replay.errors import StudyError
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
def remarks_on_example():
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
def test_printed_tables_contradictions_are_explained(remarks_on_example, expected):
    """A key of EXPECTED is kind and row of a remark on the example, its value what the remark must say.

    The other seven remarks are regressions that agree.
    """
    reported = " ".join(item.message for item in remarks_on_example if (item.kind, item.row) == expected)
    assert all(text in reported for text in EXPECTED[expected])
    others = {(item.kind, item.row) for item in remarks_on_example} - EXPECTED.keys()
    assert all(kind == KIND_AGREES and " on " in row for kind, row in others) and len(others) == 7


@pytest.mark.parametrize("r", [0.107, 0.412, -0.6, 0.9])
def test_fit_correlation_and_p_agree_with_regression(r):
    """52 made-up students whose correlation is exactly r."""
    import statsmodels.api as sm

    x, rest = np.linalg.qr(np.column_stack([np.ones(52), np.random.default_rng(1).normal(size=(52, 2))]))[0][:, 1:].T
    fitted = sm.OLS(r * x + np.sqrt(1 - r * r) * rest, sm.add_constant(x)).fit()
    fit = adjusted_fit(r, 52)
    assert (fit, p_of_correlation(r, 52)) == pytest.approx((fitted.rsquared_adj, fitted.pvalues[1]), rel=1e-9)
    assert implied_correlation(fit, 52) == pytest.approx(abs(r), abs=1e-12)


def test_a_true_multiple_regression_keeps_its_label(tmp_path):
    """Coefficients of 0.7 and 0.71 with one fit of 0.5 cannot be two regressions of one predictor each."""
    rows = ", ".join(
        f'{{outcome = "y", predictor = "{name}", beta = {beta}, adjusted_fit = 0.5, p = 0.0}}'
        for name, beta in (("a", 0.7), ("b", 0.71))
    )
    file = tmp_path / "t.toml"
    file.write_text(f'n = 52\n[[regression]]\ntable = "T"\nlabel = "multiple"\nrows = [{rows}]\n')
    assert "label" not in {item.row for item in check_published(file)}


def remarks_of(tmp_path, text):
    """Kind of the remark on each row of a file of printed figures, of 100 students unless given."""
    file = tmp_path / "t.toml"
    file.write_text(text if text.startswith("n =") else f"n = 100\n{text}")
    return {item.row: item.kind for item in check_published(file)}


@pytest.mark.parametrize(
    ("change", "row", "kind"),
    [
        ({}, "df", KIND_AGREES), ({"df": 11}, "df", KIND_INCONSISTENT), ({}, "p", KIND_AGREES),
        ({"p": 0.03}, "p", KIND_INCONSISTENT), ({"kmo": 0.69}, "kmo", KIND_WEAK), ({"kmo": 0.7}, "kmo", KIND_AGREES),
        ({"items": 20, "df": 190}, "n", None), ({"items": 21, "df": 210}, "n", KIND_WEAK),
    ],
)  # fmt: skip
def test_printed_reliability_is_checked_figure_by_figure(tmp_path, change, row, kind):
    """Five items have 10 degrees of freedom; five persons an item are usual."""
    figures = {"items": 5, "alpha": 0.8, "kmo": 0.8, "chi_square": 500.0, "df": 10, "p": 0.0} | change
    text = "[reliability]\n" + "".join(f"{key} = {value}\n" for key, value in figures.items())
    assert remarks_of(tmp_path, text).get(row) == kind


ROW = '{{outcome = "y", predictor = "x", beta = {beta}, adjusted_fit = {fit}, p = {p}}}'


@pytest.mark.parametrize(
    ("fit", "p", "kind"),
    [(0.2424, 0.0, KIND_AGREES), (0.3, 0.0, KIND_INCONSISTENT), (0.2424, 0.04, KIND_INCONSISTENT)],
)
def test_printed_regression_follows_from_its_coefficient(tmp_path, fit, p, kind):
    """A correlation of 0.5 in 100 students has the adjusted fit 1 - 0.75 * 99 / 98 and a p below 0.001."""
    text = f"[[regression]]\nrows = [{ROW.format(beta=0.5, fit=fit, p=p)}]\n"
    assert remarks_of(tmp_path, text) == {"x on y": kind}


@pytest.mark.parametrize(
    ("table", "is_remarked"),
    [
        ("groups = 2\ncompared = false", True),
        ("groups = 2\ncompared = true", False),
        ("groups = 1", False),
        ("", False),
    ],
)
def test_groups_that_were_not_compared_are_remarked(tmp_path, table, is_remarked):
    """``table``: how many groups there were, and whether they were compared."""
    text = f"[[regression]]\n{table}\nrows = [{ROW.format(beta=0.5, fit=0.2424, p=0.0)}]\n"
    assert (remarks_of(tmp_path, text).get("groups") == KIND_WEAK) == is_remarked


@pytest.mark.parametrize(
    "text",
    [
        "[[regression]]\nrows = []", "n = 3\n[[regression]]\nrows = []", "n = true\n[[regression]]\nrows = []",
        "n = nan\n[[regression]]\nrows = []", "", '[[regression]]\nrows = [{outcome = "", predictor = "x"}]',
        '[[regression]]\nrows = [{outcome = "y", predictor = "x", beta = 1.0, adjusted_fit = 0.1, p = 0.1}]',
    ],
)  # fmt: skip
def test_printed_figures_that_cannot_be_are_refused(tmp_path, text):
    """No number of students, too few or none at all, no name, or a perfect coefficient."""
    with pytest.raises(StudyError):
        remarks_of(tmp_path, text)
