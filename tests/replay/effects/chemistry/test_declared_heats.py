"""A declared heat is the heat that is given, of any solid and any reaction; advice on a missing one can be followed."""

import re

import pytest
from support.liquid_worlds import glass, heat_of_pouring, poses_at_rest, session_with_effects

from replay.effects.chemistry.formulas import molar_mass
from replay.effects.effect_plan import plan_faults

HEAT = ("heat", {"of": "liquids", "ambient_c": 20.0, "loss_w_per_k": 0.0})
# Solid, its equation, and a heat that may be right or wrong: it is the scene's.
SOLIDS = [
    ("NaOH", "NaOH(s) -> Na+ + OH-", -44.0),
    ("NaOH", "NaOH(s) -> NaOH", -44.0),
    ("(NH4)2SO4", "(NH4)2SO4(s) -> 2 NH4+ + SO4^2-", 6.6),
    ("NH4Cl", "NH4Cl(s) -> NH4Cl(aq)", 14.8),
    ("Na2CO3.10H2O", "Na2CO3.10H2O(s) -> 2 Na+ + CO3^2- + 10 H2O", 67.0),
    ("Na2S2O3.5H2O", "Na2S2O3.5H2O(s) -> Na2S2O3 + 5 H2O", 47.0),
    ("KAl(SO4)2.12H2O", "KAl(SO4)2.12H2O(s) -> KAl(SO4)2 + 12 H2O", 40.0),
    ("C6H8O7", "C6H8O7(s) -> C6H8O7", 18.0),
    ("K2CO3", "K2CO3(s) -> K2CO3", -32.0),
    ("H2C2O4.2H2O", "H2C2O4.2H2O(s) -> H2C2O4 + 2 H2O", 36.0),
    ("KI", "KI(s) -> K+ + I-", 20.0),
]


RATES = [{}, {}, {"rate_per_s": 1e3}, *[{}] * 8]


def solid_in_b(formula, moles):
    """Arguments of a glass with so many mol of a solid and no liquid."""
    return {"properties": {"solid": {"formula": formula, "mass_g": moles * molar_mass(formula)}}, "volume_ml": 0.0}


@pytest.mark.sampled(5)
@pytest.mark.parametrize(
    ("solid", "equation", "heat_kj_mol", "rate"),
    [(*row, rate) for row, rate in zip(SOLIDS, RATES, strict=True)],
    ids=[row[1] for row in SOLIDS],
)
def test_a_solid_dissolves_with_its_declared_heat(solid, equation, heat_kj_mol, rate):
    """100 mL of water are poured on 0.01 mol, which dissolves by an equation, at once or by a quick rate.

    The water warms by 10 J for each kJ/mol that the scene declares, right or wrong, with the sign turned.
    """
    joule, _coldest_c, _warmest_c = heat_of_pouring(
        {"volume_ml": 100.0}, solid_in_b(solid, moles=0.01), equation,
        steps=3 if rate else 1, heat_kj_mol=heat_kj_mol, **rate,
    )  # fmt: skip
    # What hydrolyses or takes protons a little differs with the strength: 2 J.
    assert joule == pytest.approx(-10.0 * heat_kj_mol, rel=0.02, abs=2.0)


def test_a_sparing_solid_dissolves_with_its_declared_heat():
    """100 mL of water are poured on 0.05 g of Ca(OH)2 (74.09 g/mol), which dissolve wholly: 100 kJ/mol are declared."""
    moles = 0.05 / 74.09
    joule, _coldest_c, _warmest_c = heat_of_pouring(
        {"volume_ml": 100.0}, solid_in_b("Ca(OH)2", moles), "Ca(OH)2(s) -> Ca2+ + 2 OH-", steps=2, heat_kj_mol=-100.0
    )
    assert joule == pytest.approx(100e3 * moles, rel=0.02)


