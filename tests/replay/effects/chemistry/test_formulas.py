"""Formulas and equations as people write them (`replay.effects.chemistry.formulas`)."""

import pytest

from replay.effects.chemistry.components import components_of
from replay.effects.chemistry.formulas import atoms, crystal_water, equation_of, ion_of


def is_in_the_tables(formula):
    """Whether the tables of the product know what a formula dissolves into."""
    return components_of(formula) is not None


def refusal(read, text):
    """The sentence with which a text is refused, "" where it is read."""
    try:
        read(text)
    except ValueError as error:
        return str(error)
    return ""


def test_atoms_are_counted():
    """A number behind brackets counts for all within, as in (OH)2; 5H2O behind a dot are five molecules of water."""
    for formula, counts in [
        ("NaCl", {"Na": 1, "Cl": 1}),
        ("Ca(OH)2", {"Ca": 1, "O": 2, "H": 2}),
        ("CuSO4.5H2O", {"Cu": 1, "S": 1, "O": 9, "H": 10}),
        ("Al2(SO4)3", {"Al": 2, "S": 3, "O": 12}),
    ]:
        assert dict(atoms(formula)) == counts, formula


def test_text_that_is_no_chemical_formula_is_refused():
    """The texts: nothing, lower case, and brackets that do not close, do not open, or are empty."""
    for formula in ["", "nacl", "Na(", "Na)", "()"]:
        assert "formula" in refusal(atoms, formula), formula


def test_half_equations_ask_for_their_other_half():
    """An equation with free electrons, e-, is refused; ``advice`` is part of the error."""
    advice = "is half an equation; add the half that gives or takes its electrons"
    for text in ["MnO4- + 8 H+ + 5 e- -> Mn2+ + 4 H2O", "Zn -> Zn2+ + 2e-", "Fe3+ + e- -> Fe2+", "Ag+ + e⁻ → Ag"]:
        assert advice in refusal(equation_of, text), text


def test_equation_is_read_with_any_arrow_phase_or_superscript():
    """``reagents``: formula -> coefficient, a charge as in SO4^2-.

    ``phases``: formula -> "s", a solid, for (s) or an arrow down, or "g", a gas, for an arrow up.
    """
    for text, reagents, phases in [
        ("Zn + 2 HCl -> ZnCl2 + H2", {"Zn": 1, "HCl": 2}, {}),
        ("Ag+ + Cl- -> AgCl(s)", {"Ag+": 1, "Cl-": 1}, {"AgCl": "s"}),
        ("Cu2+ + 2 OH- → Cu(OH)2↓", {"Cu^2+": 1, "OH-": 2}, {"Cu(OH)2": "s"}),
        ("SO4^2- + Ba^2+ => BaSO4(s)", {"SO4^2-": 1, "Ba^2+": 1}, {"BaSO4": "s"}),
        ("NH4+ + OH- ⇌ NH3 + H2O", {"NH4+": 1, "OH-": 1}, {}),
        ("Zn + 2 H⁺ --> Zn²⁺ + H₂↑", {"Zn": 1, "H+": 2}, {"H2": "g"}),
    ]:
        equation = equation_of(text, is_in_the_tables)
        assert equation.reagents == reagents and equation.phases == phases, text


READINGS = [
    ("SO42- + Ba2+ => BaSO4(s)", {"SO4^2-": 1, "Ba^2+": 1}, {"BaSO4": "s"}),
    ("IO3- + 5 I- + 6 H+ -> 3 I2 + 3 H2O", {"IO3-": 1, "I-": 5, "H+": 6}, {}),
    ("AgCl + 2 NH3 -> Ag(NH3)2+ + Cl-", {"AgCl": 1, "NH3": 2}, {}),
    ("Al3+ + 4 OH- -> Al(OH)4-", {"Al^3+": 1, "OH-": 4}, {}),
    ("PbI4 2- -> Pb2+ + 4 I-", {"PbI4^2-": 1}, {}),
    ("Hg2 2+ + 2 Cl- -> Hg2Cl2", {"Hg2^2+": 1, "Cl-": 2}, {}),
    ("C6H5O7^3- + 3 H+ -> C6H8O7", {"C6H5O7^3-": 1, "H+": 3}, {}),
    ("2MnO4- + 5C2O42- + 16H+ -> 2Mn2+ + 10CO2 + 8H2O", {"MnO4-": 2, "C2O4^2-": 5, "H+": 16}, {}),
    ("Cr2O72- + 6 Fe2+ + 14 H+ -> 2 Cr3+ + 6 Fe3+ + 7 H2O", {"Cr2O7^2-": 1, "Fe^2+": 6, "H+": 14}, {}),
    ("Cu(NH3)42+ -> Cu2+ + 4NH3", {"Cu(NH3)4^2+": 1}, {}),
    ("CuSO4 · 5 H2O(s) -> Cu2+ + SO42- + 5 H2O", {"CuSO4.5H2O": 1}, {"CuSO4.5H2O": "s"}),
    ("HPO42- + H+ -> H2PO4-", {"HPO4^2-": 1, "H+": 1}, {}),
    ("ClO3- + 6 H+ + 5 Cl- -> 3 Cl2 + 3 H2O", {"ClO3-": 1, "H+": 6, "Cl-": 5}, {}),
    ("[Ag(NH3)2]+ + Cl- + 2 H+ -> AgCl(s) + 2 NH4+", {"Ag(NH3)2+": 1, "Cl-": 1, "H+": 2}, {"AgCl": "s"}),
]


