import numpy as np
import pytest
from support.liquid_worlds import (
    glass,
    poured,
)  # fmt: skip

from replay.effects.effect_summary import leading


def test_a_reaction_with_a_rate_nears_the_end_of_its_limiting_reagent():
    zinc = glass("b", 0.0)
    zinc.extra["properties"]["solid"] = {"formula": "Zn", "mass_g": 0.05}
    slow = ("reaction", {"equation": "Zn + 2 HCl -> ZnCl2 + H2", "rate_per_s": 2.0})
    acid = glass("a", 60.0, solute="HCl", molar=2.0)
    run = poured([0.0, *([60.0] * 100)], (acid, zinc), ("mixing", {"in": ["b"]}), slow)["reaction"]
    extent = run.series["b/extent"]
    assert extent.values[0] == 0.0 and len(extent.times) == run.frames_run == 99 and extent.times[0] == 0.02
    assert extent.values[-1] == pytest.approx(-0.05 / 65.38 * np.expm1(-2.0 * 0.98), rel=1e-9)
    assert run.series["b/pH"].values[-1] < 0.0
    (event,) = run.events
    assert event.name == "gas" and event.values == {"moles": extent.values[-1], "formula": "H2"}
    assert event.time == pytest.approx(0.03) and event.end == pytest.approx(1.0)
    assert (
        leading({"reaction": run}) == event
        and run.series["b/H2 gone"].values[-1] == extent.values[-1]
        and run.series["b/H2 gone"].unit == "mol"
    )


def test_gas_that_leaves_is_told_of_every_vessel_without_a_jar_and_is_what_stays_dissolved_less():
    """Soda of 0.5 mol/L with acid in excess: a litre keeps 3.3e-4 mol/(m3 Pa) times an atmosphere of the CO2."""
    soda, acid = glass("b", 10.0, solute="NaHCO3", molar=0.5), glass("a", 60.0, solute="HCl", molar=1.0)
    gas = ("reaction", {"equation": "NaHCO3 + HCl -> NaCl + H2O + CO2"})
    effects = poured([0.0, *([60.0] * 50)], (acid, soda), ("mixing", {"in": ["b"]}), gas)
    volume = effects["mixing"].series["b/volume"].values
    (event,) = effects["reaction"].output.named("gas")
    # Gas that left stays away: most of it is gone in the first row with acid for all of the soda, at its volume.
    litres = 1e-3 * volume[volume >= 15.0][0]
    assert event.values["moles"] == pytest.approx(5e-3 - 3.3e-7 * 101325.0 * litres, rel=0.01)
    assert "4.35 mmol CO2 leave b as gas" in event.text
    flat = ("reaction", {"equation": "HCl + NaOH -> NaCl + H2O"})
    quiet = poured(
        [0.0, *([60.0] * 50)], (acid, glass("b", 10.0, solute="NaOH", molar=0.5)), ("mixing", {"in": ["b"]}), flat
    )
    assert not quiet["reaction"].output.named("gas")
