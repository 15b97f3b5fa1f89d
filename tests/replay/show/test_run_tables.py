"""Tables are plain data, and their counts are those of the run."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from msgspec import structs
from support.small_worlds import MEET_IN_4_AND_8_TO_10, grazing, unit_cubes_on_x

from replay.document.summary import sample_times
from replay.document.tables import Column, Marked
from replay.engine import compute
from replay.show.run_tables import (
    LATE_COLUMN,
    cost_table,
    miss_table,
)
from replay.words import duration


def test_unmeasured_values_of_table_columns_are_none():
    """A column reads a value of a row by its name or by a path with dots, in which a number counts positions from 0.

    NaN, and a path through an attribute that is None, have no value.
    """
    row = SimpleNamespace(gap=float("nan"), touch=None, point=(1.0, 2.0, 3.0))
    gap, moment = Column("gap", float), Column("moment", float, of="touch.moment")
    second_coordinate = Column("y", float, of="point.1")
    assert gap.value(row) is None
    assert moment.value(row) is None
    assert second_coordinate.value(row) == 2.0


@pytest.fixture(scope="module")
def result_of_two_contacts():
    """A run of 12 frames of 10 ms in which two cubes touch twice; the detector ``slow`` samples at 20 Hz."""
    return compute(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), detectors="slow=discrete[rate_hz=20]")


def cells_of_column(table, name):
    """The cells of a column."""
    return [cell for (cell,) in table.only(name).cells()]


def touch_of_turning_cube(metres_from_origin, depth):
    """The only miss of ``exact``, which decides frames alone, its row, its cell in a table, and the true moment.

    A cube of 2 cm turns by 1.5 rad from frame 1 (10 ms) to frame 2, and its edge by ``depth`` into a cube at rest.
    """
    angle, frame_seconds = 1.5, 0.01
    result = compute(grazing(metres_from_origin, depth, angle), detectors="exact", oracle="continuous")
    (miss,) = result.misses["exact"]
    (row,) = result.tables["misses"].plain()
    (cell,) = cells_of_column(miss_table(result, "exact"), "at s")
    # The edge, half a diagonal r = 0.01 m * sqrt(2) from the axis, begins at 45 degrees. Its reach is r cos(45 degrees
    # - angle), and touches at r - depth.
    fraction = (np.pi / 4 - np.arccos(1.0 - depth / (0.01 * 2**0.5))) / angle
    return SimpleNamespace(true_moment=frame_seconds * (1.0 + fraction), touch=miss.evidence.touch, row=row, cell=cell)


def test_first_touch_near_the_origin_is_known_to_a_microsecond():
    """A cube's edge turns 1 nm deep into another cube, between two frames of 10 ms; ``exact`` misses that.

    The last free and the first touching time enclose the moment by geometry; the table shows the latter alone.
    """
    case = touch_of_turning_cube(metres_from_origin=0.0, depth=1e-9)
    assert case.touch.free <= case.true_moment <= case.touch.moment
    assert (case.row["touch_free"], case.row["touch"]) == (case.touch.free, case.touch.moment)
    assert case.touch.moment - case.touch.free <= 1e-6
    assert case.cell == f"{case.touch.moment:.3f}"


def test_uncertain_first_touch_states_its_uncertainty():
    """10 km from the origin coordinates are rounded to 2e-12 m: the time of a touch 1 nm deep is not sharp.

    The last free and the first touching time still enclose the moment by geometry, over a microsecond apart, and the
    table says how far.
    """
    case = touch_of_turning_cube(metres_from_origin=1e4, depth=1e-9)
    assert case.touch.free <= case.true_moment <= case.touch.moment
    uncertainty = case.touch.moment - case.touch.free
    assert uncertainty > 1e-6
    assert case.cell == Marked(f"{case.touch.moment:.3f}", "", f"within {duration(uncertainty)}")


TWELVE_FRAMES = {
    "volumes": np.array([0.020, 0.0, 0.0, 0.0, 0.010] + [0.0] * 7),
    "rest": np.full(12, 0.002),
}
"""Seconds of two stages: 22 ms in frame 0, 12 ms in frame 4, 2 ms in each other one."""


def test_quantiles_and_budget_fraction_are_over_samples(result_of_two_contacts):
    """12 frames of 10 ms take 22, 2, 2, 2, 12 ms, then 2 ms each, of which the stage ``volumes`` takes all over 2 ms.

    At 25 Hz frames 0, 4 and 8 are sampled: 22, 12 and 2 ms, of which two are over the budget of 11.1 ms.
    """
    detection = replace(result_of_two_contacts.detections["slow"], seconds=TWELVE_FRAMES)
    times = sample_times(detection, rate_hz=25.0)
    assert times.samples == 3
    assert times.over_budget == pytest.approx(2 / 3)
    assert [times.median, times.max] == pytest.approx([0.012, 0.022])
    assert times.stages["volumes"].max == 0.020


def test_detector_without_a_rate_samples_every_frame(result_of_two_contacts):
    """A detector took 22, 2, 2, 2 and 12 ms for its first frames, then 2 ms for each of seven more.

    The median is 2 ms.
    """
    detection = replace(result_of_two_contacts.detections["slow"], seconds=TWELVE_FRAMES)
    times = sample_times(detection, rate_hz=None)
    assert times.samples == 12
    assert times.median == pytest.approx(0.002)


def test_cost_table_shows_median_and_samples_over_budget(result_of_two_contacts):
    """A detector of 25 Hz took 22, 12 and 2 ms for its samples: a median of 12 ms.

    Two of three are over the budget of a frame, 11.1 ms.
    """
    detection = replace(result_of_two_contacts.detections["slow"], seconds=TWELVE_FRAMES)
    detector = result_of_two_contacts.document.detectors["slow"]
    seconds = structs.replace(detector.seconds, sample_times=sample_times(detection, rate_hz=25.0))
    document = structs.replace(
        result_of_two_contacts.document, detectors={"slow": structs.replace(detector, seconds=seconds)}
    )
    table = cost_table(replace(result_of_two_contacts, document=document))
    assert cells_of_column(table, "median ms") == ["12"]
    assert cells_of_column(table, LATE_COLUMN) == ["67 %"]