def test_of_several_readings_the_balanced_is_taken():
    """Without a caret SO42- may be SO4 with 2- or SO42 with -: that is meant whose atoms and charges balance.

    Where several do, those are meant whose formulas are in the tables. ``reagents``: formula -> coefficient;
    ``phases``: formula -> "s", solid, where the text says so.
    """
    for text, reagents, phases in READINGS:
        equation = equation_of(text, is_in_the_tables)
        assert equation.reagents == reagents and equation.phases == phases, text


def test_edta_by_its_abbreviation_is_refused_with_its_formula():
    """Textbooks write EDTA or Y for its ion, C10H12N2O8^4-; without its atoms no equation can be balanced."""
    for text in ["Ca2+ + EDTA4- -> CaEDTA2-", "Mg2+ + H2Y2- -> MgY2- + 2 H+", "Ca2+ + Y4- -> CaY^2-"]:
        assert "write EDTA as C10H12N2O8^4-, as in" in refusal(equation_of, text), text


def test_two_balanced_readings_are_refused_with_a_remedy():
    """Xe22+ may be Xe2 with 2+ or Xe22 with +, on both sides."""
    with pytest.raises(ValueError, match=r"read in \d ways; write charges with \^"):
        equation_of("Xe22+ -> Xe22+")


def test_of_two_balanced_readings_the_known_is_taken():
    """Xe22+ is Xe2 with 2+ or Xe22 with +; the tables know ``reading`` alone, not even H2O: a molecule need not be."""
    for reading in ["Xe2^2+", "Xe22+"]:
        equation = equation_of("Xe22+ + H2O -> Xe22+ + H2O", {reading}.__contains__)
        assert equation.reagents == {reading: 1, "H2O": 1}, reading


def test_solid_that_only_stands_on_the_left_dissolves():
    """``dissolved``: formulas that are solid, (s), on the left of an equation and not on its right."""
    for text, dissolved in [
        ("NaCl(s) -> NaCl", {"NaCl"}),
        ("NaCl(s) -> NaCl(s)", set()),
        ("NaCl -> NaCl(s)", set()),
        ("NaCl -> NaCl", set()),
    ]:
        assert set(equation_of(text).dissolved) == dissolved, text


def test_crystal_water_is_counted_behind_the_dot():
    """``count``: molecules of water in a unit of the formula."""
    for formula, count in [("CuSO4.5H2O", 5), ("Na2CO3.H2O", 1), ("NaCl", 0)]:
        assert crystal_water(formula) == count, formula


IONS = [
    ("Cu2+", "Cu^2+"), ("SO42-", "SO4^2-"), ("NH4+", "NH4+"), ("IO3-", "IO3-"), ("Fe3+", "Fe^3+"), ("MnO4-", "MnO4-"),
    ("Cr2O72-", "Cr2O7^2-"), ("PO43-", "PO4^3-"), ("Ag(NH3)2+", "Ag(NH3)2+"), ("HCO3-", "HCO3-"),
    ("[Cu(NH3)4]2+", "Cu(NH3)4^2+"), ("[Fe(CN)6] 3-", "Fe(CN)6^3-"), ("[Al(OH)4]-", "Al(OH)4-"),
]  # fmt: skip


def test_an_ion_alone_is_read_as_known():
    """``written``: an ion, such as SO42-; ``read``: the same with a charge above 1 behind a caret, SO4^2-.

    Square brackets of a complex are left out.
    """
    for written, read in IONS:
        assert ion_of(written, is_in_the_tables) == read, written


MOLECULES_AND_METALS = [
    "H2Cl", "ZnHCl", "NaCl2", "C4H8O2", "C6H12O6", "C3H8O3", "CO(NH2)2", "H2O2", "MnO2", "Na2O2", "NO2", "Zn",
]  # fmt: skip


def test_molecules_and_metals_are_not_split_into_ions():
    """Components are the ions that a formula dissolves into: molecules and metals have none (``None``).

    Nor have formulas whose charges do not add up, such as NaCl2.
    """
    for formula in MOLECULES_AND_METALS:
        assert components_of(formula) is None, formula


