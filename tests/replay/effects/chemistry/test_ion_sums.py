"""Ions that sum to the atoms of a formula, against an exhaustive search, and how long a formula takes to read."""

import itertools
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from replay.effects.chemistry.components import MOST_IONS, MOST_KINDS, components_of, ion_choices

ATOMS = st.tuples(st.integers(0, 2), st.integers(0, 2), st.integers(0, 2))


@given(ions=st.lists(ATOMS.filter(any), min_size=1, max_size=6, unique=True), formula=ATOMS.filter(any))
def test_ion_sums_of_a_formula_equal_an_exhaustive_search(ions, formula):
    """Ions and the formula are counts of atoms of three elements; a sum is how many of each ion make the formula.

    The search tries all counts of each ion; sums of too many ions or kinds of ions do not count.
    """
    most = [min(total // atoms for total, atoms in zip(formula, ion, strict=True) if atoms) for ion in ions]
    exhaustive = set()
    for counts in itertools.product(*(range(limit + 1) for limit in most)):
        atoms = tuple(
            sum(count * ion[element] for count, ion in zip(counts, ions, strict=True)) for element in range(3)
        )
        kinds = sum(count > 0 for count in counts)
        if atoms == formula and sum(counts) <= MOST_IONS and kinds <= MOST_KINDS:
            exhaustive.add(frozenset((ion, count) for ion, count in enumerate(counts) if count))
    sums = [frozenset(counts.items()) for counts in ion_choices(ions, formula)]
    assert len(sums) == len(set(sums))
    assert set(sums) == exhaustive


@pytest.mark.slow
@pytest.mark.parametrize("formula", ["Fe4(Fe(CN)6)3", "Fe3(Fe(CN)6)2", "Zn3K2(Fe(CN)6)2", "Mg2C10H12N2O8"])
def test_large_formula_is_read_within_a_second(formula):
    """Double cyanides and an EDTA salt, whose many atoms many ions could sum to; nothing is remembered of them."""
    components_of.cache_clear()
    began = time.process_time()
    components_of(formula)
    assert time.process_time() - began < 1.0