@pytest.mark.parametrize(
    ("acid", "metal", "equation", "heat_kj_mol"),
    [
        ({"CH3COOH": 0.4}, "Mg", "Mg + 2 CH3COOH -> Mg(CH3COO)2 + H2", -466.0),
        ({"HCl": 0.4}, "Zn", "Zn + 2 HCl -> ZnCl2 + H2", -150.0),
    ],
    ids=["magnesium", "zinc"],
)
def test_reactions_give_their_declared_heat(acid, metal, equation, heat_kj_mol):
    """100 mL of an acid, 40 mmol, are poured on 2 mmol of a metal, which needs 4 mmol and all dissolves.

    It dissolves in a few ms, by 1,000 a second, and gives the heat that the scene declares for a mol.
    """
    moles = 0.002
    joule, _coldest_c, _warmest_c = heat_of_pouring(
        {"volume_ml": 100.0, "solutes": acid}, solid_in_b(metal, moles), equation,
        steps=2, heat_kj_mol=heat_kj_mol, rate_per_s=1e3,
    )  # fmt: skip
    assert joule == pytest.approx(-1e3 * heat_kj_mol * moles, rel=0.02)


def test_ammonium_dissolves_not_all_magnesium_so_heat_is_less():
    """100 mL of ammonium, 40 mmol, are poured on 2 mmol of magnesium; 362 kJ/mol are declared.

    Ammonium gives up only the protons that it loses by pH 7: not all of the metal dissolves.
    """
    moles, heat_kj_mol = 0.002, -362.0
    joule, _coldest_c, _warmest_c = heat_of_pouring(
        {"volume_ml": 100.0, "solutes": {"NH4Cl": 0.4}}, solid_in_b("Mg", moles), "Mg + 2 NH4Cl -> MgCl2 + 2 NH3 + H2",
        steps=2, heat_kj_mol=heat_kj_mol, rate_per_s=1e3,
    )  # fmt: skip
    assert abs(joule) < -1e3 * heat_kj_mol * moles


@pytest.mark.parametrize("solid", ["C12H22O11", "KAl(SO4)2.12H2O", "K2CO3", "NiSO4.6H2O", "C6H8O7"])
def test_scene_is_accepted_after_following_advice_on_missing_heat(solid):
    """A solid lies in a glass, and no table has its heat of solution: the scene's fault proposes an equation.

    With that equation the fault is that its heat is missing; with any heat there is none.
    """
    properties = {"solid": {"formula": solid, "mass_g": 2.0, "solubility_g_100g": 50.0}}
    bodies = (glass("a", volume_ml=60.0), glass("b", volume_ml=0.0, properties=properties))
    poses = {"a": poses_at_rest(count=2), "b": poses_at_rest(count=2)}

    def faults(*effects):
        return plan_faults(session_with_effects(poses, bodies, ("mixing", {"in": ["a", "b"]}), HEAT, *effects).scene)

    (fault,) = faults()
    equation = re.search(r'equation = "(.+?)"', fault)[1]
    (without,) = faults(("reaction", {"equation": equation}))
    assert "heat_kj_mol is missing" in without
    assert not faults(("reaction", {"equation": equation, "heat_kj_mol": 10.0}))


def test_solids_of_unknown_solubility_are_refused():
    """A solid lies in glass b; a scene mixes what is in a, water, and b. No table has its solubility: a fault.

    Otherwise it would lie in water undissolved, as sand does, and no event would say so.
    """
    for solid in ["Na3PO4.12H2O", "C6H12O6", "I2", "K2S2O8"]:
        bodies = (
            glass("a", volume_ml=60.0),
            glass("b", volume_ml=0.0, properties={"solid": {"formula": solid, "mass_g": 2.0}}),
            glass("c", volume_ml=10.0, solute="HCl", molar=0.1),
            glass("d", volume_ml=10.0, solute="NaOH", molar=0.1),
        )
        effects = (("mixing", {"in": ["a", "b"]}), HEAT, ("reaction", {"equation": "HCl + NaOH -> NaCl + H2O"}))
        poses = {name: poses_at_rest(count=2) for name in "abcd"}
        faults = plan_faults(session_with_effects(poses, bodies, *effects).scene)
        assert any(f"body 'b': nothing says how much {solid!r} dissolves" in fault for fault in faults), solid
