"""Charts of a class show only figures that enough students stand behind."""

from types import SimpleNamespace

import pytest

from replay.studies.class_study.analysis import Sensitivity
from replay.studies.class_study.charts import class_charts
from replay.studies.class_study.refusals import LEAST_IN_CELL
from replay.studies.class_study.regression import Finding


def tables_of_class(students, seconds=1.5):
    """Stands for the tables of a class without groups: so many students touch for so many seconds a minute."""
    estimate = SimpleNamespace(students=students, value=seconds, low=1.0, high=2.0)
    return SimpleNamespace(contact_seconds_a_minute=lambda members: estimate)


@pytest.mark.parametrize(
    ("students", "seconds", "charts"),
    [
        pytest.param(LEAST_IN_CELL, 1.5, ["Time in contact"], id="enough students"),
        pytest.param(LEAST_IN_CELL - 1, 1.5, [], id="a student too few"),
        pytest.param(LEAST_IN_CELL, float("nan"), [], id="time not known"),
    ],
)
def test_time_in_contact_is_drawn_from_enough_students_only(students, seconds, charts):
    """So many students touch for so many seconds a minute; fewer than LEAST_IN_CELL could be recognised."""
    assert titles(class_charts(tables_of_class(students, seconds), study=None)) == charts


def test_time_in_contact_has_a_row_for_each_group():
    """Students S1 and S3 are in the group named first, S2 in the group named second."""
    queried_members = []
    study = study_of()
    study.group_of = {"S1": "first", "S2": "second", "S3": "first"}
    estimate = SimpleNamespace(students=LEAST_IN_CELL, value=1.5, low=1.0, high=2.0)
    tables = SimpleNamespace(contact_seconds_a_minute=lambda members: queried_members.append(members) or estimate)
    *_, time_in_contact = class_charts(tables, study)
    assert queried_members == [{"S1", "S3"}, {"S2"}]
    assert [dot.name.partition(":")[0] for dot in time_in_contact.dots] == ["group first", "group second"]


def finding_of_grasps(beta=0.2, kind="multiple", p=0.5):
    """Result of a regression of motivation on grasps, 40 students; ``multiple``: others are held constant."""
    ends = {"beta": beta, "low": beta - 0.1, "high": beta + 0.1, "p": p, "p_holm": p}
    return Finding(name="grasps", kind=kind, variables=("motivation", "grasps"), students=40, **ends)


def with_other_detector(detector, by_exact=None, by_other=None):
    """The result of grasps by exact, and by another detector; beta 0.2 and p 0.5 unless given: no association."""
    return Sensitivity(detector, 0.9, before=by_exact or finding_of_grasps(), after=by_other or finding_of_grasps())


def study_of(*sensitivity, changing=()):
    """Stands for a study by exact; ``sensitivity``: its results again with other detectors.

    ``changing``: labels of detectors with which a conclusion is another.
    """
    return SimpleNamespace(
        detector="exact",
        sensitivity=sensitivity,
        changing_detectors=changing,
        coefficients=(finding_of_grasps(),),
        reliabilities={},
        group_of={},
    )


def titles(plots):
    """Titles of plots."""
    return [plot.title for plot in plots]


RESULT = "grasps with motivation, others held constant"


def test_detectors_with_equal_figures_share_a_row():
    """Exact and two detectors find beta 0.2 and p 0.5 in 40 students: one row for all."""
    study = study_of(with_other_detector("hull50"), with_other_detector("paper"))
    _associations, by_detector, _time_in_contact = class_charts(tables_of_class(LEAST_IN_CELL), study)
    assert [dot.name for dot in by_detector.dots] == [f"{RESULT}: the same with 3 detectors: +0.20, p = 0.500, n = 40"]


def test_detector_with_another_figure_has_a_row_of_its_own():
    """mesh50 finds an association, beta 0.7 and p 0.01, drawn as ``right``; the other three find none ("reference").

    The chart of associations shows the result of exact alone.
    """
    study = study_of(
        with_other_detector("hull50"),
        with_other_detector("paper"),
        with_other_detector("mesh50", by_other=finding_of_grasps(beta=0.7, p=0.01)),
    )
    associations, by_detector, _time_in_contact = class_charts(tables_of_class(LEAST_IN_CELL), study)
    assert [(dot.name, dot.kind) for dot in by_detector.dots] == [
        (f"{RESULT}: exact, hull50, paper: +0.20, p = 0.500, n = 40", "reference"),
        ("mesh50: +0.70, p = 0.010, n = 40", "right"),
    ]
    assert [dot.name for dot in associations.dots] == [f"{RESULT}: +0.20, p = 0.500, n = 40"]


def test_charts_by_detector_come_first_if_a_conclusion_changes():
    """The same results of mesh50, in a study that no detector changes, and in one that mesh50 changes."""
    row = with_other_detector("mesh50", by_other=finding_of_grasps(beta=0.7, p=0.01))
    unchanged = class_charts(tables_of_class(LEAST_IN_CELL), study_of(row))
    changed = class_charts(tables_of_class(LEAST_IN_CELL), study_of(row, changing=["mesh50"]))
    assert titles(unchanged) == ["Associations", "Associations by detector", "Time in contact"]
    assert titles(changed) == ["Associations by detector", "Associations", "Time in contact"]


def test_result_not_significant_after_holm_is_labelled_undecided():
    """One result, of 40 students: p is 0.04 alone, below 0.05, and 0.1 after Holm's correction."""
    finding = Finding(**vars(finding_of_grasps(beta=0.2, kind="simple", p=0.04)) | {"p_holm": 0.1})
    study = study_of()
    study.coefficients = (finding,)
    associations, _time_in_contact = class_charts(tables_of_class(LEAST_IN_CELL), study)
    assert [dot.name for dot in associations.dots] == ["grasps with motivation: +0.20 undecided, p = 0.100, n = 40"]


def test_coefficients_and_group_differences_are_separate_charts():
    """A difference of means between groups (9 grasps) has another unit than a coefficient (0.2).

    So each has its own chart by detector, with a single row, as exact and "paper" have equal figures. The other two
    charts are those of every study of enough students: results of exact alone, and time in contact.
    """
    coefficient = finding_of_grasps(beta=0.2, kind="simple")
    difference = finding_of_grasps(beta=9.0, kind="groups")
    study = study_of(
        with_other_detector("paper", by_exact=coefficient, by_other=coefficient),
        with_other_detector("paper", by_exact=difference, by_other=difference),
    )
    _, coefficients, differences, _ = plots = class_charts(tables_of_class(LEAST_IN_CELL), study)
    assert titles(plots) == ["Associations", "Associations by detector", "Groups by detector", "Time in contact"]
    assert len(coefficients.dots) == len(differences.dots) == 1
