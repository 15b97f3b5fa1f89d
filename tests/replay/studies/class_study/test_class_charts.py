"""Charts of a class show only figures that enough students stand behind."""

from types import SimpleNamespace

from replay.studies.class_study.charts import class_charts
from replay.studies.class_study.refusals import LEAST_IN_CELL


def class_of(students, seconds=1.5):
    """Stands for the tables of a class of so many students without groups."""
    estimate = SimpleNamespace(students=students, value=seconds, low=1.0, high=2.0)
    return SimpleNamespace(contact_seconds_a_minute=lambda members: estimate)


def test_time_in_contact_is_drawn_from_enough_students_only():
    assert len(class_charts(class_of(LEAST_IN_CELL), None)) == 1
    assert class_charts(class_of(LEAST_IN_CELL - 1), None) == []
    assert class_charts(class_of(LEAST_IN_CELL, seconds=float("nan")), None) == []
