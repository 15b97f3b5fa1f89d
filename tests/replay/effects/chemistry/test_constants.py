"""Constants of the chemistry against data bases that were made without them."""

import math
import re
import tomllib
from functools import cache
from pathlib import Path

import pytest
from support.processes import script

from replay.effects.chemistry import enthalpy
from replay.effects.chemistry.formulas import atoms, charge_of
from replay.effects.chemistry.salts import SOLUBILITY_G_PER_100_G

SOURCES, TABLES = script("constant_sources"), script("constant_tables")
TOML = Path(enthalpy.__file__).with_name("constants.toml").read_text("utf-8")
REACTIONS = tomllib.loads(Path(__file__).with_name("free_energies.toml").read_text("utf-8"))["reactions"]
EQUATIONS = list(SOURCES.entries())
"""Rows of constants.phr: (equation, log_k, kJ/mol or none, source, the reaction that the source has)."""

WRONG_SIGN = ("minteq.v4",)
"""Its enthalpies of the ammines of silver, nickel and cobalt; constants.phr says so."""

NIST_46 = {
    172294: (3.03, -4.6), 172308: (4.6, None), 172262: (2.33, -12.6), 172270: (3.65, None), 172224: (1.72, -6.7),
    172337: (4.8, None), 172343: (8.23, None), 172353: (-11.97, 94.6),
}  # fmt: skip
"""Row of the table verkn_ligand_metal of NIST SRD 46 -> log_k and kJ/mol at 25 degC and ionic strength 0."""

AMMINES = {"Ni": (2.72, 2.17, 1.66, 1.12, 0.67, -0.03), "Zn": (2.21, 2.29, 2.36, 2.03)}
"""log K of each NH3. Source: D. Harvey, Analytical Chemistry 2.1, appendix 12, by Martell and Smith, 1976."""

STRUVITE = -13.26
"""M. Ronteltap, M. Maurer and W. Gujer, Water Research 41, 2007: -13.26 within 0.06 at 25 degC."""

PKA_AMMONIUM = 9.244
"""By which an ammine of NH4+ is counted from one of NH3. Source: minteq.v4.dat."""

BOOKLET = {"NaOH(s)": -425.8, "KOH(s)": -424.6, "NH4Cl(s)": -314.4, "NH4NO3(s)": -365.6, "KClO3(s)": -397.7}
"""kJ/mol. Source: Alberta Education, Chemistry 30 Data Booklet, 2010, pages 4 and 5."""

KNO3 = {0: 13.3, 10: 20.9, 20: 31.6, 30: 45.8, 40: 63.9, 60: 110, 80: 169, 100: 246}
"""g in 100 g of water, as five public copies of the table have it."""


@cache
def comments(section):
    """Key -> comment of each line of a section of constants.toml."""
    text = TOML.partition(f"\n[{section}]\n")[2].partition("\n[")[0]
    return dict(re.findall(r'^"([^"]+)" = .*? # (.+)$', text, flags=re.MULTILINE))


