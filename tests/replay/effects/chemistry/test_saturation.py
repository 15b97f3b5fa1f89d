"""A solid that an equation dissolves at a rate dissolves up to PHREEQC's equilibrium, and its gas leaves for good."""

import phreeqc
import pytest
from support.liquid_worlds import effects_of_tilt_degrees, glass
from support.second_opinions import minteq

MARBLE = "CaCO3 + 2 HCl -> CaCl2 + H2O + CO2"
WATER_ML = 1.0
STEPS = 200
"""Portions of marble that PHREEQC dissolves one after the other."""


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


def dissolved_in_portions(acid_mol, kilograms):
    """Marble that dissolves in small portions while CO2 leaves for good: mol dissolved, mol of gas and pH."""
    library = phreeqc.Phreeqc()
    library.LoadDatabaseString(minteq())
    start = (
        "SELECTED_OUTPUT\n -reset false\n -pH true\n -saturation_indices Calcite\n -equilibrium_phases CO2(g)\n"
        f"SOLUTION 1\n units mol/kgw\n water {kilograms}\n pH 1 charge\n Cl {acid_mol / kilograms}\nEND\n"
    )
    assert not library.RunString(start)
    portion, dissolved, gas = 0.65 * acid_mol / STEPS, 0.0, 0.0
    step = (
        f"USE solution 1\nREACTION 1\n CaCO3 1\n {portion} moles\n"
        "EQUILIBRIUM_PHASES 1\n CO2(g) 0 0\nSAVE solution 2\nEND\n"
    )
    while True:
        assert not library.RunString(step)
        output = library.GetSelectedOutput()
        if output["si_Calcite"][-1] >= 0.0:
            break
        dissolved += portion
        gas += output["CO2(g)"][-1]
        assert not library.RunString("COPY solution 2 1\nEND\n")
    # The last portion dissolves in what is left of the gas.
    last = "-equilibrium_phases Calcite\nUSE solution 1\nEQUILIBRIUM_PHASES 2\n Calcite 0 1\nEND\n"
    assert not library.RunString(f"SELECTED_OUTPUT\n -reset false\n -pH true\n {last}")
    output = library.GetSelectedOutput()
    return dissolved + 1.0 - output["Calcite"][-1], gas, output["pH"][-1]


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
    expected_dissolved_mol, expected_gas_mol, expected_ph = dissolved_in_portions(acid_mol, kilograms)
    assert last_values["b/extent"] == pytest.approx(expected_dissolved_mol, rel=0.01)
    assert gas_mol == pytest.approx(expected_gas_mol, rel=0.01, abs=2e-6)
    assert last_values["b/pH"] == pytest.approx(expected_ph, abs=0.05)


@pytest.mark.parametrize(
    ("solid", "equation", "tolerance"),
    [
        # By a rate 2.2 % more leaves, most of which else stays dissolved.
        ("FeS", "FeS + 2 HCl -> FeCl2 + H2S", 0.03),
        # By the rate 0.07 % less leaves: 0.03 % less dissolves, of which not half becomes gas.
        pytest.param("ZnS", "ZnS + 2 HCl -> ZnCl2 + H2S", 0.002, marks=pytest.mark.slow),
    ],
    ids=["FeS", "ZnS"],
)
def test_a_rate_changes_no_amount_of_a_sulfide_that_dissolves(solid, equation, tolerance):
    """9.3 mL of acid of 1 mol/L are poured on a gram of a sulfide, more than it dissolves; H2S leaves as a gas.

    As much leaves at once as by a rate of 20 a second in 0.4 s, when exp(-8), 0.03 %, is still to dissolve.
    ``tolerance``: of that, as a fraction. The pH is the same too, and no event says that nothing reacts.
    """
    at_once, gas_at_once_mol, _effects = acid_poured_on(solid, "HCl", molar=1.0, equation=equation)
    slow, slow_gas_mol, effects = acid_poured_on(solid, "HCl", molar=1.0, equation=equation, rate_per_s=20.0)
    assert slow_gas_mol > 0.0
    assert slow_gas_mol == pytest.approx(gas_at_once_mol, rel=tolerance)
    assert slow["b/pH"] == pytest.approx(at_once["b/pH"], abs=0.02)
    assert not effects["reaction"].output.events_named("no-reaction")


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
