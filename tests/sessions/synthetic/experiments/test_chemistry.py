"""What the chemistry of the made-up experiments plants follows from amounts alone."""

import pytest

from sessions.synthetic.experiments.ammonia_calorimetry import AMMONIA_CALORIMETRY
from sessions.synthetic.experiments.carbonate_titration import CARBONATE_TITRATION
from sessions.synthetic.experiments.marble import MARBLE


def facts(experiment, kind):
    _, truth = experiment(noise="off", rate_hz=20.0, faces=600)
    return [fact for fact in truth.facts if fact.kind == kind]


def test_carbonate_has_two_end_points_the_second_at_twice_the_volume():
    first, second = facts(CARBONATE_TITRATION, "end_point")
    assert (first.values["volume_ml"], second.values["volume_ml"]) == pytest.approx((10.0, 20.0))
    assert first.start < second.start


def test_acid_in_excess_of_marble_leaves_the_ph_of_what_is_left():
    (fact,) = facts(MARBLE, "dissolve")
    # 12.5 mmol of acid, 4.0 mmol of marble that takes two each, in 25 mL.
    assert 25e-3 * 10.0 ** -fact.values["ph"] == pytest.approx(12.5e-3 - 2.0 * 0.4 / 100.086, rel=1e-9)


def test_the_calorimeter_takes_the_heat_of_the_acid():
    (fact,) = facts(AMMONIA_CALORIMETRY, "temperature")
    # 25 mmol of 52.22 kJ/mol into 65 mL of 4.18 J/(mL K) and a vessel of 25 J/K.
    assert fact.values["to_c"] - fact.values["from_c"] == pytest.approx(1305.5 / (4.18 * 65.0 + 25.0), rel=1e-9)
