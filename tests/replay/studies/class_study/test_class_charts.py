"""Charts of a class show only figures that enough students stand behind."""

from types import SimpleNamespace

from replay.studies.class_study.analysis import Sensitivity
from replay.studies.class_study.charts import class_charts
from replay.studies.class_study.refusals import LEAST_IN_CELL
from replay.studies.class_study.regression import Finding


def class_of(students, seconds=1.5):
    """Stands for the tables of a class of so many students without groups."""
    estimate = SimpleNamespace(students=students, value=seconds, low=1.0, high=2.0)
    return SimpleNamespace(contact_seconds_a_minute=lambda members: estimate)


def test_time_in_contact_is_drawn_from_enough_students_only():
    """At least LEAST_IN_CELL students and a known time have a chart, one student fewer has none."""
    assert len(class_charts(class_of(LEAST_IN_CELL), study=None)) == 1
    assert class_charts(class_of(LEAST_IN_CELL - 1), study=None) == []
    assert class_charts(class_of(LEAST_IN_CELL, seconds=float("nan")), study=None) == []


def test_time_in_contact_has_a_row_for_each_group():
    """Students S1 and S3 are in one group, S2 in the other."""
    queried = []
    study = study_of()
    study.group_of = {"S1": "first", "S2": "second", "S3": "first"}
    estimate = SimpleNamespace(students=LEAST_IN_CELL, value=1.5, low=1.0, high=2.0)
    tables = SimpleNamespace(contact_seconds_a_minute=lambda members: queried.append(members) or estimate)
    *_, chart = class_charts(tables, study)
    assert queried == [{"S1", "S3"}, {"S2"}]
    assert [dot.name.partition(":")[0] for dot in chart.dots] == ["group first", "group second"]


def finding_of_grasps(beta=0.2, kind="multiple", p=0.5):
    """Finding of a regression of grasps and motivation of 40 students."""
    ends = {"beta": beta, "low": beta - 0.1, "high": beta + 0.1, "p": p, "p_holm": p}
    return Finding(name="grasps", kind=kind, variables=("motivation", "grasps"), students=40, **ends)


def study_of(*sensitivity, changing=()):
    """A study of which the charts need these rows alone."""
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


def test_detectors_with_equal_figures_share_a_row():
    """Three detectors are equal, and a row says so; a fourth differs and has a row of its own."""
    rows = [
        Sensitivity(label, recall=0.9, before=finding_of_grasps(), after=finding_of_grasps())
        for label in ("hull50", "paper")
    ]
    start = "grasps with motivation, others held constant"
    _, same, _ = class_charts(class_of(LEAST_IN_CELL), study_of(*rows))
    assert [dot.name for dot in same.dots] == [f"{start}: the same with 3 detectors: +0.20, p = 0.500, n = 40"]
    rows.append(
        Sensitivity("mesh50", recall=0.9, before=finding_of_grasps(), after=finding_of_grasps(beta=0.7, p=0.01))
    )
    associations, by_detector, _ = class_charts(class_of(LEAST_IN_CELL), study_of(*rows))
    assert [(dot.name, dot.kind) for dot in by_detector.dots] == [
        (f"{start}: exact, hull50, paper: +0.20, p = 0.500, n = 40", "reference"),
        ("mesh50: +0.70, p = 0.010, n = 40", "right"),
    ]
    assert [dot.name for dot in associations.dots] == [f"{start}: +0.20, p = 0.500, n = 40"]


def test_charts_by_detector_come_first_if_a_conclusion_changes():
    """The conclusion changes with the detector mesh50."""
    rows = [Sensitivity("mesh50", recall=0.9, before=finding_of_grasps(), after=finding_of_grasps(beta=0.7, p=0.01))]
    unchanged = titles(class_charts(class_of(LEAST_IN_CELL), study_of(*rows)))
    changed = titles(class_charts(class_of(LEAST_IN_CELL), study_of(*rows, changing=["mesh50"])))
    assert unchanged[:2] == ["Associations", "Associations by detector"]
    assert changed[:2] == ["Associations by detector", "Associations"]


def test_result_not_significant_after_holm_is_labelled_undecided():
    """p is 0.04 alone, and 0.1 after Holm's correction."""
    undecided = finding_of_grasps(beta=0.2, kind="simple", p=0.04)
    study = study_of()
    study.coefficients = (Finding(**vars(undecided) | {"p_holm": 0.1}),)
    associations, *_ = class_charts(class_of(LEAST_IN_CELL), study)
    assert [dot.name for dot in associations.dots] == ["grasps with motivation: +0.20 undecided, p = 0.100, n = 40"]


def test_coefficients_and_group_differences_are_separate_charts():
    """A difference between groups has another unit than a coefficient."""
    kinds = [finding_of_grasps(beta=0.2, kind="simple"), finding_of_grasps(beta=9.0, kind="groups")]
    plots = class_charts(
        class_of(LEAST_IN_CELL), study_of(*(Sensitivity("paper", recall=0.9, before=own, after=own) for own in kinds))
    )
    _all, associations, groups, *_ = plots
    assert titles([associations, groups]) == ["Associations by detector", "Groups by detector"]
    assert len(associations.dots) == len(groups.dots) == 1
