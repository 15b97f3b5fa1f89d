"""Activities of strong solutions: pH and complexes at 0.1 to 3 mol/kg against other data bases of PHREEQC."""

from functools import cache
from pathlib import Path

import numpy as np
import phreeqc
import pytest

from replay.effects.chemistry.components import dissolved_components
from replay.effects.chemistry.database import database_of
from replay.effects.chemistry.mixture import mixture_of
from replay.effects.chemistry.solver import Solver

FOLDER = Path(phreeqc.__file__).parent / "databases"


def ph_and_species(molal):
    """pH, and mol/kg of each species by PHREEQC's name, of formulas in a kg of water."""
    totals = {}
    for formula, amount in molal.items():
        for component, many in dissolved_components(formula).items():
            totals[component] = totals.get(component, 0.0) + many * amount
    mixture = mixture_of(database_of(), sorted(totals), [])
    row = np.array([[totals.get(name, 0.0) for name in mixture.components]])
    solved = Solver(mixture).equilibrium(row, np.array([55.508 + totals.get("H2O", 0.0)]), np.array([25.0]))
    names = [entry.name for entry in mixture.species]
    return solved.ph[0], dict(zip(names, solved.species[0].tolist(), strict=True))


@cache
def library_of(database):
    """PHREEQC with one of its data bases."""
    library = phreeqc.Phreeqc()
    library.LoadDatabase(str(FOLDER / database))
    return library


def ph_by(database, elements, molal):
    """The pH that PHREEQC has with one of its data bases as it is."""
    text = (
        "SELECTED_OUTPUT\n -reset false\n -pH true\n -high_precision true\nSOLUTION 1\n units mol/kgw\n pH 7 charge\n"
    )
    text += "".join(f" {element} {many * molal}\n" for element, many in elements.items())
    library = library_of(database)
    assert not library.RunString(text + "END\n")
    return library.GetSelectedOutput()["pH"][-1]


WATEQ, LLNL, SIT, PITZER = "wateq4f.dat", "llnl.dat", "sit.dat", "pitzer.dat"
SALTS = {
    "FeSO4": ({"Fe(2)": 1, "S(6)": 1}, (WATEQ, LLNL, SIT)),
    "MnSO4": ({"Mn": 1, "S(6)": 1}, (WATEQ, SIT)),
    "NiSO4": ({"Ni": 1, "S(6)": 1}, (WATEQ, LLNL, SIT)),
    "ZnSO4": ({"Zn": 1, "S(6)": 1}, (WATEQ, LLNL)),
    "MgSO4": ({"Mg": 1, "S(6)": 1}, (WATEQ, SIT, PITZER)),
    "FeCl2": ({"Fe(2)": 1, "Cl": 2}, (WATEQ, LLNL, SIT)),
    "MnCl2": ({"Mn": 1, "Cl": 2}, (WATEQ, SIT)),
    "ZnCl2": ({"Zn": 1, "Cl": 2}, (WATEQ, LLNL)),
    "AlCl3": ({"Al": 1, "Cl": 3}, (WATEQ, SIT)),
    "NH4Cl": ({"N(-3)": 1, "Cl": 1}, (LLNL, SIT)),
    "(NH4)2SO4": ({"N(-3)": 2, "S(6)": 1}, (LLNL, SIT)),
    "Na2CO3": ({"Na": 2, "C(4)": 1}, (WATEQ, LLNL, SIT, PITZER)),
    "K2CO3": ({"K": 2, "C(4)": 1}, (WATEQ, LLNL, SIT, PITZER)),
    "NaHCO3": ({"Na": 1, "C(4)": 1}, (WATEQ, LLNL, SIT, PITZER)),
    "Na3PO4": ({"Na": 3, "P": 1}, (WATEQ, LLNL, SIT)),
    "Na2HPO4": ({"Na": 2, "P": 1}, (WATEQ, LLNL, SIT)),
    "NaH2PO4": ({"Na": 1, "P": 1}, (LLNL, SIT)),
    "Na2SO4": ({"Na": 2, "S(6)": 1}, (WATEQ, LLNL, SIT, PITZER)),
    "NaHSO4": ({"Na": 1, "S(6)": 1}, (WATEQ, LLNL, SIT, PITZER)),
    "H2SO4": ({"S(6)": 1}, (WATEQ, LLNL, SIT, PITZER)),
    "H3PO4": ({"P": 1}, (LLNL, SIT)),
    "HCl": ({"Cl": 1}, (WATEQ, LLNL, SIT, PITZER)),
    "NaOH": ({"Na": 1}, (WATEQ, LLNL, SIT, PITZER)),
    "NH3": ({"N(-3)": 1}, (LLNL, SIT)),
    "Na3C6H5O7": ({"Na": 3, "Cit": 1}, (SIT,)),
    "Na2H2P2O7": ({"Na": 2, "Pyrophos": 1}, (SIT,)),
    "C6H12O7": ({"Glu": 1}, (SIT,)),
}
"""Salt -> what it brings, and the data bases that know how its ions give and take protons."""

