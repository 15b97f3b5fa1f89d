"""Solids and gases of a scene: PHREEQC's, salts with a solubility, and those that only an equation takes."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Final

import numpy as np

from replay.effects.chemistry.components import (
    FRESH_FORMULAS,
    PHASE_NAMES,
    PROTON,
    UNSOUND_PHASES,
    WATER,
    components_of,
    dissolved_components,
    dry_components,
)
from replay.effects.chemistry.database import Database, Entry
from replay.effects.chemistry.formulas import charge_of
from replay.effects.chemistry.mixture import GAS, SOLID, Phase, mixture_of
from replay.effects.chemistry.salts import Salt, salt_of, solubility_of
from replay.effects.chemistry.solver import Solver

SPARING_MOL_KG: Final = 0.1
"""What dissolves by less, by PHREEQC's constant, falls out where an equation makes it, without being marked (s)."""


@dataclass(eq=False)
class Phases:
    """Solids and gases of a scene as its equations are read: PHREEQC's, salts with a solubility, and all others."""

    database: Database | None
    declared: Mapping[str, Mapping[float, float]]  # solid -> solubility that the scene declares
    separate: frozenset[str]  # solids that only an equation with a rate takes
    phreeqc: dict[str, Phase] = field(default_factory=dict)
    slow: dict[str, Phase] = field(default_factory=dict)  # PHREEQC's solids that a process dissolves at its rate
    salts: dict[str, Salt] = field(default_factory=dict)

    def add(self, formula: str, phase: str) -> None:
        """Find what a solid or gas is."""
        column = f"{formula}({phase})"
        if column in self.phreeqc or column in self.salts or not phase:
            return
        solubility_table = self.declared.get(formula) or (solubility_of(formula) if phase == "s" else None)
        if phase == "s" and solubility_table is not None and formula not in self.separate:
            self.salts[column] = salt_of(formula, solubility_table)
            return
        entry = None if self.database is None or formula in self.separate else self.entry(formula, phase)
        if entry is not None:
            self.phreeqc[column] = Phase(column, dissolved_components(formula), entry)

    def solver(self, columns: Iterable[str]) -> Solver | None:
        """PHREEQC for what may be dissolved; ``None``: nothing asks it."""
        if self.database is None:
            return None
        return Solver(mixture_of(self.database, sorted(columns), [self.phreeqc[name] for name in sorted(self.phreeqc)]))

    def slow_solver(self, columns: Iterable[str]) -> Solver | None:
        """PHREEQC with the solids that dissolve at a rate beside all others; ``None``: there are none."""
        if self.database is None or not self.slow:
            return None
        all_phases = self.phreeqc | self.slow
        return Solver(mixture_of(self.database, sorted(columns), [all_phases[name] for name in sorted(all_phases)]))

    def dissolves_slowly(self, changes: Mapping[str, float]) -> str:
        """Note and return the column of a solid of PHREEQC's that a process dissolves and no more; ``""``: none."""
        solids = [column for column, many in changes.items() if many < 0.0 and column.endswith(SOLID)]
        if self.database is None or len(solids) != 1:
            return ""
        formula = solids[0].removesuffix(SOLID)
        components = dissolved_components(formula)
        dissolved = {name: many for name, many in changes.items() if name not in (solids[0], WATER)}
        scaled_components = {name: -changes[solids[0]] * many for name, many in components.items() if name != WATER}
        entry = self.entry(formula, "s") if dissolved == scaled_components else None
        if entry is None:
            return ""
        self.slow[solids[0]] = Phase(solids[0], components, entry)
        return solids[0]

    def has_known_solubility(self, formula: str) -> bool:
        """Whether PHREEQC or a solubility says how much of a solid dissolves."""
        return formula + SOLID in self.phreeqc or formula + SOLID in self.salts

    def entry(self, formula: str, phase: str) -> Entry | None:
        """PHREEQC's phase of a formula; of several the one named like it, else the one that dissolves best."""
        assert self.database is not None
        phases = self.database.phases
        if phase == "g":
            return phases.get(formula + GAS)
        phase_name = PHASE_NAMES.get(formula, formula)
        if phase_name in phases and phase_name not in UNSOUND_PHASES and components_of(formula) is not None:
            return phases[phase_name]
        components = components_of(formula) or {}
        own_makeup, water = dry_components(components), components.get(WATER, 0)
        fitting_entries = [
            entry
            for name, entry in _phases_by_ions(self.database).get(frozenset(own_makeup.items()), ())
            if own_makeup
            and name not in UNSOUND_PHASES
            and entry.makeup.get(WATER, 0.0) >= water
            and not name.endswith(GAS)
        ]
        # The nearest in crystal water: calcium hydroxide is no hydrate of lime where a formula says which is meant.
        return max(fitting_entries, key=lambda entry: (-entry.makeup.get(WATER, 0.0), entry.log_k), default=None)

    def is_sparingly_soluble(self, formula: str) -> bool:
        """Whether a formula is a salt that hardly dissolves, by PHREEQC's constant."""
        if self.database is None or charge_of(formula) or solubility_of(formula) is not None:
            return False
        entry = self.entry(formula, "s")
        if entry is not None and (formula in FRESH_FORMULAS or formula in PHASE_NAMES):
            return True
        if entry is None or entry.makeup.get(PROTON, 0.0) > 0.0:
            return False
        molecule = self.dissolved_species(formula)
        if molecule is not None and entry.log_k + molecule.log_k > np.log10(SPARING_MOL_KG):
            return False
        hydroxide = -entry.makeup.get(PROTON, 0.0)
        ions = [many for component, many in entry.makeup.items() if component not in (PROTON, WATER)] + [hydroxide]
        bare_ion_log_k = sum(
            many * self._log_k(component)
            for component, many in entry.makeup.items()
            if component not in (PROTON, WATER)
        )
        log_product = entry.log_k + bare_ion_log_k - 14.0 * hydroxide
        ion_term = sum(many * np.log10(many) for many in ions if many > 0.0)
        return bool((log_product - ion_term) / sum(ions) < np.log10(SPARING_MOL_KG))

    def dissolved_species(self, formula: str) -> Entry | None:
        """PHREEQC's dissolved species of a formula."""
        assert self.database is not None
        own_makeup = dry_components(components_of(formula) or {})
        return next(
            (
                entry
                for entry in self.database.species.values()
                if own_makeup and dry_components(entry.makeup) == own_makeup
            ),
            None,
        )

    def _log_k(self, component: str) -> float:
        """log10 of the constant with which a column's bare ion comes from PHREEQC's."""
        assert self.database is not None
        species = (entry for entry in self.database.species.values() if dict(entry.makeup) == {component: 1.0})
        return next((entry.log_k for entry in species), 0.0)


@cache
def _phases_by_ions(database: Database) -> Mapping[frozenset[tuple[str, float]], Sequence[tuple[str, Entry]]]:
    """Ions of a phase without its water -> names and entries of the phases that are made of them."""
    phases: dict[frozenset[tuple[str, float]], list[tuple[str, Entry]]] = {}
    for name, entry in database.phases.items():
        phases.setdefault(frozenset(dry_components(entry.makeup).items()), []).append((name, entry))
    return phases
