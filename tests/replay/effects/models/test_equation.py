import pytest

from replay.effects.models.equation import atoms, equation_of
from replay.effects.models.species import IONS, Chemistry


@pytest.mark.parametrize(
    ("formula", "counts"),
    [("NaCl", {"Na": 1, "Cl": 1}), ("Ca(OH)2", {"Ca": 1, "O": 2, "H": 2}),
     ("CuSO4.5H2O", {"Cu": 1, "S": 1, "O": 9, "H": 10}), ("Al2(SO4)3", {"Al": 2, "S": 3, "O": 12})],
)  # fmt: skip
def test_atoms_are_counted(formula, counts):
    assert dict(atoms(formula)) == counts


@pytest.mark.parametrize("formula", ["", "nacl", "Na(", "Na)", "()"])
def test_what_is_no_formula_is_refused(formula):
    with pytest.raises(ValueError, match="formula"):
        atoms(formula)


@pytest.mark.parametrize(
    ("text", "reagents", "phases"),
    [("Ag+ + Cl- -> AgCl(s)", {"Ag+": 1, "Cl-": 1}, {"AgCl": "s"}),
     ("Cu2+ + 2 OH- \u2192 Cu(OH)2\u2193", {"Cu^2+": 1, "OH-": 2}, {"Cu(OH)2": "s"}),
     ("Zn + 2 HCl -> ZnCl2 + H2", {"Zn": 1, "HCl": 2}, {}),
     ("SO42- + Ba2+ => BaSO4(s)", {"SO4^2-": 1, "Ba^2+": 1}, {"BaSO4": "s"}),
     ("NH4+ + OH- \u21cc NH3 + H2O", {"NH4+": 1, "OH-": 1}, {}),
     ("Zn + 2 H\u207a --> Zn\u00b2\u207a + H\u2082\u2191", {"Zn": 1, "H+": 2}, {"H2": "g"})],
)  # fmt: skip
def test_ions_arrows_and_phases_are_read(text, reagents, phases):
    equation = equation_of(text, IONS)
    assert equation.reagents == reagents and equation.phases == phases


@pytest.mark.parametrize("formula", ["H2Cl", "ZnHCl", "NaCl2", "C4H8O2"])
def test_what_no_ions_make_stays_whole(formula):
    assert Chemistry().parts(formula) is None


def test_water_of_crystals_stands_beside_the_ions():
    assert Chemistry().parts("CuSO4.5H2O") == {"Cu^2+": 1, "SO4^2-": 1, "H2O": 5}


@pytest.mark.parametrize(("base", "part"), [("C5H5N", "C5H5N"), ("CH3COONa", "CH3COO-"), ("NaOH", "NaOH")])
def test_a_base_of_a_scene_takes_protons_as_its_anion_or_itself(base, part):
    chemistry = Chemistry(bases={base: 5.25})
    assert chemistry.pka[part] == (5.25,) and chemistry.is_base(base)


def test_only_the_atoms_that_are_not_balanced_are_named_with_their_counts():
    for text, named in (("H2 + O2 -> H2O", "O 2 and 1"), ("Cu2+ + Zn -> Cu + Zn", "charge 2 and 0")):
        with pytest.raises(ValueError, match=f"balanced: {named};"):
            equation_of(text)


def test_what_stands_on_both_sides_changes_by_the_difference():
    changes = equation_of("3 H2O2 + MnO2 -> 2 H2O + O2 + H2O2 + MnO2").changes
    assert changes == {"H2O2": -2, "MnO2": 0, "H2O": 2, "O2": 1}
