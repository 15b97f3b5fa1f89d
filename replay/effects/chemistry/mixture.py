"""Species, solids and gases that a scene's chemistry may make of its columns, with their enthalpies."""

import string
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray
from replay.effects.chemistry.components import METALS, PROTON, WATER, component_of, dissolved_components
from replay.effects.chemistry.database import Database, Entry, Makeup
from replay.effects.chemistry.enthalpy import ENTHALPY_KJ_MOL, HYDROXIDE_KJ_MOL, PROTONATED_KJ_MOL, enthalpy_j

SOLID, GAS = "(s)", "(g)"

LIGANDS: Final = frozenset(("NH3", "CN-", "SCN-", "C2O4^2-", "S2O3^2-", "C10H12N2O8^4-", "C6H5O7^3-", "C2H8N2"))
"""What makes complexes that a laboratory course speaks of, unlike pairs of ions that only attract each other."""

SEVERAL_CHARGES: Final = 2.0
COMPLEX_ANGSTROM: Final = 5.0
"""Size of an ion of several charges of which no table has one. Source: J. Kielland, J. Am. Chem. Soc. 59, 1937, who has
4 to 5 for complexes and anions of three and four charges.
"""

EARTH_METALS: Final = frozenset(("Li+", "Na+", "K+", "Rb+", "Cs+", "Mg^2+", "Ca^2+", "Sr^2+", "Ba^2+"))
"""Metals whose pairs with anions are no complexes."""

ALWAYS_COUNTED: Final = (
    "H H+ -1 1 1", "H(0) H2 0 1", "H(1) H+ -1 1", "E e- 0 0 0", "O H2O 0 16 16", "O(0) O2 0 16", "O(-2) H2O 0 16",
    "Zp Zp+ 0 1 1", "Zn Zn- 0 1 1",
)  # fmt: skip
"""Elements that PHREEQC cannot do without, and two ions that do nothing but balance a charge."""

ALWAYS_DEFINED: Final = (
    "H+ = H+", "\tlog_k 0", "\t-gamma 5 0.1", "e- = e-", "\tlog_k 0", "H2O = H2O", "\tlog_k 0",
    "2 H2O = O2 + 4 H+ + 4 e-", "\tlog_k -85.9951", "2 H+ + 2 e- = H2", "\tlog_k -3.15",
    "Zp+ = Zp+", "\tlog_k 0", "Zn- = Zn-", "\tlog_k 0",
)  # fmt: skip
"""Their species; oxygen and hydrogen take up what rounding leaves of electrons.

Protons have the activity of hydrochloric acid up to 16 mol/kg, by R. A. Robinson and R. H. Stokes.
"""


@dataclass(frozen=True, eq=False)
class Phase:
    """A solid or gas that may form: its column, what it takes from the others, and PHREEQC's name of it."""

    column: str  # ``AgCl(s)``, ``CO2(g)``
    components: Mapping[str, int]
    entry: Entry
    joule: float | None = None  # of a mol above its components, as a scene declares it


