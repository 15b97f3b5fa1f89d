"""Salts beside other ions, against PHREEQC's Pitzer equations: within 6 %, or withheld by name."""

from functools import cache
from pathlib import Path

import numpy as np
import phreeqc
import pytest
from support.liquid_worlds import BURETTE_COLUMN, MIXING_IN_FLASK, effects_of_tap_degrees, glass

from replay.effects.chemistry.components import dissolved_components
from replay.effects.chemistry.matter import MOST_FOREIGN_MOL_KG, SALTING_OUT_KG_MOL
from replay.effects.chemistry.salts import salt_of, settled_solid, solubility_of

PITZER = Path(phreeqc.__file__).parent / "databases" / "pitzer.dat"
WATER_MOL = 1.0 / 0.0180153


@cache
def library_with_pitzer():
    """PHREEQC with its data base of Pitzer's equations."""
    library = phreeqc.Phreeqc()
    library.LoadDatabase(str(PITZER))
    return library


def dissolved_by_pitzer(phase, ions):
    """mol/kg of a salt that dissolve in so much of other ions, PHREEQC's elements with mol/kg."""
    library = library_with_pitzer()
    solution = "SOLUTION 1\n units mol/kgw\n pH 1 charge\n" + "".join(
        f" {name} {many}\n" for name, many in ions.items()
    )
    output = f"SELECTED_OUTPUT\n -reset false\n -high_precision true\n -equilibrium_phases {phase}\n"
    assert not library.RunString(f"{output}{solution}EQUILIBRIUM_PHASES 1\n {phase} 0 20\nEND\n")
    return 20.0 - library.GetSelectedOutput()[phase][-1]


def dissolved_by_table(formula, other, molal):
    """mol/kg of a salt that dissolve beside another electrolyte, as the ledger computes it."""
    salt = salt_of(formula, solubility_of(formula))
    names = dict.fromkeys(("H+", "H2O", *salt.components, *dissolved_components(other)))
    column = {name: index for index, name in enumerate(names)}
    amounts = np.zeros((1, len(column)))
    amounts[0, column["H2O"]] = WATER_MOL
    for components, many in ((salt.components, 20.0), (dissolved_components(other), molal)):
        for component, count in components.items():
            amounts[0, column[component]] += count * many
    return 20.0 - float(settled_solid(salt, column, amounts, np.array([25.0]))[0])


@pytest.mark.parametrize("molal", [0.0, 0.1, 0.3, MOST_FOREIGN_MOL_KG])
@pytest.mark.parametrize(
    ("formula", "phase", "other", "elements"),
    [
        ("NaCl", "Halite", "HCl", ("Cl",)), ("NaCl", "Halite", "KCl", ("K", "Cl")), ("KCl", "Sylvite", "HCl", ("Cl",)),
        ("KCl", "Sylvite", "NaCl", ("Na", "Cl")),
    ],
)  # fmt: skip
def test_salt_solubility_beside_other_ions_agrees_with_pitzer(formula, phase, other, elements, molal):
    """mol/kg of a salt that dissolve beside ``molal`` mol/kg of another electrolyte, by the table of its solubility.

    They are those of PHREEQC with Pitzer's equations within 6 %; beyond MOST_FOREIGN_MOL_KG the product withholds the
    salt. ``phase``, ``elements``: of the salt and of the other electrolyte by PHREEQC's names; the protons of HCl
    balance the charge.
    """
    expected = dissolved_by_pitzer(phase, dict.fromkeys(elements, molal))
    assert dissolved_by_table(formula, other, molal) == pytest.approx(expected, rel=0.06)


def test_beyond_the_limit_the_table_is_far_from_pitzer():
    """The reason for the limit of 0.5 mol/kg: in 3 mol/kg of HCl 3.10 mol/kg of NaCl dissolve; the table says 4.8."""
    assert dissolved_by_pitzer("Halite", {"Cl": 3.0}) == pytest.approx(3.10, abs=0.01)
    assert dissolved_by_table("NaCl", "HCl", molal=3.0) > 4.7


@pytest.mark.parametrize(
    ("phase", "ions", "elements", "strength"),
    [
        ("Halite", ("Na", "Cl"), {"Cl": 4.0}, 4.0), ("Halite", ("Na", "Cl"), {"Mg": 2.0, "Cl": 4.0}, 6.0),
        ("Sylvite", ("K", "Cl"), {"Li": 4.0, "Cl": 4.0}, 4.0), ("Sylvite", ("K", "Cl"), {"Na": 4.0}, 4.0),
        ("Thenardite", ("Na", "Na", "S(6)"), {"Li": 4.0, "Cl": 4.0}, 4.0),
    ],
)  # fmt: skip
def test_other_ions_lower_saturation_by_less_than_the_bound(phase, ions, elements, strength):
    """A salt of ``ions`` is at saturation alone, and beside mol/kg of other ``elements`` with this ionic ``strength``.

    By Pitzer's equations the geometric mean of the molalities of its ions falls by less than the product's bound, which
    is a power of ten that grows with the strength.
    """

    def mean_molality(others):
        dissolved = dissolved_by_pitzer(phase, others)
        molal = [ions.count(ion) * dissolved + others.get(ion, 0.0) for ion in ions]
        return np.prod(molal) ** (1.0 / len(ions))

    assert -np.log10(mean_molality(elements) / mean_molality({})) < SALTING_OUT_KG_MOL * strength


