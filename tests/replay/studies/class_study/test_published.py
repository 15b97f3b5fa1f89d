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
    """Remarks on the shipped example, the printed tables of a study."""
    return check_published(EXAMPLE)


PRINTED_REGRESSIONS = 8
"""Regressions in the example: motivation and attitude by four predictors each."""

CONTRADICTION = (KIND_INCONSISTENT, "PU on attitude")
"""The regression of the example that contradicts itself: of attitude on perceived usefulness (PU)."""


@pytest.mark.parametrize(
    ("kind", "row", "texts"),
    [
        # adjusted fit 1 - (1 - 0.107^2) 51 / 50 = -0.008 of the printed coefficient 0.107, and its p 0.45; printed are
        # 0.172 and 0.002; the correlation that the printed fit needs, and its p
        (*CONTRADICTION, ["-0.008", "0.172", "r = 0.434", "p = 0.0013", "p = 0.45", "0.002"]),
        (KIND_INCONSISTENT, "label", ["7 of 8", "n = 52", "one predictor each"]),  # called a multiple regression
        (KIND_WEAK, "n", ["2.7 persons per item"]),  # 52 / 19
        (KIND_WEAK, "kmo", ["mediocre"]),  # Kaiser's word for 0.652
        (KIND_WEAK, "groups", ["0.456", "0.467"]),  # fit of PEU on motivation with 26 students, and with 52 as printed
        (KIND_AGREES, "df", ["171"]),  # 19 * 18 / 2
        (KIND_AGREES, "p", ["4e-26"]),  # of a chi-square of 443.8 with 171 degrees of freedom
        (KIND_AGREES, "alpha", ["0.159"]),  # mean correlation of 19 items with alpha 0.782: 0.782 / (19 - 0.782 * 18)
    ],
)
def test_printed_tables_are_recomputed_figure_by_figure(remarks_on_example, kind, row, texts):
    """The shipped example has the printed tables of a study of 52 students and 19 items; ``texts``: in the remark."""
    messages = " ".join(remark.message for remark in remarks_on_example if (remark.kind, remark.row) == (kind, row))
    assert [text for text in texts if text not in messages] == []


def test_printed_regressions_agree_but_one(remarks_on_example):
    """The shipped example has eight printed regressions, called by predictor and outcome.

    One agrees where its printed fit follows from its printed coefficient. It does in all but that of attitude on
    perceived usefulness. Every other figure that is checked has a remark too, agreeing or not: there are seven.
    """
    regressions = [(remark.kind, remark.row) for remark in remarks_on_example if " on " in remark.row]
    agreeing = [row for kind, row in regressions if kind == KIND_AGREES]
    assert len(agreeing) == PRINTED_REGRESSIONS - 1
    assert {(kind, row) for kind, row in regressions if kind != KIND_AGREES} == {CONTRADICTION}
    other_rows = [remark.row for remark in remarks_on_example if " on " not in remark.row]
    assert sorted(other_rows) == ["alpha", "df", "groups", "kmo", "label", "n", "p"]


@pytest.mark.parametrize("r", [0.107, 0.412, -0.6, 0.9])
def test_fit_correlation_and_p_agree_with_regression(r):
    """52 made-up students whose correlation is exactly r: expected are adjusted fit and p of statsmodels.

    The correlation that is computed back from the fit has no sign.
    """
    from statsmodels.regression.linear_model import OLS  # statsmodels.api takes 0.2 s more

    students = 52
    constant_and_two_draws = np.column_stack([np.ones(students), np.random.default_rng(1).normal(size=(students, 2))])
    _, x, rest = np.linalg.qr(constant_and_two_draws)[0].T  # unit vectors at right angles
    y = r * x + np.sqrt(1 - r * r) * rest
    fitted = OLS(y, np.column_stack([np.ones(students), x])).fit()
    fit, p = adjusted_fit(r, students), p_of_correlation(r, students)
    assert (fit, p) == pytest.approx((fitted.rsquared_adj, fitted.pvalues[1]), rel=1e-9, abs=0)
    assert implied_correlation(fit, students) == pytest.approx(abs(r), abs=1e-12)


def test_a_true_multiple_regression_keeps_its_label(tmp_path):
    """Two predictors of y share one fit, 0.5, as rows of a multiple regression do: the label is right."""
    rows = [
        '{outcome = "y", predictor = "a", beta = 0.7, adjusted_fit = 0.5, p = 0.0}',
        '{outcome = "y", predictor = "b", beta = 0.71, adjusted_fit = 0.5, p = 0.0}',
    ]
    file = tmp_path / "t.toml"
    file.write_text(f'n = 52\n[[regression]]\ntable = "T"\nlabel = "multiple"\nrows = [{", ".join(rows)}]\n')
    remarks = check_published(file)
    assert remarks and "label" not in {remark.row for remark in remarks}


def test_rows_with_different_fits_are_no_multiple_regression(tmp_path):
    """Rows of y have fits of 0.5 and 0.4, which one regression cannot have; both rows of z have 0.3."""
    rows = ", ".join(
        f'{{outcome = "{outcome}", predictor = "{name}", beta = 0.7, adjusted_fit = {fit}, p = 0.0}}'
        for outcome, name, fit in (("y", "a", 0.5), ("y", "b", 0.4), ("z", "a", 0.3), ("z", "b", 0.3))
    )
    file = tmp_path / "t.toml"
    file.write_text(f'n = 52\n[[regression]]\nlabel = "multiple"\nrows = [{rows}]\n')
    (remark,) = [item for item in check_published(file) if item.row == "label"]
    assert "(y)" in remark.message