@dataclass(frozen=True, eq=False)
class Mixture:
    """A chemical system at equilibrium, in the columns of a ledger.

    Parameters
    ----------
    database : PHREEQC's data.
    components : (m,) columns that PHREEQC counts; the first is ``H+``, whose total may be negative.
    phases : solids and gases that may form.
    """

    database: Database
    components: tuple[str, ...]
    phases: tuple[Phase, ...]

    @cached_property
    def species(self) -> tuple[Entry, ...]:
        """Dissolved species that can be made of the components, in PHREEQC's order."""
        own_components = {*self.components, WATER}
        # Two names of one makeup would be one species twice: the later definition holds.
        entry_of_makeup = {
            tuple(sorted(entry.makeup.items())): entry
            for entry in self.database.species.values()
            if entry.makeup.keys() <= own_components and entry.makeup.keys() != {WATER}
        }
        return tuple(entry_of_makeup.values())

    @cached_property
    def names(self) -> Mapping[str, str]:
        """PHREEQC's name of an ion or species -> its name in the text that is given to PHREEQC."""
        symbols = dict(zip(self.components[1:], _element_symbols(len(self.components) - 1), strict=True))
        name_in_text = {PROTON: PROTON, WATER: WATER}
        for entry in self.species:
            name_in_text.setdefault(entry.name, _phreeqc_formula(entry.makeup, symbols))
        return name_in_text

    @cached_property
    def symbols(self) -> tuple[str, ...]:
        """Element of each part but ``H+``."""
        return tuple(_element_symbols(len(self.components) - 1))

    @cached_property
    def bare_names(self) -> tuple[str | None, ...]:
        """Name in PHREEQC's text of the bare ion of each component; ``None``: PHREEQC has it with protons alone."""
        bare_ions = [self.species_of({component: 1.0}) for component in self.components]
        return tuple(None if entry is None else self.names[entry.name] for entry in bare_ions)

    @cached_property
    def powers(self) -> FloatArray:
        """(s, m) how many of each part are in a species."""
        rows = [[entry.makeup.get(component, 0.0) for component in self.components] for entry in self.species]
        return np.array(rows, dtype=np.float64).reshape(len(self.species), len(self.components))

    @cached_property
    def uses(self) -> FloatArray:
        """(p, m) how many of each part are in a phase."""
        rows = [[float(phase.components.get(component, 0)) for component in self.components] for phase in self.phases]
        return np.array(rows, dtype=np.float64).reshape(len(self.phases), len(self.components))

    @cached_property
    def charges(self) -> FloatArray:
        """Charge (m,) of each component."""
        return np.array([1.0, *(component_of(component).charge for component in self.components[1:])])

    @cached_property
    def joule(self) -> FloatArray:
        """(s + p,) enthalpy in J of a mol of each species and phase above the components that it is made of."""
        species = [1e3 * self._kilojoule(entry.makeup) for entry in self.species]
        return np.array(species + [self._phase_joule(phase) for phase in self.phases], dtype=np.float64)

    @cached_property
    def _by_makeup(self) -> Mapping[tuple[tuple[str, float], ...], Entry]:
        return {_makeup_key(entry.makeup): entry for entry in self.species}

    def _kilojoule(self, makeup: Makeup) -> float:
        """Enthalpy in kJ of a mol of a species above its components.

        Measured ones of acids, bases and water; PHREEQC's of complexes. Pairs of an ion of one charge with another ion
        are given no heat of their own: PHREEQC's are not measured well enough for a calorimeter.
        """
        solutes = [component for component in makeup if component not in (PROTON, WATER)]
        protons = round(makeup.get(PROTON, 0.0))
        if not solutes:
            return HYDROXIDE_KJ_MOL - ENTHALPY_KJ_MOL[WATER] if protons < 0 else 0.0
        protonation_heats = (
            PROTONATED_KJ_MOL.get(solutes[0], []) if len(solutes) == 1 and makeup[solutes[0]] == 1.0 else []
        )
        if WATER not in makeup and 0 <= protons < len(protonation_heats):
            return protonation_heats[protons] - protonation_heats[0]
        for component in solutes:
            reduced_makeup = {**makeup, component: makeup[component] - 1.0}
            reduced_makeup = {name: many for name, many in reduced_makeup.items() if many}
            # A heat of exactly 0 is one that nobody measured.
            is_single_charge = abs(component_of(component).charge) == 1 and component not in LIGANDS
            is_unmeasured = self._by_makeup[_makeup_key(makeup)].kilojoule == 0.0 and makeup[component] > 1.0
            if (
                (is_single_charge or is_unmeasured)
                and len(solutes) > 1
                and _makeup_key(reduced_makeup) in self._by_makeup
            ):
                return self._kilojoule(reduced_makeup)
        entry = self._by_makeup[_makeup_key(makeup)]
        return entry.kilojoule - self._components_kilojoule(makeup)

    @cached_property
    def changes(self) -> tuple[Mapping[str, float], ...]:
        """For each phase what one mol of it takes from the columns, below 0, and itself."""
        return tuple(
            {**{component: -many for component, many in phase.components.items()}, phase.column: 1.0}
            for phase in self.phases
        )

    def species_of(self, makeup: Makeup) -> Entry | None:
        """The species of a makeup; ``None``: there is none."""
        return self._by_makeup.get(_makeup_key(makeup))

    def row_of(self, formula: str) -> int | None:
        """The row of the species that a formula means; ``None``: there is no such species.

        Water apart: ``B(OH)4-`` is PHREEQC's ``H2BO3-``.
        """
        components = _without_water(dissolved_components(formula))
        for row, entry in enumerate(self.species):
            if components and _without_water(entry.makeup) == components:
                return row
        return None

    def pka(self, component: str) -> tuple[float, ...]:
        """pKa of a part, rising, one for each proton it can hold; none of an ion that holds none."""
        return tuple(sorted(float(upper - lower) for lower, upper in _protonation_steps(self._protonations(component))))

    def least_protons(self, component: str) -> int:
        """Protons of the part's barest form, counted from its column: -1 of H3BO3, whose anion is H2BO3-."""
        return min(self._protonations(component), default=0)

    def protons_at(self, ph: float, *, hydroxides: bool) -> dict[str, float]:
        """Mean number of protons that each part holds at a pH where nothing else competes, counted from its column.

        ``hydroxides``: with those that it takes from water, below 0.
        """
        bound_protons: dict[str, float] = {}
        for component in self.components[1:]:
            species_of_component = [
                entry for entry in self.species
                if entry.makeup.get(component, 0.0) == 1.0 and set(entry.makeup) <= {component, PROTON, WATER}
                and (hydroxides or WATER not in entry.makeup)
            ]  # fmt: skip
            protons = np.array([entry.makeup.get(PROTON, 0.0) for entry in species_of_component])
            logs = np.array([entry.log_k for entry in species_of_component]) - protons * ph
            weights = 10.0 ** (logs - logs.max(initial=-np.inf))
            bound_protons[component] = (
                float((weights * protons).sum() / weights.sum()) if len(species_of_component) else 0.0
            )
        return bound_protons

    def _protonations(self, component: str) -> dict[int, float]:
        """Protons -> log10 of the constant of a part with so many, of what holds neither water nor another part."""
        return {
            round(entry.makeup.get(PROTON, 0.0)): entry.log_k
            for entry in self.species
            if entry.makeup.get(component, 0.0) == 1.0 and set(entry.makeup) <= {component, PROTON}
        }

    def _components_kilojoule(self, makeup: Makeup) -> float:
        """Enthalpy of the bare ions in a makeup above the ions in which PHREEQC counts."""
        bare_ions = {
            component: self._by_makeup.get(((component, 1.0),))
            for component in makeup
            if component not in (PROTON, WATER)
        }
        return sum(makeup[component] * entry.kilojoule for component, entry in bare_ions.items() if entry is not None)

    def _phase_joule(self, phase: Phase) -> float:
        if phase.joule is not None:
            return phase.joule
        changes: dict[str, float] = {
            **{component: -float(many) for component, many in phase.components.items()},
            phase.column: 1.0,
        }
        table_joule = enthalpy_j(changes)
        if not np.isnan(table_joule):
            return table_joule
        # PHREEQC's is that of dissolving, in its own ions.
        return 1e3 * (-phase.entry.kilojoule - self._components_kilojoule(phase.entry.makeup))


