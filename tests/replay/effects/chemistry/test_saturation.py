"""A solid that an equation dissolves at a rate dissolves up to PHREEQC's equilibrium, and its gas leaves for good."""

import phreeqc
import pytest
from support.liquid_worlds import effects_of_tilt_degrees, glass
from support.second_opinions import minteq

from replay.effects.chemistry.salts import WATER_KG
from replay.effects.chemistry.solution_water import water_molar

MARBLE = "CaCO3 + 2 HCl -> CaCl2 + H2O + CO2"
WATER_ML = 1.0
STEPS = 1000
"""Portions of a solid that PHREEQC dissolves one after the other."""


def acid_poured_on(solid, acid, *, molar, equation, rate_per_s=None):
    """Last values of the series, mol of gas, and the effects of acid poured in 20 ms on a gram of a solid in 1 mL.

    They are of 0.4 s later; without a rate the equation runs at once.
    """
    bodies = (
        glass("a", volume_ml=60.0, solute=acid, molar=molar),
        glass("b", WATER_ML, properties={"solid": {"formula": solid, "mass_g": 1.0}}),
    )
    reaction = ("reaction", {"equation": equation} | ({} if rate_per_s is None else {"rate_per_s": rate_per_s}))
    effects = effects_of_tilt_degrees([0.0, 60.0, 60.0, *([0.0] * 40)], bodies, ("mixing", {"in": ["b"]}), reaction)
    gas = sum(event.values["moles"] for event in effects["reaction"].output.events_named("gas"))
    return {name: series.values[-1] for name, series in effects["reaction"].series.items()}, gas, effects


def phreeqc_with_acid(acid_mol, kilograms, phase, gas):
    """PHREEQC with minteq.v4's constants and hydrochloric acid as its solution 1; a solid ``phase`` and a gas."""
    library = phreeqc.Phreeqc()
    library.LoadDatabaseString(minteq())
    start = (
        f"SELECTED_OUTPUT\n -reset false\n -pH true\n -saturation_indices {phase}\n -equilibrium_phases {gas} {phase}\n"
        f"SOLUTION 1\n units mol/kgw\n water {kilograms}\n pH 1 charge\n Cl {acid_mol / kilograms}\nEND\n"
    )
    assert not library.RunString(start)
    return library


def dissolved_beside_gas(acid_mol, kilograms, phase, gas):
    """A mol of a solid with acid and its gas of 1 atm, closed: mol dissolved, mol of gas and pH at equilibrium."""
    library = phreeqc_with_acid(acid_mol, kilograms, phase, gas)
    assert not library.RunString(f"USE solution 1\nEQUILIBRIUM_PHASES 1\n {phase} 0 1\n {gas} 0 0\nEND\n")
    output = library.GetSelectedOutput()
    return 1.0 - output[phase][-1], output[gas][-1], output["pH"][-1]


def dissolved_in_portions(acid_mol, kilograms, solid, phase, gas):
    """A solid that dissolves in small portions while its gas leaves for good: mol dissolved, mol of gas and pH."""
    library = phreeqc_with_acid(acid_mol, kilograms, phase, gas)
    portion, dissolved, gas_mol = 0.65 * acid_mol / STEPS, 0.0, 0.0
    step = (
        f"USE solution 1\nREACTION 1\n {solid} 1\n {portion} moles\n"
        f"EQUILIBRIUM_PHASES 1\n {gas} 0 0\nSAVE solution 2\nEND\n"
    )
    while True:
        assert not library.RunString(step)
        output = library.GetSelectedOutput()
        if output[f"si_{phase}"][-1] >= 0.0:
            break
        dissolved += portion
        gas_mol += output[gas][-1]
        assert not library.RunString("COPY solution 2 1\nEND\n")
    # Of the last portion as much dissolves as still can.
    assert not library.RunString(f"USE solution 1\nEQUILIBRIUM_PHASES 2\n {phase} 0 1\n {gas} 0 0\nEND\n")
    output = library.GetSelectedOutput()
    return dissolved + 1.0 - output[phase][-1], gas_mol + output[gas][-1], output["pH"][-1]


