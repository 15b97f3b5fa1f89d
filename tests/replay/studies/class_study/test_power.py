"""More students are advised where nothing is associated and a medium correlation needs more of them."""

from types import SimpleNamespace

import pytest

from replay.studies.class_study import power


def study(**changes):
    """Stands for a study of 84 students in which nothing is associated: of two coefficients one has a p-value."""
    coefficients = (SimpleNamespace(p=0.4), SimpleNamespace(p=None))
    values = {"students": 84, "tested": True, "nothing_associated": True, "coefficients": coefficients, "groups": ()}
    return SimpleNamespace(**{**values, **changes})


def test_medium_correlation_takes_85_students():
    """Cohen (1992), A power primer, table 2: 85 students for r = 0.3 at a power of 0.8 and 5 %."""
    assert power.students_needed(correlation=0.3, tests=1) == 85
    assert power.least_correlation(students=85, tests=1) == pytest.approx(0.3, abs=0.002)


@pytest.mark.parametrize("tests", [1, 6])
def test_no_least_correlation_of_fewer_than_20_students(tests):
    """Fisher's transformation, from which it comes, is too rough below 20 students."""
    assert power.least_correlation(students=19, tests=tests) is None
    assert power.least_correlation(students=20, tests=tests) is not None


@pytest.mark.parametrize(
    ("changes", "is_needed"),
    [
        pytest.param({}, True, id="84 students"),
        pytest.param({"students": 85}, False, id="85 students are enough"),
        pytest.param({"tested": False}, False, id="nothing was tested"),
        pytest.param({"nothing_associated": False}, False, id="an association shows"),
    ],
)
def test_more_students_are_needed_below_85_without_an_association(changes, is_needed):
    """85 students find a correlation of 0.3 in four of five classes, with one test."""
    assert power.more_students_needed(study(**changes)) == is_needed


ONE_TEST_OF_TWO = (SimpleNamespace(p=0.4), SimpleNamespace(p=None))
TWO_TESTS = (SimpleNamespace(p=0.1), SimpleNamespace(p=0.9))
NO_TEST = (SimpleNamespace(p=None),)


@pytest.mark.parametrize(
    ("coefficients", "groups", "tests"),
    [
        pytest.param(ONE_TEST_OF_TWO, TWO_TESTS, 1, id="associations, and not those of groups"),
        pytest.param(NO_TEST, TWO_TESTS, 2, id="of groups, as no association has a p-value"),
        pytest.param((), (), 1, id="nothing tested"),
    ],
)
def test_tests_together_are_those_of_associations_else_of_groups(coefficients, groups, tests):
    """A p-value is corrected for the tests of its own kind; what has no p-value (None) is no test; 1 is the least."""
    assert power.tests_together(study(coefficients=coefficients, groups=groups)) == tests