WITHIN = {0.1: 0.15, 1.0: 0.3}
"""mol/kg -> how far a pH may lie outside of what the other data bases span, which differ by up to 0.6 at 1 mol/kg."""


@pytest.mark.sampled(54)
@pytest.mark.parametrize("molal", WITHIN)
@pytest.mark.parametrize("salt", SALTS)
def test_ph_of_concentrated_salts_agrees_with_other_databases(salt, molal):
    """The pH of a salt, ``molal`` mol/kg, lies between those of other data bases of PHREEQC that know its ions.

    These differ among themselves; it may lie outside by WITHIN, 0.15 at 0.1 mol/kg and 0.3 at 1 mol/kg.
    """
    elements, databases = SALTS[salt]
    others = [ph_by(database, elements, molal) for database in databases]
    ph, _species = ph_and_species({salt: molal})
    assert min(others) - WITHIN[molal] < ph < max(others) + WITHIN[molal]


# Mean activity coefficients at 0.2 and 1 mol/kg. Source: R. A. Robinson and R. H. Stokes, Electrolyte Solutions, 1959.
MEAN_ACTIVITY = {"CuSO4": (0.104, 0.0423), "FeSO4": (0.105, 0.043), "ZnSO4": (0.104, 0.0435)}
ANGSTROM = {"Cu+2": 6.0, "Fe+2": 6.0, "Zn+2": 5.0}


def test_ions_of_sulfates_have_their_measured_activity():
    """Mean activity coefficients of a sulfate at 0.2 and 1 mol/kg are within a third of those measured.

    They are the fraction of ions free of pairs, by the product, times the coefficient of free ions by the extended
    equation of Debye and Hueckel, with sizes in angstrom (5 of sulfate) and an ionic strength of four times the free
    ions' molality, as of any salt of charges 2.
    """
    for salt in MEAN_ACTIVITY:
        for molal, measured in zip((0.2, 1.0), MEAN_ACTIVITY[salt], strict=True):
            metal = salt.removesuffix("SO4") + "+2"
            _ph, species = ph_and_species({salt: molal})
            root_of_strength = np.sqrt(4.0 * species[metal])
            # 0.509 by the square of the charge, 2, is 2.036; 0.3286 is of a size in angstrom; 0.02 a linear term.
            log_metal, log_sulfate = (
                -2.036 * root_of_strength / (1.0 + 0.3286 * size * root_of_strength) for size in (ANGSTROM[metal], 5.0)
            )
            of_free_ions = 10.0 ** (0.5 * (log_metal + log_sulfate) - 0.02 * root_of_strength**2)
            free_fraction = np.sqrt(species[metal] * species["SO4-2"]) / molal
            assert free_fraction * of_free_ions == pytest.approx(measured, rel=0.33), (salt, molal)


