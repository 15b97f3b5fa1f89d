"""The ions and molecules that dissolved formulas are counted as, each a column of the ledger.

An acid is counted as protons and its anion, a base as what it is less the protons it takes: ``CH3COOH`` is H+ and
CH3COO-, ``NH4Cl`` is NH3, H+ and Cl-, ``NaOH`` is Na+ and H2O less H+. What they stand as is found by PHREEQC.
"""

import tomllib
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from typing import Any, Final

from replay.effects.chemistry.formulas import atoms, charge_of, crystal_water

PROTON, WATER = "H+", "H2O"

_TABLES: Final[dict[str, dict[str, Any]]] = tomllib.loads(
    resources.files(__package__).joinpath("components.toml").read_text(encoding="utf-8")
)
ELEMENTS: Final[Mapping[str, str]] = {**_TABLES["metals"], **_TABLES["bases"], **_TABLES["anions"]}
"""Column -> its element in PHREEQC, one for each oxidation state."""
METALS: Final = frozenset(_TABLES["metals"])
BASES: Final = frozenset(_TABLES["bases"])
PHASE_NAMES: Final[Mapping[str, str]] = _TABLES["solids"]
FRESH_FORMULAS: Final = tuple(_TABLES["fresh"]["formulas"])
INERT_FORMULAS: Final = frozenset(_TABLES["inert"]["formulas"])
GASES: Final = frozenset(_TABLES["phases"]["gases"])
UNSOUND_PHASES: Final = frozenset(_TABLES["unsound"]["phases"])
SOLIDS: Final = frozenset(_TABLES["phases"]["solids"])

ORGANIC_BASES: Final = BASES - {"NH3"}
SALT_ANIONS: Final = frozenset(("Cl-", "Br-", "I-", "NO3-", "ClO4-", "SO4^2-"))
"""Anions with which a molecular formula of an organic base is read as its salt."""

MOST_IONS: Final = 16
"""Ions in a formula: more are no formula of a laboratory."""

HYDRATED_ACIDS: Final = frozenset(("H3AsO3", "H3BO3", "H4SiO4"))
"""Acids whose ions are also written with less water than they have in it: AsO2-, BO2-, SiO3^2-."""

ACIDS: Final = HYDRATED_ACIDS | {"H3AsO4"}
"""Columns that are acids with all of their protons."""

MOST_KINDS: Final = 4
"""Kinds of ions in a formula, protons and water not counted: Mohr's salt has three."""


@dataclass(frozen=True)
class Component:
    """A column with what it is made of."""

    name: str
    heavy_atoms: Mapping[str, int] = field(compare=False)  # atoms but hydrogen and oxygen
    hydrogen: int
    oxygen: int
    charge: int


@cache
def component_of(name: str) -> Component:
    """A column by its name."""
    atom_counts = atoms(name)
    heavy_atoms = {atom: many for atom, many in atom_counts.items() if atom not in "HO"}
    return Component(name, heavy_atoms, atom_counts["H"], atom_counts["O"], charge_of(name))


@cache
def components_of(formula: str) -> Mapping[str, int] | None:
    """Columns that a dissolved formula is counted as, of H+ below 0 in a base; ``None``: it stays whole.

    Of several ways the one with the fewest kinds of ions is taken, then that with the fewest ions, then that without
    hypochlorite: Cu2(OH)3Cl is a basic chloride and no hypochlorite of copper(I).
    """
    if formula in INERT_FORMULAS and formula != WATER:
        return None
    if formula in ELEMENTS:
        return {formula: 1}
    atom_counts = atoms(formula)
    heavy_atoms = Counter({atom: many for atom, many in atom_counts.items() if atom not in "HO"})
    fewest_components: tuple[tuple[int, int, bool], dict[str, int]] | None = None
    for ions in _ion_combinations(heavy_atoms):
        completed_components = _with_protons_and_water(formula, ions, atom_counts)
        rank = (len(ions), sum(ions.values()), "ClO-" in ions)
        if completed_components is not None and (fewest_components is None or rank < fewest_components[0]):
            fewest_components = rank, completed_components
    return None if fewest_components is None else fewest_components[1]


def dissolved_components(formula: str) -> Mapping[str, int]:
    """Columns of a formula in solution; one that stays whole is its only one."""
    return components_of(formula) or {formula: 1}


def is_known(formula: str) -> bool:
    """Whether the charges in a formula are known."""
    return formula in INERT_FORMULAS or components_of(formula) is not None


def _ion_combinations(heavy_atoms: Counter[str]) -> Iterator[Counter[str]]:
    """Ions that have exactly these atoms; none where there are no atoms but hydrogen and oxygen."""
    components = [component_of(name) for name in ELEMENTS]
    fitting_components = [
        candidate
        for candidate in components
        if candidate.heavy_atoms and all(heavy_atoms[atom] >= many for atom, many in candidate.heavy_atoms.items())
    ]
    component_count_of_atom = {
        atom: sum(atom in candidate.heavy_atoms for candidate in fitting_components) for atom in heavy_atoms
    }
    # Ions of the atom with the fewest choices first: what cannot be made of the others is seen at once.
    atoms_by_choices = sorted(heavy_atoms, key=lambda atom: (component_count_of_atom[atom], atom))
    fitting_components.sort(key=lambda candidate: min(atoms_by_choices.index(atom) for atom in candidate.heavy_atoms))
    ions = [tuple(candidate.heavy_atoms.get(atom, 0) for atom in atoms_by_choices) for candidate in fitting_components]
    required_atoms = tuple(heavy_atoms[atom] for atom in atoms_by_choices)
    for counts in ion_choices(ions, required_atoms):
        yield Counter({fitting_components[row].name: many for row, many in counts.items()})


