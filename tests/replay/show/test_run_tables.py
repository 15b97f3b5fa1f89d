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
    """NaN, and a path through what is not there (touch.moment), have no value; point.1 is the second coordinate."""
    row = SimpleNamespace(gap=float("nan"), touch=None, point=(1.0, 2.0, 3.0))
    columns = Column("gap", float, ""), Column("when", float, "", "touch.moment"), Column("y", float, "", "point.1")
    assert [column.value(row) for column in columns] == [None, None, 2.0]


@pytest.fixture(scope="module")
def result_of_two_contacts():
    """A run in which cubes touch twice; ``slow`` samples at 20 Hz."""
    return compute(unit_cubes_on_x(MEET_IN_4_AND_8_TO_10), detectors="slow=discrete[rate_hz=20]")


def column(made, name):
    """The cells of a column."""
    return [row[0] for row in made.only(name).cells()]


@pytest.mark.parametrize(("away", "known"), [(0.0, True), (1e4, False)])
def test_uncertain_first_touch_states_its_uncertainty(away, known):
    """``away``: metres from the origin; at 10 km rounding is larger than a micrometre.

    A cube's edge turns 1 nm deep into another: free and touching times must enclose the closed form of its way.
    """
    depth, rotated = 1e-9, 1.5
    result = compute(grazing(away, depth, rotated), detectors="exact", oracle="continuous")
    (miss,) = result.misses["exact"]
    # The edge is at 45 degrees, its way out half a diagonal: x = r cos(45 degrees - angle), and touches at r - depth.
    truth = 0.01 + 0.01 * (np.pi / 4 - np.arccos(1.0 - depth / (0.01 * 2**0.5))) / rotated
    assert miss.evidence.touch.free <= truth <= miss.evidence.touch.moment
    (row,) = result.tables["misses"].plain()
    assert (row["touch_free"], row["touch"]) == (miss.evidence.touch.free, miss.evidence.touch.moment)
    bound = f"within {duration(row['touch'] - row['touch_free'])}"
    moment = f"{miss.evidence.touch.moment:.3f}"
    assert column(miss_table(result, "exact"), "at s") == [moment if known else Marked(moment, "", bound)]
    assert known == (row["touch"] - row["touch_free"] <= 1e-6)


def test_quantiles_and_budget_fraction_are_over_samples(result_of_two_contacts):
    """Seconds of two stages in twelve frames of 10 ms; a detector of 25 Hz samples three of them."""
    seconds = {"volumes": np.array([0.02, 0.0, 0.0, 0.0, 0.01] + [0.0] * 7), "rest": np.full(12, 0.002)}
    slow = replace(result_of_two_contacts.detections["slow"], seconds=seconds)
    figures = sample_times(slow, 25.0)  # 100 frames a second, so frames 0, 4 and 8
    assert figures.samples == 3 and figures.over_budget == pytest.approx(2 / 3)
    assert [figures.median, figures.max] == pytest.approx([0.012, 0.022])
    assert figures.stages["volumes"].max == 0.02
    every = sample_times(slow, rate_hz=None)
    assert every.samples == 12 and every.median == pytest.approx(0.002)
    was = result_of_two_contacts.document.detectors["slow"]
    reported = structs.replace(was, seconds=structs.replace(was.seconds, sample_times=figures))
    document = structs.replace(result_of_two_contacts.document, detectors={"slow": reported})
    (row,) = cost_table(replace(result_of_two_contacts, document=document)).only("median ms", LATE_COLUMN).cells()
    assert row == ("12", "67 %")