def test_equilibrium_constants_are_those_of_their_sources():
    """A row of the product's constants.phr: equation, log_k, kJ/mol, its source, and the reaction there.

    ``SOURCES.FILES`` are data bases that are read: log_k agrees to 0.06, the heat to 1 kJ/mol. Values of other sources
    stand at the top of this file or in the row; "buffers", "solubility" and "unverified" are not compared here.
    """
    others = ("nist46", "smith-martell", "harvey", "eawag", "buffers", "solubility", "unverified")
    for equation, value, heat, source, reaction in EQUATIONS:
        assert source in (*SOURCES.FILES, *others) and reaction, equation
        if source == "nist46":
            assert (value, heat) == NIST_46[int(reaction.split()[1].rstrip(","))], equation
        # Books count an ammine from NH3, rows from NH4+: each NH3 of it costs the pKa of ammonium, 9.244, in log_k.
        if source == "harvey":
            metal, number = equation[:2], int(re.search(r"(\d) NH4", equation)[1])
            assert value + PKA_AMMONIUM * number == pytest.approx(sum(AMMINES[metal][:number]), abs=0.006), equation
        if source == "eawag":
            assert value == STRUVITE, equation
        if source == "smith-martell":
            number = int((re.search(r"(\d) NH4", equation) or [0, 1])[1]) if "NH4+" in equation else 0
            log_k = float(reaction.split(" has ")[1].split()[0])
            assert value + PKA_AMMONIUM * number == pytest.approx(log_k, abs=0.1), equation
        if source not in SOURCES.FILES:
            continue
        assert SOURCES.log_k(source, reaction) == pytest.approx(value, abs=0.06), equation
        if heat is None or source in WRONG_SIGN:
            continue
        reference = SOURCES.kilojoule(source, reaction)
        # NH4+ -> NH3 + H+ takes 52 kJ/mol.
        ammonium = 52.0 * reaction.count("NH4+ =") * int((re.search(r"(\d) NH4", reaction) or [0, 1])[1])
        # A source that gives no enthalpy of its own leaves 0, or that of NH4+ alone.
        if abs(reference - ammonium) > 1.0 and abs(reference) > 1.0:
            assert heat == pytest.approx(reference, abs=1.0), equation


def test_a_course_by_temperature_is_that_of_its_source():
    """A course: the coefficients of log_k by temperature that nine or more constants have; each source has the same."""
    courses = list(SOURCES.courses())
    assert len(courses) >= 9
    for _phase, log_k, coefficients, source, phase_of_source in courses:
        assert SOURCES.course(source, phase_of_source, log_k) == pytest.approx(coefficients, rel=1e-5)


def test_most_equilibrium_constants_have_a_source_at_hand():
    """There are 50 equations or more, and at most two are "unverified": no source that the tests can read has them."""
    unverified = [equation for equation, _log_k, _heat, source, _reaction in EQUATIONS if source == "unverified"]
    assert len(EQUATIONS) >= 50 and len(unverified) <= 2


def test_unverified_ammines_of_zinc_are_near_those_of_llnl():
    """Two constants without a source at hand differ by at most 0.7 in log K from those of PHREEQC's data base llnl.

    ``reaction``: the same equation as llnl writes it.
    """
    own_log_k = {own_equation: log_k for own_equation, log_k, *_ in EQUATIONS}
    for equation, reaction in [
        ("Zn+2 + NH4+ = ZnNH3+2 + H+", "Zn+2 + NH4+ = Zn(NH3)+2 + H+"),
        ("Zn+2 + 4 NH4+ = Zn(NH3)4+2 + 4 H+", "Zn+2 + 4 NH4+ = Zn(NH3)4+2 + 4 H+"),
    ]:
        assert own_log_k[equation] == pytest.approx(SOURCES.log_k("llnl", reaction), abs=0.7), equation


def test_enthalpies_of_formation_are_those_of_their_sources():
    """A comment in the product's constants.toml names the source of each enthalpy, in kJ/mol.

    Sources have enthalpies by phase, atoms and charge; each agrees within 1.5 kJ/mol, or the comment states what the
    source has, by less than 8 kJ/mol another. Elements have 0, and "unverified" ones are in no source.
    """
    columns = enthalpy.ENTHALPY_KJ_MOL
    formation = SOURCES.enthalpies(re.sub(r"\([sg]\)$", "", column) for column in columns)
    for column, value in columns.items():
        note, phase = comments("enthalpy")[column], column.endswith(("(s)", "(g)"))
        formula = column[:-3] if phase else column
        reference = formation.get((phase, tuple(sorted(atoms(formula).items())), charge_of(formula)), {})
        if note == "element":
            assert value == 0.0, column
        elif note == "Alberta":
            assert value == pytest.approx(BOOKLET[column], abs=0.5), column
        elif note == "unverified":
            assert not reference, column
        else:
            source, _, other = note.partition(" has ")
            _, nearest = min((abs(entry - value), entry) for entry in reference[source])
            assert nearest == pytest.approx(float(other or value), abs=0.1 if other else 1.5), column
            assert not other or abs(float(other) - value) < 8.0, column