@pytest.mark.slow
@pytest.mark.parametrize("molar", [1.0, 0.3, 0.1])
def test_marble_dissolves_at_a_rate_as_far_as_phreeqc_says(molar):
    """Acid is poured on a gram of marble in 1 mL of water; after 0.4 s, at 20 a second, all has dissolved that can.

    Expected are the mol that dissolve, the mol of CO2 and the pH by PHREEQC, which dissolves marble in the acid that
    came in small portions, until it is saturated; CO2 leaves for good after each.
    """
    last_values, gas_mol, effects = acid_poured_on("CaCO3", "HCl", molar=molar, equation=MARBLE, rate_per_s=20.0)
    volume_ml = effects["mixing"].series["b/volume"].values[-1]
    acid_mol, kilograms = 1e-3 * molar * (volume_ml - WATER_ML), 1e-3 * volume_ml
    expected_dissolved_mol, expected_gas_mol, expected_ph = dissolved_in_portions(
        acid_mol, kilograms, "CaCO3", "Calcite", "CO2(g)"
    )
    assert last_values["b/extent"] == pytest.approx(expected_dissolved_mol, rel=0.01)
    assert gas_mol == pytest.approx(expected_gas_mol, rel=0.01, abs=2e-6)
    assert last_values["b/pH"] == pytest.approx(expected_ph, abs=0.05)


@pytest.mark.parametrize(
    ("solid", "phase", "tolerance"),
    [
        # By the rate what is still to dissolve makes no gas of FeS.
        ("FeS", "FeS(ppt)", 1e-4),
        # H2S stays dissolved up to saturation, and less than half of it leaves: a miss of 0.03 % is 0.07 % of the gas.
        pytest.param("ZnS", "ZnS(am)", 1e-3, marks=pytest.mark.slow),
    ],
    ids=["FeS", "ZnS"],
)
def test_sulfide_gives_phreeqcs_gas_at_once_and_by_a_rate(solid, phase, tolerance):
    """9.3 mL of acid of 1 mol/L are poured on a gram of a sulfide, more than it dissolves; H2S leaves as a gas.

    Without a rate every drop comes to equilibrium with solid and gas before the next: expected is PHREEQC's equilibrium
    of all together. By a rate of 20 a second the acid is there before the solid dissolves: expected is PHREEQC's
    solution in which the solid dissolves in portions, and the gas of each leaves for good. Of FeS 2.2 % more leaves by
    the rate: at pH 3 Fe+2 takes up dissolved H2S as Fe(HS)2, and gas that has left does not take its place. ZnS leaves
    the acid at pH 0.4, where Zn+2 takes up none.

    After 0.4 s exp(-8), 0.03 %, is still to dissolve. ``tolerance``: of the gas by the rate, as a fraction.
    """
    equation = f"{solid} + 2 HCl -> {solid.removesuffix('S')}Cl2 + H2S"
    at_once, gas_at_once_mol, effects = acid_poured_on(solid, "HCl", molar=1.0, equation=equation)
    slow, slow_gas_mol, slow_effects = acid_poured_on(solid, "HCl", molar=1.0, equation=equation, rate_per_s=20.0)
    acid_mol = 1e-3 * (effects["mixing"].series["b/volume"].values[-1] - WATER_ML)
    kilograms = 1e-3 * WATER_ML + acid_mol * water_molar({"HCl": 1.0}) * WATER_KG
    _, expected_gas_mol, expected_ph = dissolved_beside_gas(acid_mol, kilograms, phase, "H2S(g)")
    assert gas_at_once_mol == pytest.approx(expected_gas_mol, rel=1e-6)
    assert at_once["b/pH"] == pytest.approx(expected_ph, abs=1e-4)
    expected_dissolved_mol, expected_slow_gas_mol, expected_slow_ph = dissolved_in_portions(
        acid_mol, kilograms, solid, phase, "H2S(g)"
    )
    assert slow["b/extent"] == pytest.approx(expected_dissolved_mol, rel=5e-4)
    assert slow_gas_mol == pytest.approx(expected_slow_gas_mol, rel=tolerance)
    assert slow["b/pH"] == pytest.approx(expected_slow_ph, abs=0.005)
    assert not slow_effects["reaction"].output.events_named("no-reaction")


def test_sulfide_that_hardly_dissolves_gives_no_gas_by_a_rate():
    """Acid of 1 mol/L is poured on a gram of CuS, with a rate of 20 a second, and without one.

    No gas leaves, the pH is the same, and an event says that CuS hardly dissolves.
    """
    equation = "CuS + 2 HCl -> CuCl2 + H2S"
    at_once, gas_at_once_mol, _effects = acid_poured_on("CuS", "HCl", molar=1.0, equation=equation)
    slow, slow_gas_mol, effects = acid_poured_on("CuS", "HCl", molar=1.0, equation=equation, rate_per_s=20.0)
    assert slow_gas_mol == gas_at_once_mol == 0.0
    assert slow["b/pH"] == pytest.approx(at_once["b/pH"], abs=0.02)
    event, *_ = effects["reaction"].output.events_named("no-reaction")
    assert "CuS hardly dissolves in it" in event.text
