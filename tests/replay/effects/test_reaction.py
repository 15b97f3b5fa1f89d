import numpy as np
import pytest
from support.liquid_worlds import MIX, NEUTRAL, glass, poured, run_in

from replay.errors import PlanError

OPEN = [0.0, 0.0, *([90.0] * 100), 0.0, 0.0]


def test_the_end_point_is_where_the_acid_is_used_up():
    run = run_in(OPEN, MIX, NEUTRAL)["reaction"]
    (event,) = run.events
    assert event.name == "end-point" and event.values["volume_ml"] == pytest.approx(0.5, rel=1e-9)
    ph = run.series["flask/pH"]
    assert np.interp(event.time, ph.times, ph.values) == pytest.approx(7.0, abs=2.0)
    assert ph.values[0] == pytest.approx(1.0, abs=1e-6) and (np.diff(ph.values) >= 0.0).all() and ph.values[-1] > 11.0


def test_the_ph_halfway_to_the_end_point_of_a_weak_acid_is_its_pka():
    acid = glass("flask", 0.5, solute="HAc", molar=0.1)
    weak = ("reaction", {"equation": "C2H4O2 + NaOH -> C2H3NaO2 + H2O", "acids": {"C2H4O2": [4.756]}, "pkw": 14.0})
    acid.extra["properties"]["liquid"]["solute"] = "C2H4O2"
    effects = run_in(OPEN, MIX, weak, acid=acid)
    ph, volume = effects["reaction"].series["flask/pH"], effects["mixing"].series["flask/volume"]
    half = np.interp(0.75, volume.values, volume.times)
    assert np.interp(half, ph.times, ph.values) == pytest.approx(4.756, abs=0.01)


def test_before_the_end_point_there_is_none_and_alone_nothing_reacts():
    assert run_in([0.0, 10.0, 0.0], MIX, NEUTRAL)["reaction"].events == ()
    run = run_in([0.0, 0.0], MIX, NEUTRAL)["reaction"]
    assert run.events == () and run.series == {} and run.frames_run == 0


def test_a_reaction_with_a_rate_nears_the_end_of_its_limiting_reagent():
    zinc = glass("b", 0.0)
    zinc.extra["properties"]["solid"] = {"formula": "Zn", "mass_g": 0.05, "molar_mass": 65.38}
    slow = ("reaction", {"equation": "Zn + 2 HCl -> ZnCl2 + H2", "rate_per_s": 2.0})
    acid = glass("a", 60.0, solute="HCl", molar=2.0)
    run = poured([0.0, *([60.0] * 100)], (acid, zinc), ("mixing", {"in": ["b"]}), slow)["reaction"]
    extent = run.series["b/extent"]
    assert extent.values[0] == 0.0 and len(extent.times) == run.frames_run == 99 and extent.times[0] == 0.02
    assert extent.values[-1] == pytest.approx(-0.05 / 65.38 * np.expm1(-2.0 * 0.98), rel=1e-9)
    assert run.series["b/pH"].values[-1] < 0.0 and run.events == ()


@pytest.mark.parametrize(
    ("settings", "words"),
    [({"equation": "HCl + NaOH -> NaCl"}, "not balanced"), ({"equation": "salt"}, "has no ->"),
     ({"acids": {"HF": 3.2}}, "rising list"), ({"acids": {"HF": [5.0, 3.0]}}, "rising list"),
     ({"bases": {"NH3": [9.25]}}, "conjugate acid")],
)  # fmt: skip
def test_chemistry_that_cannot_be_is_refused_when_planned(settings, words):
    with pytest.raises(PlanError, match=words):
        run_in([0.0, 0.0], MIX, ("reaction", {**NEUTRAL[1], **settings}))