def kinds_by_row(tmp_path, text):
    """Row -> kind of the remark on it, of a TOML file with printed figures of 100 students."""
    file = tmp_path / "t.toml"
    file.write_text(f"n = 100\n{text}")
    return {item.row: item.kind for item in check_published(file)}


@pytest.mark.parametrize(
    ("change", "row", "kind"),
    [
        pytest.param({}, "df", KIND_AGREES, id="5 items have 5 * 4 / 2 = 10 degrees of freedom"),
        pytest.param({"df": 11}, "df", KIND_INCONSISTENT, id="11 degrees of freedom"),
        pytest.param({}, "p", KIND_AGREES, id="chi-square of 500 has p = 0"),
        pytest.param({"p": 0.03}, "p", KIND_INCONSISTENT, id="chi-square of 500 has no p of 0.03"),
        pytest.param({"kmo": 0.69}, "kmo", KIND_WEAK, id="KMO below 0.7 is weak"),
        pytest.param({"kmo": 0.7}, "kmo", KIND_AGREES, id="KMO of 0.7 is enough"),
        pytest.param({"items": 20, "df": 190}, "n", None, id="100 students, 5 an item: no remark"),
        pytest.param({"items": 21, "df": 210}, "n", KIND_WEAK, id="100 students, fewer than 5 an item"),
    ],
)
def test_printed_reliability_is_checked_figure_by_figure(tmp_path, change, row, kind):
    """Printed for 100 students are all of these figures, one of them changed; ``row``: the figure remarked on."""
    figures = {"items": 5, "alpha": 0.8, "kmo": 0.8, "chi_square": 500.0, "df": 10, "p": 0.0} | change
    text = "[reliability]\n" + "".join(f"{key} = {value}\n" for key, value in figures.items())
    assert kinds_by_row(tmp_path, text).get(row) == kind


def regression_row(beta, fit, p):
    """A printed row of a regression of y on x: coefficient, adjusted fit and p."""
    return f'{{outcome = "y", predictor = "x", beta = {beta}, adjusted_fit = {fit}, p = {p}}}'


@pytest.mark.parametrize(
    ("fit", "p", "kind"),
    [(0.2424, 0.0, KIND_AGREES), (0.3, 0.0, KIND_INCONSISTENT), (0.2424, 0.04, KIND_INCONSISTENT)],
    ids=["fit and p follow", "another fit", "another p"],
)
def test_printed_regression_follows_from_its_coefficient(tmp_path, fit, p, kind):
    """A correlation of 0.5 in 100 students has the adjusted fit 1 - 0.75 * 99 / 98 = 0.2424 and a p below 0.001."""
    text = f"[[regression]]\nrows = [{regression_row(0.5, fit, p)}]\n"
    assert kinds_by_row(tmp_path, text) == {"x on y": kind}


@pytest.mark.parametrize(
    ("table", "is_remarked"),
    [
        ("groups = 2\ncompared = false", True),
        ("groups = 2\ncompared = true", False),
        ("groups = 1", False),
        ("", False),
    ],
    ids=["not compared", "compared", "one group", "no word on groups"],
)
def test_groups_that_were_not_compared_are_remarked(tmp_path, table, is_remarked):
    """A printed regression, with how many groups the paper formed, and whether it compared them."""
    text = f"[[regression]]\n{table}\nrows = [{regression_row(beta=0.5, fit=0.2424, p=0.0)}]\n"
    assert kinds_by_row(tmp_path, text).get("groups") == (KIND_WEAK if is_remarked else None)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        pytest.param(f"[[regression]]\nrows = [{regression_row(0.5, 0.24, 0.0)}]", "n must be a number", id="no n"),
        pytest.param(
            f"n = true\n[[regression]]\nrows = [{regression_row(0.5, 0.24, 0.0)}]", "n must be", id="no number"
        ),
        pytest.param(f"n = nan\n[[regression]]\nrows = [{regression_row(0.5, 0.24, 0.0)}]", "n must be", id="NaN"),
        pytest.param(f"n = 3\n[[regression]]\nrows = [{regression_row(0.5, 0.24, 0.0)}]", "too few", id="3 students"),
        pytest.param("n = 100", "nothing to check", id="no table"),
        pytest.param("n = 100\n[[regression]]\nrows = []", "has no rows", id="no row"),
        pytest.param(
            'n = 100\n[[regression]]\nrows = [{outcome = "", predictor = "x"}]', "must be words", id="no name"
        ),
        pytest.param(
            f"n = 100\n[[regression]]\nrows = [{regression_row(1.0, 0.1, 0.1)}]",
            "no correlation",
            id="coefficient of 1",
        ),
    ],
)
def test_printed_figures_that_cannot_be_are_refused(tmp_path, text, message):
    """A TOML file of figures that a paper prints; ``message``: words of the refusal."""
    file = tmp_path / "t.toml"
    file.write_text(text)
    with pytest.raises(StudyError, match=message):
        check_published(file)