def test_free_energies_agree_with_data_bases():
    """Reactions of free_energies.toml, by the product's free energies of formation and by data bases of PHREEQC.

    The free energy is -RT ln 10 log K; electrons and protons count by pe and a pH of 7. They agree within 5 kJ/mol.
    """
    ten = 1e-3 * SOURCES.GAS_CONSTANT * 298.15 * math.log(10.0)
    for source, elements, reaction, value in REACTIONS:
        terms = [(float(many), name) for many, name in (term.split(" ") for term in reaction.split(" + "))]
        kilojoule_mol = sum(
            float(many) * enthalpy.FREE_ENERGY_KJ_MOL[name]
            for many, name in (term.split(" ") for term in value.split(" + "))
        )
        electrons, protons = (sum(many for many, name in terms if name == symbol) for symbol in ("e-", "H+"))
        # A pe at which about as much of either side is there; the quotient is the same at any.
        pe = max(-9.0, min(18.0, (kilojoule_mol / ten - 7.0 * protons) / electrons)) if electrons else 4.0
        quotient = SOURCES.quotient(source, elements.split(), terms, pe=pe)
        assert -ten * quotient == pytest.approx(kilojoule_mol, abs=5.0), value


def test_free_energies_called_checked_are_in_a_reaction():
    """Each free energy in constants.toml has a comment: "checked", "element" (0) or "unverified".

    What is called checked is in a reaction of free_energies.toml, whose values are compared with PHREEQC.
    """
    noted = comments("free_energy")
    assert set(noted) == set(enthalpy.FREE_ENERGY_KJ_MOL)
    used = {term.split(" ")[1] for row in REACTIONS for term in row[3].split(" + ")}
    assert {key for key, note in noted.items() if note == "checked"} <= used
    assert all(enthalpy.FREE_ENERGY_KJ_MOL[key] == 0.0 for key, note in noted.items() if note == "element")
    assert set(noted.values()) == {"checked", "element", "unverified"}


def test_typed_tables_are_printed_again_by_their_command():
    """The script .ci/constant_tables computes values of six tables: each that is typed in the product agrees with it.

    There are at least 150 of them; rows without a source here are left out.
    """
    rows = [
        (table, key, entry, typed, computed)
        for table, key, entry, typed, _source, computed in TABLES.rows()
        if computed is not None
    ]
    assert {table for table, *_ in rows} == {
        "solubility", "strongest", "strong_water", "volume", "dissolved", "dilution",
    }  # fmt: skip
    assert len(rows) >= 150
    for table, key, entry, typed, computed in rows:
        assert TABLES.agrees(table, typed, computed), (table, key, entry)


def test_the_solubility_of_nitre_is_that_of_public_copies():
    """KNO3: g in 100 g of water by degC, as public copies of a handbook's table have them."""
    assert SOLUBILITY_G_PER_100_G["KNO3"] == KNO3
    assert comments("solubility")["KNO3"] == "copies, CRC"


def test_every_solubility_has_a_comment_with_its_source():
    """The comment stands behind the salt's row in constants.toml."""
    assert set(comments("solubility")) == set(SOLUBILITY_G_PER_100_G)


def test_solubilities_annotated_crc_are_those_of_the_handbook():
    """Salts whose row in constants.toml names CRC are those of which a script has the handbook's saturated solution."""
    annotated = {salt for salt, comment in comments("solubility").items() if "CRC" in comment}
    assert annotated == set(TABLES.PARAMETERS["saturated"])


def test_other_solubilities_are_of_public_copies_but_phthalate():
    """Comments behind the rows of constants.toml: only the row of KHC8H4O4 is "unverified".

    Salts of which a script has public copies of a table say so.
    """
    noted = comments("solubility")
    assert {salt for salt, comment in noted.items() if comment == "unverified"} == {"KHC8H4O4"}
    assert all(noted[salt].startswith("copies") for salt in TABLES.PARAMETERS["copies"])