def test_alkaline_earth_ammonia_complexes_have_their_nist_constants():
    """1 mol/kg of a metal's chloride and of ammonia; ``expected``: stability constant (no log) of M(NH3)^2+ by NIST 46.

    By mol/kg of the complex, of free ammonia and of the free metal the product has it within 10 %.
    """
    for metal, expected in [("Ba", 0.63), ("Sr", 0.79), ("Ca", 1.26)]:
        _ph, species = ph_and_species({f"{metal}Cl2": 1.0, "NH3": 1.0})
        constant = species[f"{metal}NH3+2"] / (species["NH3"] * species[f"{metal}+2"])
        assert constant == pytest.approx(expected, rel=0.1), metal


def test_iron_thiocyanate_has_the_constant_of_a_laboratory():
    """The stability constant of FeSCN^2+ is 138 at 0.5 mol/L of perchlorate, within a fifth.

    Source: H. S. Frank and R. L. Oswalt, J. Am. Chem. Soc. 69, 1947.
    """
    _ph, species = ph_and_species({"Fe(ClO4)3": 1e-3, "KSCN": 1e-3, "HClO4": 0.5})
    assert species["FeSCN+2"] / (species["Fe+3"] * species["SCN-"]) == pytest.approx(138.0, rel=0.2)


# pH at 25 degC. Source: Y. C. Wu, W. F. Koch, R. A. Durst, NBS Special Publication 260-53, 1988: primary and secondary
# standards, mol/kg; the last: R. A. Robinson and R. H. Stokes, hydrochloric acid with potassium chloride.
BUFFERS = [
    ({"KHC8H4O4": 0.05}, 4.006),
    ({"KH2PO4": 0.025, "Na2HPO4": 0.025}, 6.863),
    ({"KH2PO4": 0.008695, "Na2HPO4": 0.03043}, 7.415),
    ({"Na2B4O7": 0.01}, 9.183),
    ({"NaHCO3": 0.025, "Na2CO3": 0.025}, 10.011),
    ({"KC6H7O7": 0.05}, 3.776),
    ({"KC4H5O6": 0.0341}, 3.557),
    ({"Ca(OH)2": 0.0203}, 12.454),
    ({"KH3C4O8": 0.05}, 1.681),
    ({"HCl": 0.01, "KCl": 0.09}, 2.07),
]


def test_standard_buffers_have_their_certified_ph():
    """``molal``: formula -> mol/kg of a standard buffer; its pH at 25 degC is the certified within 0.05.

    PHREEQC's minteq.v4 unchanged has 6.75 for phosphate, certified 6.863, and 9.87 for carbonate, 10.011, as it pairs
    sodium with them.
    """
    for molal, certified_ph in BUFFERS:
        ph, _species = ph_and_species(molal)
        assert ph == pytest.approx(certified_ph, abs=0.05), molal


def test_ph_of_hydrochloric_acid_follows_measured_activities():
    """``molal``: mol/kg of HCl; ``mean_activity``: its mean activity coefficient, measured by Robinson and Stokes.

    The pH is -log10 of their product within 0.35.
    """
    for molal, mean_activity in [(1.0, 0.809), (3.0, 1.316), (5.0, 2.38), (10.0, 10.44)]:
        ph, _species = ph_and_species({"HCl": molal})
        assert ph == pytest.approx(-np.log10(molal * mean_activity), abs=0.35), molal


def test_ion_sizes_leave_stability_constants_unchanged():
    """The product gives ions of PHREEQC's data a size, for their activity; ``log_k`` is that of minteq.v4."""
    for ion, log_k in [("Cr+3", 9.5688), ("Sn+2", 7.094), ("Hg+2", 6.194), ("S-2", -17.3)]:
        assert database_of().species[ion].log_k == pytest.approx(log_k, abs=0.01), ion