SALTS = [
    ("CuSO4.5H2O", {"Cu^2+": 1, "SO4^2-": 1, "H2O": 5}), ("NaOH", {"Na+": 1, "H+": -1, "H2O": 1}),
    ("NH4NO3", {"NH3": 1, "NO3-": 1, "H+": 1}), ("KHC8H4O4", {"K+": 1, "C8H4O4^2-": 1, "H+": 1}),
    ("(NH4)2Fe(SO4)2.6H2O", {"Fe^2+": 1, "NH3": 2, "SO4^2-": 2, "H+": 2, "H2O": 6}),
    ("KAl(SO4)2.12H2O", {"K+": 1, "Al^3+": 1, "SO4^2-": 2, "H2O": 12}),
    ("Na2B4O7.10H2O", {"Na+": 2, "H3BO3": 4, "H+": -2, "H2O": 5}), ("Na2S2O3", {"Na+": 2, "S2O3^2-": 1}),
    ("Fe3O4", {"Fe^2+": 1, "Fe^3+": 2, "H+": -8, "H2O": 4}), ("K2Cr2O7", {"K+": 2, "CrO4^2-": 2, "H+": 2, "H2O": -1}),
    ("Cu2(OH)3Cl", {"Cu^2+": 2, "Cl-": 1, "H+": -3, "H2O": 3}), ("Ca(ClO)2", {"Ca^2+": 1, "ClO-": 2}),
]  # fmt: skip


def test_salts_are_counted_by_their_ions_and_oxidation_states():
    """``components``: ions and molecules that the formula is made of, with their counts.

    Hydroxide is counted as water less a proton, ammonium as ammonia and a proton.
    """
    for formula, components in SALTS:
        assert components_of(formula) == components, formula


def test_only_unbalanced_atoms_are_named_with_their_counts():
    """Left and right have 2 and 1 O, and a charge of 2 and 0; hydrogen and the metals are balanced, and not named."""
    with pytest.raises(ValueError, match="balanced: O 2 and 1;"):
        equation_of("H2 + O2 -> H2O")
    with pytest.raises(ValueError, match="balanced: charge 2 and 0;"):
        equation_of("Cu2+ + Zn -> Cu + Zn")


def test_species_on_both_sides_changes_by_the_difference():
    """1 H2O2 - 3 H2O2 = -2; the catalyst MnO2 does not change."""
    changes = equation_of("3 H2O2 + MnO2 -> 2 H2O + O2 + H2O2 + MnO2").changes
    assert changes == {"H2O2": -2, "MnO2": 0, "H2O": 2, "O2": 1}


def test_unbalanced_equation_is_refused_with_atoms_of_both_sides():
    """``counted``: part of the error, each atom or charge whose numbers on the left and on the right differ."""
    for text, counted in [
        ("NH3 + H2O -> NH4+", "H 5 and 4, O 1 and 0, charge 0 and 1"),
        ("Cu2+ + 2 NH3 -> Cu(OH)2 + 2 NH4+", "H 6 and 10, O 0 and 2"),
        ("MnO4- + 5 Fe2+ + 8 H+ -> Mn2+ + 5 Fe3+ + 3 H2O", "H 8 and 6, O 4 and 3"),
    ]:
        assert f"is not balanced: {counted}; correct" in refusal(equation_of, text), text


@pytest.mark.sampled(7)
@pytest.mark.parametrize(
    "formula", ["C4H11NO3", "C4H12NO3Cl", "C6H14N2O2", "C6H12N4", "Ca(C3H5O3)2", "NaC3H5O3", "C8H18N2O4S"]
)
def test_molecules_are_not_read_as_salts_of_equal_composition(formula):
    """TRIS, C4H11NO3, has the atoms of trimethylammonium hydrogencarbonate, which it is not: it has no ions (None)."""
    assert components_of(formula) is None


def test_salts_of_bases_and_anhydrides_are_read():
    """Salts of methylamine, other amines and ammonia, and formulas that become ions with water: all have components."""
    for formula in ["CH3NH3Cl", "C4H12NBr", "C2H10N2Cl2", "CH3COONH4", "Na2S2O5", "P4O10", "K2Cr2O7"]:
        assert components_of(formula) is not None, formula


def test_crystal_water_is_read_behind_every_dot():
    """Dots and asterisks that people and other programs write are read as a full stop."""
    for dot in ["·", "•", "⋅", "∙", "*", " . "]:
        equation = equation_of(f"CuSO4{dot}5H2O -> CuSO4 + 5 H2O", lambda _: True)
        assert dict(equation.reagents) == {"CuSO4.5H2O": 1}, dot
