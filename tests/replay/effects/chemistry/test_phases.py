"""Salts fall out where an equation makes them if less than 0.1 mol/kg of them dissolves by PHREEQC's constant."""

from math import prod

import pytest

from replay.effects.chemistry.database import database_of
from replay.effects.chemistry.phases import Phases

# log10 of the solubility product, and how many ions of each kind. Source: minteq.v4.dat of PHREEQC.
PRODUCTS = [
    ("Ag2SeO4", -8.91, (2, 1)), ("Cd3(PO4)2", -32.6, (3, 2)), ("Mn2(SO4)3", -5.711, (2, 3)),
    ("Tl2SO4", -3.7868, (2, 1)), ("Cu2SO4", -1.95, (2, 1)), ("CoF2", -1.5969, (1, 2)), ("K2SeO4", -0.73, (2, 1)),
    ("Cr(OH)2", 10.8189 - 2 * 14.0, (1, 2)),
]  # fmt: skip


@pytest.mark.parametrize(("formula", "log_product", "counts"), PRODUCTS)
def test_salt_falls_out_below_a_tenth_mol_by_its_product(formula, log_product, counts):
    """The solubility that follows from the product of ``counts`` ions."""
    molal = (10.0**log_product / prod(count**count for count in counts)) ** (1.0 / sum(counts))
    assert Phases(database_of(), {}, frozenset()).is_sparingly_soluble(formula) == (molal < 0.1)


@pytest.mark.parametrize("formula", ["CdI2", "Sn(SO4)2", "NaCl", "Na+"])
def test_salt_of_dissolved_molecules_or_hydrolysed_ions_stays(formula):
    """CdI2 stands dissolved as a molecule; tin(IV) as its hydroxide, from which its bare ion comes."""
    assert not Phases(database_of(), {}, frozenset()).is_sparingly_soluble(formula)