OPEN_FOR_06_S = [*([0.0] * 2), *([90.0] * 15), *([0.0] * 8)]
"""Degrees of the tap, one a frame of `STEP_NS`."""

STEP_NS = 40_000_000

HALITE = ("reaction", {"equation": "NaCl(s) -> Na+ + Cl-"})


def acid_into_brine(molar):
    """Output of the reaction where 0.8 mL of hydrochloric acid run into 2 mL with 5.4 mol/L of salt."""
    acid = glass("burette", volume_ml=50.0, solute="HCl", molar=molar, cavity=BURETTE_COLUMN)
    brine = glass("flask", volume_ml=2.0, solute="NaCl", molar=5.4)
    effects = effects_of_tap_degrees(OPEN_FOR_06_S, MIXING_IN_FLASK, HALITE, burette=acid, flask=brine, step_ns=STEP_NS)
    return effects["reaction"].output


def test_a_salt_in_a_brine_is_withheld_by_name():
    """Acid of 12 mol/L runs into nearly saturated salt water, beyond the limit for salts beside other ions.

    A warning says so, and no amount of solid salt is a series.
    """
    output = acid_into_brine(molar=12.0)
    (event,) = output.events_named("brine")
    assert event.text.startswith("NaCl is in a brine in flask") and event.level == "warning"
    assert "flask/NaCl" not in output.series


def test_dilute_acid_in_salt_water_is_not_reported_as_brine():
    """Acid of 0.3 mol/L, below the limit of 0.5 for other ions, runs into nearly saturated salt water."""
    assert not acid_into_brine(molar=0.3).events_named("brine")


def test_gypsum_in_a_brine_is_named_in_the_warning():
    """Calcium runs into sulfate, both in 3 mol/L of NaCl, and gypsum, CaSO4, falls out.

    In 3 mol/kg of NaCl 0.058 mol/kg of it dissolve by Pitzer's equations, which are made for brines, and 0.025 by
    PHREEQC's minteq.v4, which computes it here: so the warning says that twice as much may dissolve.
    """
    calcium = glass("burette", volume_ml=50.0, solutes={"CaCl2": 1.0, "NaCl": 3.0}, cavity=BURETTE_COLUMN)
    sulfate = glass("flask", volume_ml=2.0, solutes={"Na2SO4": 1.0, "NaCl": 3.0})
    gypsum = ("reaction", {"equation": "CaCl2 + Na2SO4 -> CaSO4 + 2 NaCl"})
    effects = effects_of_tap_degrees(
        OPEN_FOR_06_S, MIXING_IN_FLASK, gypsum, burette=calcium, flask=sulfate, step_ns=STEP_NS
    )
    (event,) = effects["reaction"].output.events_named("concentrated")
    assert "of CaSO4 twice as much or half may dissolve" in event.text


@pytest.mark.parametrize(
    ("acid", "molar", "formula", "grams", "equation"),
    [
        ("CH3COOH", 1.0, "NaHCO3", 0.05, "NaHCO3 + CH3COOH -> CH3COONa + H2O + CO2"),
        ("HCl", 2.0, "CaCO3", 1.0, "CaCO3 + 2 HCl -> CaCl2 + H2O + CO2"),
    ],
    ids=["soda", "marble"],
)
def test_what_acid_dissolves_has_no_warning_of_its_solubility(acid, molar, formula, grams, equation):
    """0.8 mL of an acid, 0.8 or 1.6 mmol, run on a solid: 0.6 mmol of soda, or 10 mmol of marble.

    Soda dissolves to its last grain, of marble as much as acid comes: the acid decides, not a solubility. So there is
    neither an event "brine" nor a "concentrated" one that doubts the solubility, as that of gypsum in the test above.
    """
    burette = glass("burette", volume_ml=50.0, solute=acid, molar=molar, cavity=BURETTE_COLUMN)
    flask = glass("flask", volume_ml=0.0, properties={"solid": {"formula": formula, "mass_g": grams}})
    output = effects_of_tap_degrees(
        OPEN_FOR_06_S,
        MIXING_IN_FLASK,
        ("reaction", {"equation": equation}),
        burette=burette,
        flask=flask,
        step_ns=STEP_NS,
    )["reaction"].output
    assert not output.events_named("brine")
    assert not any("may dissolve" in event.text for event in output.events_named("concentrated"))