def ion_choices(ions: list[tuple[int, ...]], required_atoms: tuple[int, ...]) -> Iterator[Counter[int]]:
    """How often to take which row of ``ions`` for sums of exactly ``required_atoms`` atoms.

    At most ``MOST_IONS`` ions of ``MOST_KINDS`` kinds.
    """

    @cache
    def fewest_ions(row: int, remaining_atoms: tuple[int, ...]) -> float:
        """Fewest ions, of this row and those below, that sum to the rest; infinite where none do."""
        if not any(remaining_atoms):
            return 0
        if row == len(ions):
            return float("inf")
        fewest_without_ion = fewest_ions(row + 1, remaining_atoms)
        atoms_without_ion = _remaining_atoms(remaining_atoms, ions[row])
        return (
            fewest_without_ion
            if atoms_without_ion is None
            else min(fewest_without_ion, 1 + fewest_ions(row, atoms_without_ion))
        )

    def sums(row: int, remaining_atoms: tuple[int, ...], chosen: Counter[int]) -> Iterator[Counter[int]]:
        if not any(remaining_atoms):
            yield chosen
            return
        if sum(chosen.values()) + fewest_ions(row, remaining_atoms) > MOST_IONS:
            return
        atoms_without_ion = _remaining_atoms(remaining_atoms, ions[row])
        if atoms_without_ion is not None and (row in chosen or len(chosen) < MOST_KINDS):
            yield from sums(row, atoms_without_ion, chosen + Counter({row: 1}))
        yield from sums(row + 1, remaining_atoms, chosen)

    yield from sums(0, required_atoms, Counter())


def _remaining_atoms(atoms_left: tuple[int, ...], ion: tuple[int, ...]) -> tuple[int, ...] | None:
    """Atoms that remain without those of an ion; ``None``: it has more than there are."""
    remaining_atoms = tuple(many - ion_atoms for many, ion_atoms in zip(atoms_left, ion, strict=True))
    return None if min(remaining_atoms) < 0 else remaining_atoms


def _with_protons_and_water(formula: str, ions: Counter[str], atom_counts: Counter[str]) -> dict[str, int] | None:
    """Ions with the protons and the water that make up a formula; ``None``: they do not."""
    component_counts = [(component_of(name), many) for name, many in ions.items()]
    protons = charge_of(formula) - sum(many * ion.charge for ion, many in component_counts)
    water = atom_counts["O"] - sum(many * ion.oxygen for ion, many in component_counts)
    hydrogen = sum(many * ion.hydrogen for ion, many in component_counts) + protons + 2 * water
    # Hydrogen that does not come out is an oxidation state that does not fit.
    if hydrogen != atom_counts["H"] or not _is_plausible(formula, ions, water):
        return None
    completed_components = {**ions, PROTON: protons, WATER: water}
    return {name: many for name, many in completed_components.items() if many}


def _is_plausible(formula: str, ions: Counter[str], water: int) -> bool:
    """Whether a formula can be these ions: glycerol is no propionic acid with water, urea no ammonium carbonate."""
    organic_ions = [
        name for name in ions if len(component_of(name).heavy_atoms) and "C" in component_of(name).heavy_atoms
    ]
    organic_ions = [name for name in organic_ions if name not in ("CO3^2-", "CN-", "SCN-")]
    if organic_ions and (water != crystal_water(formula) or not _is_organic_salt(formula, ions, organic_ions)):
        return False
    # TRIS is no trimethylammonium hydrogencarbonate, lysine no salt of dimethylamine.
    if set(ions) & ORGANIC_BASES and not (set(ions) <= ORGANIC_BASES | SALT_ANIONS or set(ions) & METALS):
        return False
    # Pyrophosphate does not become phosphate in water, as an oxide of phosphorus does, nor phosphate pyrophosphate.
    if "P2O7^4-" in ions and water != crystal_water(formula):
        return False
    if "PO4^3-" in ions and water < 0 and (len(ions) > 1 or charge_of(formula) != 0):
        return False
    # Chromate loses water; any other ion that did would be another molecule.
    ion_or_base = charge_of(formula) != 0 or any(name in BASES for name in ions)
    if ion_or_base and water < 0 and not {"CrO4^2-", *HYDRATED_ACIDS} & set(ions):
        return False
    has_cation = any(name in METALS or name in BASES for name in ions)
    if has_cation:
        return True
    if organic_ions and sum(ions.values()) > 1:
        return False
    return charge_of(formula) != 0 or len(ions) <= 1


def _is_organic_salt(formula: str, ions: Counter[str], organic_ions: list[str]) -> bool:
    """Whether a formula can be of these organic ions: calcium lactate is no acetate, sodium gluconate no carbonate."""
    if not set(ions) & METALS:
        return True
    if len(organic_ions) > 1 or "CO3^2-" in ions:
        return False
    # Of acids with several protons there are acid salts: KHC8H4O4, KHC2O4.
    protons = charge_of(formula) - sum(many * component_of(name).charge for name, many in ions.items())
    return protons <= 0 or component_of(organic_ions[0]).charge < -1


def solute_components(formula: str) -> dict[str, int]:
    """Columns of a formula but protons and water."""
    return {
        component: many for component, many in dissolved_components(formula).items() if component not in (PROTON, WATER)
    }


def dry_components(makeup: Mapping[str, float]) -> dict[str, float]:
    """A makeup without its crystal water: that which no proton is taken from or given to."""
    return {component: float(many) for component, many in makeup.items() if component != WATER and abs(many) > 1e-9}
