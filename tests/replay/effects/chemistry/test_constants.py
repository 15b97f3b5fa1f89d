"""Constants of the chemistry against data bases that were made without them."""

import math
import re
import tomllib
from pathlib import Path

import phreeqc
import pytest
from support.processes import script

from replay.effects.chemistry import enthalpy
from replay.effects.chemistry.formulas import atoms, charge_of, molar_mass
from replay.effects.chemistry.salts import SOLUBILITY

SOURCES = script("constant_sources")
TOML = Path(enthalpy.__file__).with_name("constants.toml").read_text("utf-8")
REACTIONS = tomllib.loads(Path(__file__).with_name("free_energies.toml").read_text("utf-8"))["reactions"]
FORMATION = SOURCES.enthalpies()
EQUATIONS = list(SOURCES.entries())
WRONG_SIGN = ("minteq.v4",)
"""Its enthalpies of the ammines of silver; constants.phr says so."""

BOOKLET = {"NaOH(s)": -425.8, "KOH(s)": -424.6, "NH4Cl(s)": -314.4, "NH4NO3(s)": -365.6, "KClO3(s)": -397.7}
"""kJ/mol. Source: Alberta Education, Chemistry 30 Data Booklet, 2010, pages 4 and 5."""

KNO3 = {0: 13.3, 10: 20.9, 20: 31.6, 30: 45.8, 40: 63.9, 60: 110, 80: 169, 100: 246}
"""g in 100 g of water, as five public copies of the table have it."""


def comments(section):
    """Key -> comment of each line of a section of constants.toml."""
    text = TOML.partition(f"\n[{section}]\n")[2].partition("\n[")[0]
    return dict(re.findall(r'^"([^"]+)" = .*? # (.+)$', text, flags=re.MULTILINE))


@pytest.mark.parametrize(
    ("equation", "value", "heat", "source", "reaction"), EQUATIONS, ids=[row[0] for row in EQUATIONS]
)
def test_an_equilibrium_constant_is_that_of_its_source(equation, value, heat, source, reaction):
    assert source in (*SOURCES.FILES, "unverified") and reaction
    if source not in SOURCES.FILES:
        return
    assert SOURCES.log_k(source, reaction) == pytest.approx(value, abs=0.06)
    reference = SOURCES.kilojoule(source, reaction)
    ammonium = 52.0 * reaction.count("NH4+ =") * int((re.search(r"(\d) NH4", reaction) or [0, 1])[1])
    # A source that gives no enthalpy of its own leaves 0, or that of NH4+ alone.
    if heat is not None and source not in WRONG_SIGN and abs(reference - ammonium) > 1.0 and abs(reference) > 1.0:
        assert heat == pytest.approx(reference, abs=1.0)


def test_most_equilibrium_constants_have_a_source_at_hand():
    unverified = [row[0] for row in EQUATIONS if row[3] == "unverified"]
    assert len(EQUATIONS) >= 45 and len(unverified) <= 20


@pytest.mark.parametrize(
    ("equation", "reaction"),
    [
        ("Zn+2 + NH4+ = ZnNH3+2 + H+", "Zn+2 + NH4+ = Zn(NH3)+2 + H+"),
        ("Zn+2 + 4 NH4+ = Zn(NH3)4+2 + 4 H+", "Zn+2 + 4 NH4+ = Zn(NH3)4+2 + 4 H+"),
    ],
)
def test_unverified_ammines_of_zinc_are_near_those_of_llnl(equation, reaction):
    value = next(row[1] for row in EQUATIONS if row[0] == equation)
    assert value == pytest.approx(SOURCES.log_k("llnl", reaction), abs=0.7)