def phreeqc_data(mixture: Mixture) -> str:
    """The data base that PHREEQC gets: the mixture's species and phases, each oxidation state as an element."""
    name_in_text = mixture.names
    lines = ["SOLUTION_MASTER_SPECIES", *ALWAYS_COUNTED]
    for component, symbol in zip(mixture.components[1:], mixture.symbols, strict=True):
        lines.append(f"{symbol} {name_in_text[mixture.database.masters[component]]} 0 1 1")
    lines += ["SOLUTION_SPECIES", *ALWAYS_DEFINED]
    master_ions = {mixture.database.masters[component] for component in mixture.components[1:]}
    for entry in mixture.species:
        if entry.name == PROTON:
            continue
        if entry.name in master_ions:
            lines += [f"{name_in_text[entry.name]} = {name_in_text[entry.name]}", "\tlog_k 0"]
            lines += [f"\t{option}" for option in _activity_option(entry, mixture)]
            continue
        lines.append(_equation(entry.makeup, name_in_text[entry.name], mixture))
        analytic_options = [option for option in entry.options if "analytic" in option]
        lines += [
            f"\tlog_k {entry.log_k!r}",
            f"\tdelta_h {entry.kilojoule!r} kJ",
            *(f"\t{option}" for option in analytic_options),
        ]
        lines += [f"\t{option}" for option in _activity_option(entry, mixture)]
    lines.append("PHASES")
    symbols = dict(zip(mixture.components[1:], mixture.symbols, strict=True))
    for row, phase in enumerate(mixture.phases):
        makeup = phase.entry.makeup
        formula = _phreeqc_formula(makeup, symbols)
        lines += [phase_name(row), _equation(makeup, formula, mixture, dissolving=True)]
        lines += [f"\tlog_k {phase.entry.log_k!r}", f"\tdelta_h {phase.entry.kilojoule!r} kJ"]
        lines += [f"\t{option}" for option in phase.entry.options if "analytic" in option]
    return "\n".join([*lines, "END", ""])


