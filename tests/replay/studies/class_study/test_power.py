"""More students are advised where nothing is associated and a medium correlation needs more of them."""

from types import SimpleNamespace

import pytest

from replay.studies.class_study import power


def study(**changes):
    """A study of 84 students with one test, in which nothing is associated."""
    rows = (SimpleNamespace(p=0.4), SimpleNamespace(p=None))
    values = {"students": 84, "tested": True, "nothing_associated": True, "coefficients": rows, "groups": ()}
    return SimpleNamespace(**{**values, **changes})


@pytest.mark.parametrize(
    ("changes", "is_needed"),
    [({}, True), ({"students": 85}, False), ({"tested": False}, False), ({"nothing_associated": False}, False)],
)
def test_medium_correlation_takes_85_students(changes, is_needed):
    """Cohen (1992), A power primer, table 2: 85 students for r = 0.3 at a power of 0.8 and 5 %."""
    assert power.students_needed(correlation=0.3, tests=1) == 85
    assert power.least_correlation(students=85, tests=1) == pytest.approx(0.3, abs=0.002)
    assert power.least_correlation(students=19, tests=1) is None
    assert power.more_students_needed(study(**changes)) == is_needed


def test_tests_together_are_those_of_associations_else_of_groups():
    """One of two associations has a p; where none has, the two comparisons of groups count; else a single test."""
    two, none = (SimpleNamespace(p=0.1), SimpleNamespace(p=0.9)), (SimpleNamespace(p=None),)
    assert power.tests_together(study(groups=two)) == 1, "one association was tested"
    assert power.tests_together(study(coefficients=none, groups=two)) == 2
    assert power.tests_together(study(coefficients=(), groups=())) == 1