@pytest.mark.parametrize("column", enthalpy.ENTHALPY)
def test_an_enthalpy_of_formation_is_that_of_its_source(column):
    value, note = enthalpy.ENTHALPY[column], comments("enthalpy")[column]
    phase = column.endswith(("(s)", "(g)"))
    formula = column[:-3] if phase else column
    reference = FORMATION.get((phase, tuple(sorted(atoms(formula).items())), charge_of(formula)), {})
    if note == "element":
        assert value == 0.0
    elif note == "Alberta":
        assert value == pytest.approx(BOOKLET[column], abs=0.5)
    elif note == "unverified":
        assert not reference
    else:
        source, _, other = note.partition(" has ")
        nearest = min(reference[source], key=lambda entry: abs(entry - value))
        assert nearest == pytest.approx(float(other) if other else value, abs=0.1 if other else 1.5)
        assert not other or abs(float(other) - value) < 8.0


@pytest.mark.parametrize("row", REACTIONS, ids=lambda row: row[3])
def test_a_free_energy_agrees_with_a_data_base(row):
    source, elements, reaction, value = row
    terms = [(float(many), name) for many, name in (term.split(" ") for term in reaction.split(" + "))]
    kilojoule_mol = sum(
        float(many) * enthalpy.FREE_ENERGY[name] for many, name in (term.split(" ") for term in value.split(" + "))
    )
    ten = 1e-3 * SOURCES.GAS_CONSTANT * 298.15 * math.log(10.0)
    electrons, protons = (sum(many for many, name in terms if name == symbol) for symbol in ("e-", "H+"))
    pe = max(-9.0, min(18.0, (kilojoule_mol / ten - 7.0 * protons) / electrons)) if electrons else 4.0
    assert -ten * SOURCES.quotient(source, elements.split(), terms, pe=pe) == pytest.approx(kilojoule_mol, abs=5.0)


def test_free_energies_called_checked_are_in_a_reaction():
    noted = comments("free_energy")
    assert set(noted) == set(enthalpy.FREE_ENERGY)
    used = {term.split(" ")[1] for row in REACTIONS for term in row[3].split(" + ")}
    assert {key for key, note in noted.items() if note == "checked"} <= used
    assert all(enthalpy.FREE_ENERGY[key] == 0.0 for key, note in noted.items() if note == "element")
    assert set(noted.values()) == {"checked", "element", "unverified"}


@pytest.mark.parametrize(
    ("formula", "phases", "element", "celsius"),
    [
        ("NaCl", "Halite", "Na", 25.0), ("NaCl", "Halite", "Na", 60.0), ("KCl", "Sylvite", "K", 25.0),
        ("KCl", "Sylvite", "K", 60.0), ("NaHCO3", "Nahcolite", "Na", 25.0),
        ("Na2SO4", "Mirabilite Thenardite", "Na", 40.0),
    ],
)  # fmt: skip
def test_a_solubility_is_that_of_pitzers_equations(formula, phases, element, celsius):
    library = phreeqc.Phreeqc()
    library.LoadDatabase(str(Path(phreeqc.__file__).parent / "databases" / "pitzer.dat"))
    solids = "".join(f" {phase} 0 0\n" for phase in phases.split())
    output = f"SELECTED_OUTPUT\n -reset false\n -high_precision true\n -totals {element}\n"
    added = f"INCREMENTAL_REACTIONS true\nREACTION 1\n {formula} 1\n 12 moles in 60 steps\n"
    text = f"{output}SOLUTION 1\n temp {celsius}\nEQUILIBRIUM_PHASES 1\n{solids}{added}END\n"
    assert not library.RunString(text)
    molal = library.GetSelectedOutput()[f"{element}(mol/kgw)"][-1] / atoms(formula)[element]
    table = SOLUBILITY[formula]
    below, above = (
        pick(entry for entry in table if sign * entry >= sign * celsius) for pick, sign in ((max, -1), (min, 1))
    )
    fraction = 0.0 if above == below else (celsius - below) / (above - below)
    grams = table[below] + fraction * (table[above] - table[below])
    assert molal * molar_mass(formula) / 10.0 == pytest.approx(grams, rel=0.04)


def test_the_solubility_of_nitre_is_that_of_public_copies():
    assert SOLUBILITY["KNO3"] == KNO3 and comments("solubility")["KNO3"] == "copies"
    assert set(comments("solubility")) == set(SOLUBILITY)
