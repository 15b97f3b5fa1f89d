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
FRESH: Final = tuple(_TABLES["fresh"]["formulas"])
INERT: Final = frozenset(_TABLES["inert"]["formulas"])
GASES: Final = frozenset(_TABLES["phases"]["gases"])
SOLIDS: Final = frozenset(_TABLES["phases"]["solids"])

MOST_IONS: Final = 16
"""Ions in a formula: more are no formula of a laboratory."""


@dataclass(frozen=True)
class Component:
    """A column with what it is made of."""

    name: str
    heavy: Mapping[str, int] = field(compare=False)  # atoms but hydrogen and oxygen
    hydrogen: int
    oxygen: int
    charge: int


@cache
def component_of(name: str) -> Component:
    """A column by its name."""
    counted = atoms(name)
    heavy = {atom: many for atom, many in counted.items() if atom not in "HO"}
    return Component(name, heavy, counted["H"], counted["O"], charge_of(name))


@cache
def components_of(formula: str) -> Mapping[str, int] | None:
    """Columns that a dissolved formula is counted as, of H+ below 0 in a base; ``None``: it stays whole.

    Of several ways the one with the fewest kinds of ions is taken, then that with the fewest ions.
    """
    if formula in INERT and formula != WATER:
        return None
    if formula in ELEMENTS:
        return {formula: 1}
    counted = atoms(formula)
    heavy = Counter({atom: many for atom, many in counted.items() if atom not in "HO"})
    best: tuple[tuple[int, int], dict[str, int]] | None = None
    for ions in _combinations(heavy):
        completed = _completed(formula, ions, counted)
        rank = (len(ions), sum(ions.values()))
        if completed is not None and (best is None or rank < best[0]):
            best = rank, completed
    return None if best is None else best[1]


def dissolved_components(formula: str) -> Mapping[str, int]:
    """Columns of a formula in solution; one that stays whole is its only one."""
    return components_of(formula) or {formula: 1}


def is_known(formula: str) -> bool:
    """Whether the charges in a formula are known."""
    return formula in INERT or components_of(formula) is not None


def _combinations(heavy: Counter[str]) -> Iterator[Counter[str]]:
    """Ions that have exactly these atoms; none where there are no atoms but hydrogen and oxygen."""
    if not heavy:
        yield Counter()
        return
    components = [component_of(name) for name in ELEMENTS]
    fitting = [
        candidate for candidate in components if all(heavy[atom] >= many for atom, many in candidate.heavy.items())
    ]
    yield from _filled(+heavy, fitting, Counter())


def _filled(heavy: Counter[str], fitting: list[Component], chosen: Counter[str]) -> Iterator[Counter[str]]:
    if not heavy:
        yield chosen
        return
    if sum(chosen.values()) >= MOST_IONS:
        return
    # The atom with the fewest choices first.
    atom = min(heavy, key=lambda element: (sum(element in component.heavy for component in fitting), element))
    for row, component in enumerate(fitting):
        if atom not in component.heavy or any(heavy[element] < many for element, many in component.heavy.items()):
            continue
        rest = heavy.copy()
        rest.subtract(component.heavy)
        left = [
            candidate for position, candidate in enumerate(fitting) if position >= row or atom not in candidate.heavy
        ]
        yield from _filled(+rest, left, chosen + Counter({component.name: 1}))


def _completed(formula: str, ions: Counter[str], counted: Counter[str]) -> dict[str, int] | None:
    """Ions with the protons and the water that make up a formula; ``None``: they do not."""
    rows = [(component_of(name), many) for name, many in ions.items()]
    protons = charge_of(formula) - sum(many * ion.charge for ion, many in rows)
    water = counted["O"] - sum(many * ion.oxygen for ion, many in rows)
    hydrogen = sum(many * ion.hydrogen for ion, many in rows) + protons + 2 * water
    # Hydrogen that does not come out is an oxidation state that does not fit.
    if hydrogen != counted["H"] or not _plausible(formula, ions, water):
        return None
    completed = {**ions, PROTON: protons, WATER: water}
    return {name: many for name, many in completed.items() if many}


def _plausible(formula: str, ions: Counter[str], water: int) -> bool:
    """Whether a formula can be these ions: glycerol is no propionic acid with water, urea no ammonium carbonate."""
    organic = [name for name in ions if len(component_of(name).heavy) and "C" in component_of(name).heavy]
    organic = [name for name in organic if name not in ("CO3^2-", "CN-", "SCN-")]
    if organic and water != crystal_water(formula):
        return False
    # Only chromate is known to lose water; any other ion that did would be another molecule.
    ion_or_base = charge_of(formula) != 0 or any(name in BASES for name in ions)
    if ion_or_base and water < 0 and "CrO4^2-" not in ions:
        return False
    positive = any(name in METALS or name in BASES for name in ions)
    if positive:
        return True
    if organic and sum(ions.values()) > 1:
        return False
    return charge_of(formula) != 0 or len(ions) <= 1


def heavy_components(formula: str) -> dict[str, int]:
    """Columns of a formula but protons and water."""
    return {
        component: many for component, many in dissolved_components(formula).items() if component not in (PROTON, WATER)
    }


def dry_components(makeup: Mapping[str, float]) -> dict[str, float]:
    """A makeup without its crystal water: that which no proton is taken from or given to."""
    return {component: float(many) for component, many in makeup.items() if component != WATER and abs(many) > 1e-9}