def _activity_option(entry: Entry, mixture: Mixture) -> list[str]:
    """Line of an ion's activity coefficient; none where PHREEQC takes that of Davies.

    minteq.v4 writes 0 0 for what MINTEQA2 gives the equation of Davies, and PHREEQC takes that for the limiting law.
    Both are far off for ions of several charges beyond 0.5 mol/kg: ferrous sulfate of 1 mol/L had a pH of 7.9. Such
    ions get a size, and a metal with neutral ligands the activity of the metal. Anionic complexes of metals keep
    Davies: with a size silver chloride would dissolve without end in 2 mol/L of hydrochloric acid, as AgCl4-3.
    """
    gamma_options = [option for option in entry.options if "gamma" in option]
    charge = sum(
        many * (1.0 if name == PROTON else component_of(name).charge)
        for name, many in entry.makeup.items()
        if name != WATER
    )
    if charge == 0.0 or any(option.split()[1:3] != ["0", "0"] for option in gamma_options):
        return gamma_options
    if abs(charge) < SEVERAL_CHARGES or (charge < 0.0 and set(entry.makeup) & METALS - EARTH_METALS):
        return []
    for metal in METALS & set(entry.makeup):
        bare_ion = mixture.species_of({metal: 1.0})
        if bare_ion is not None and bare_ion is not entry and component_of(metal).charge == charge:
            return _activity_option(bare_ion, mixture)
    return [f"-gamma {COMPLEX_ANGSTROM:g} 0"]


def phase_name(row: int) -> str:
    """Name of a phase in the text that is given to PHREEQC."""
    return f"Phase_{row}"


def _equation(makeup: Makeup, name: str, mixture: Mixture, *, dissolving: bool = False) -> str:
    """The equation of a species or phase, in the ions by which PHREEQC counts."""
    masters, names = mixture.database.masters, mixture.names
    component_counts = {WATER: makeup.get(WATER, 0.0), PROTON: makeup.get(PROTON, 0.0)}
    terms = []
    for component, many in makeup.items():
        if component in (PROTON, WATER):
            continue
        ion = masters[component]
        for symbol in (PROTON, WATER):
            component_counts[symbol] -= many * mixture.database.ions[ion].get(symbol, 0.0)
        terms.append((many, names[ion]))
    terms += [(many, symbol) for symbol, many in component_counts.items() if abs(many) > 1e-9]
    right_side = " + ".join(f"{many:g} {symbol}" for many, symbol in terms if many > 0.0)
    left_side = " + ".join([name, *(f"{-many:g} {symbol}" for many, symbol in terms if many < 0.0)])
    return f"{left_side} = {right_side}" if dissolving else f"{right_side} = {left_side}"


def _phreeqc_formula(makeup: Makeup, symbols: Mapping[str, str]) -> str:
    """A formula of PHREEQC with an element for each part, and hydrogen, oxygen and charge as they are."""
    hydrogen = makeup.get(PROTON, 0.0) + 2.0 * makeup.get(WATER, 0.0)
    oxygen, charge, text = makeup.get(WATER, 0.0), makeup.get(PROTON, 0.0), ""
    for component, many in sorted(makeup.items()):
        if component in (PROTON, WATER):
            continue
        base = component_of(component)
        hydrogen += many * base.hydrogen
        oxygen += many * base.oxygen
        charge += many * base.charge
        text += f"{symbols[component]}{many:g}"
    text += f"H{hydrogen:g}" if hydrogen else ""
    text += f"O{oxygen:g}" if oxygen else ""
    # PHREEQC writes a single charge without its number.
    return text if charge == 0.0 else f"{text}{charge:+g}".removesuffix("1" if abs(charge) == 1.0 else "")


def _without_water(makeup: Mapping[str, float]) -> dict[str, float]:
    return {component: float(many) for component, many in makeup.items() if component != WATER}


def _makeup_key(makeup: Makeup) -> tuple[tuple[str, float], ...]:
    return tuple(sorted((component, float(many)) for component, many in makeup.items()))


def _element_symbols(symbol_count: int) -> list[str]:
    alphabet = string.ascii_lowercase
    return [f"Q{alphabet[row // 26]}{alphabet[row % 26]}" for row in range(symbol_count)]


def _protonation_steps(logs: Mapping[int, float]) -> list[tuple[float, float]]:
    """Logarithms of a form and of the one with a proton more; where one is skipped, shared evenly."""
    protonation_steps: list[tuple[float, float]] = []
    protons = sorted(logs)
    for fewer, more in pairwise(protons):
        log_step = (logs[more] - logs[fewer]) / (more - fewer)
        protonation_steps += [(0.0, log_step)] * (more - fewer)
    return protonation_steps


def mixture_of(database: Database, columns: Iterable[str], phases: Sequence[Phase]) -> Mixture:
    """The mixture of these columns, those that PHREEQC knows, and of what its phases take."""
    used_components = [component for phase in phases for component in phase.components]
    components = [
        column
        for column in dict.fromkeys([*columns, *used_components])
        if column not in (PROTON, WATER) and column in database.masters
    ]
    return Mixture(database, (PROTON, *sorted(components)), tuple(phases))
