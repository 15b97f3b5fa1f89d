"""Chemistry of a scene from its tables, in the columns of the ledger; tables that do not fit together are refused.

Raised are PlanErrors of the table concerned, with the nearest name: at the plan already, not in the run.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from replay.effects.chemistry.components import (
    ACIDS,
    BASES,
    FRESH_FORMULAS,
    GASES,
    METALS,
    PROTON,
    SOLIDS,
    WATER,
    components_of,
    dissolved_components,
    dry_components,
    solute_components,
)
from replay.effects.chemistry.contents import Contents
from replay.effects.chemistry.database import Database, database_of
from replay.effects.chemistry.declared_heats import declared_joule
from replay.effects.chemistry.enthalpy import enthalpy_j
from replay.effects.chemistry.formulas import Equation, charge_of, equation_of
from replay.effects.chemistry.ledger import Ledger
from replay.effects.chemistry.ledger_columns import ADDED_SUFFIX, Warmth
from replay.effects.chemistry.mixture import EARTH_METALS, GAS, SOLID, Phase
from replay.effects.chemistry.phases import Phases
from replay.effects.chemistry.processes import Process
from replay.effects.chemistry.salts import Salt
from replay.effects.chemistry.solver import Solver
from replay.effects.chemistry.spontaneity import (
    CONCENTRATED_MOLAR,
    STRONG_ANIONS,
    constant_of,
    energy_in_water,
    free_energy_of,
    reason_not_to_proceed,
    strongest_acid,
)
from replay.effects.declaring import Declaration
from replay.effects.flame import heat_of_ledger
from replay.errors import EffectError, PlanError

Tables = Mapping[str, tuple[Declaration, ...]]

UNKNOWN_SOLUBILITY: Final = (
    "nothing says how much {!r} dissolves; give solid.solubility_g_100g, g in 100 g of water, to the body that holds it"
)

ROUND_BRACKETS: Final = str.maketrans("[]", "()")
"""By which ``Fe4[Fe(CN)6]3`` is found in a table."""

COMPLETE_LOG_K: Final = 15.0
"""log10 of a constant from which an equation of two reagents leaves less than a hundredth of 1 mmol/L."""

SOLUBLE_GASES: Final = frozenset(("CO2", "SO2", "H2S", "NH3"))
"""Gases of which PHREEQC knows how much stays dissolved under one atmosphere."""


@dataclass(frozen=True, eq=False)
class Reaction:
    """One table of an effect reaction."""

    declared: Declaration
    equation: Equation
    phases: Mapping[str, str]  # formula -> ``s``, ``g`` or nothing
    process: int  # its place among the ledger's processes; -1: it is at equilibrium, by constants
    obstacle: str = ""  # why it does not proceed by itself; ``""``: it does
    free_energy_j: float = float("nan")  # of a mol of what has no constant; NaN: no table knows it


@dataclass(frozen=True, eq=False)
class Recipe:
    """Reactions, processes, contents and salts of all tables together."""

    reactions: tuple[Reaction, ...]
    processes: tuple[Process, ...]
    contents: Mapping[str, Contents]  # vessel -> what is in it at first
    solver: Solver | None  # PHREEQC; ``None``: nothing declared asks it
    salts: tuple[Salt, ...]
    slow_solids: Solver | None = None  # PHREEQC with the solids that an equation dissolves at its rate

    @property
    def declared_heats(self) -> frozenset[str]:
        """Reagents of equations whose heat the scene declares."""
        declared_reactions = (reaction for reaction in self.reactions if reaction.declared["heat_kj_mol"] is not None)
        return frozenset(formula for reaction in declared_reactions for formula in reaction.equation.reagents)

    def reagent(self, process: int, column: str) -> str:
        """The reagent, as its equation writes it, that a column stands for: Cr2O7^2- is counted as CrO4^2-."""
        reagents = (
            formula
            for reaction in self.reactions
            if reaction.process == process
            for formula in reaction.equation.reagents
        )
        return next((formula for formula in reagents if column in dissolved_components(formula)), column)

    def ledger(self, solid_fraction: float, warmth: Warmth) -> Ledger:
        """A ledger with everything in its vessels."""
        columns_of_vessel = {name: self._columns(contents) for name, contents in self.contents.items()}
        columns = tuple(column for fill in columns_of_vessel.values() for column in fill)
        filled_ledger = Ledger(
            vessels=tuple(columns_of_vessel),
            columns=columns,
            processes=self.processes,
            solver=self.solver,
            salts=self.salts,
            solid_fraction=solid_fraction,
            warmth=warmth,
            slow_solids=self.slow_solids,
        )
        for name, fill in columns_of_vessel.items():
            filled_ledger.fill(name, self.contents[name].volume_ml, fill)
        return filled_ledger

    def _columns(self, contents: Contents) -> dict[str, float]:
        amounts = {formula + ADDED_SUFFIX: amount for formula, amount in contents.amounts.items() if formula != WATER}
        amounts |= {formula + SOLID: amount for formula, amount in contents.solids.items()}
        for formula, amount in contents.amounts.items():
            for component, many in dissolved_components(formula).items():
                amounts[component] = amounts.get(component, 0.0) + many * amount
        return amounts


def undeclared_phases(recipe: Recipe) -> tuple[Phase, ...]:
    """Solids that may form of what is dissolved, and that no table and no vessel of the scene names."""
    if recipe.solver is None:
        return ()
    mixture = recipe.solver.mixture
    phases = Phases(mixture.database, {}, frozenset())
    named_solids = {phase.column for phase in mixture.phases} | {salt.column for salt in recipe.salts}
    named_solids |= {column for process in recipe.processes for column in process.changes}
    named_solids |= {formula + SOLID for reaction in recipe.reactions for formula in reaction.equation.formulas}
    declared_makeups = [dry_components(phase.components) for phase in mixture.phases]
    undeclared_solids = []
    for formula in FRESH_FORMULAS:
        solutes = set(solute_components(formula))
        if formula + SOLID in named_solids or not solutes <= set(mixture.components):
            continue
        entry = phases.entry(formula, "s")
        components = dissolved_components(formula)
        if entry is not None and dry_components(components) not in declared_makeups:
            undeclared_solids.append(Phase(formula + SOLID, components, entry))
    return tuple(undeclared_solids)


def recipe_of(tables: Tables, contents: Mapping[str, Contents]) -> Recipe:
    """Read the tables of reactions, precipitations and gases against what stands in the vessels.

    Raises PlanError: an equation, formula or product that fits nothing, or a constant that is missing.
    """
    reaction_tables = tables.get("reaction", ())
    equations = [_equation(table) for table in reaction_tables]
    database = _requested_database(tables, contents)
    named_solids = {table["solid"] for table in tables.get("precipitation", ())}
    bodies = {solid for content in contents.values() for solid in content.solids}
    solubility_of_solid = {solid: table for content in contents.values() for solid, table in content.solubility.items()}
    phases = Phases(database, solubility_of_solid, _slow_solids(reaction_tables, equations, named_solids))
    default_states = {**dict.fromkeys(SOLIDS | named_solids | bodies, "s"), **dict.fromkeys(GASES, "g")}
    states_by_equation: list[Mapping[str, str]] = []
    brought_formulas = {formula for content in contents.values() for formula in content.amounts}
    brought_ions = {component for formula in brought_formulas for component in dissolved_components(formula)}
    for equation in equations:
        own_states = {
            formula: "s"
            for formula in equation.formulas
            if formula not in default_states
            and (phases.is_sparingly_soluble(formula) or formula.translate(ROUND_BRACKETS) in SOLIDS)
        }
        # A gas that a vessel holds dissolved, such as chlorine water, reacts as what is dissolved, and so does one that
        # acid frees there: sulfur dioxide of a sulfite.
        own_states |= {
            formula: ""
            for formula in equation.reagents
            if default_states.get(formula) == "g"
            and (
                formula in brought_formulas
                or (formula in SOLUBLE_GASES and set(solute_components(formula)) <= brought_ions)
            )
        }
        states_by_equation.append({**default_states, **own_states, **equation.phases})
    phases.separate -= _settling_gases(equations, states_by_equation, phases.separate)
    for equation, phase in zip(equations, states_by_equation, strict=True):
        for formula in equation.formulas:
            phases.add(formula, phase.get(formula, "") if phase.get(formula, "") in ("s", "g") else "")
    # What stands in a vessel dissolves, whether an equation names it or not.
    for solid in sorted(named_solids | bodies - phases.separate):
        phases.add(solid, "s")
    processes: list[Process] = []
    reactions = []
    for table, equation, phase in zip(reaction_tables, equations, states_by_equation, strict=True):
        process = _process(table, equation, phase, phases)
        obstacle, joule = "", float("nan")
        if process is not None and process.salt is None:
            joule = free_energy_of(process, equation, phase, phases, strongest_acid(contents))
            log_k, is_ester = constant_of(process.changes, equation)
            least_joule = joule
            # Activities of a concentrated acid are not known well enough for a constant.
            if is_ester or strongest_acid(contents) < CONCENTRATED_MOLAR:
                process = replace(process, log_k=log_k, is_ester=is_ester)
                if database is not None and not is_ester:
                    least_joule = np.fmin(joule, energy_in_water(process))
            obstacle = reason_not_to_proceed(least_joule, process, equation)
        if process is not None and not obstacle and process not in processes:
            processes.append(process)
        process_index = processes.index(process) if process is not None and not obstacle else -1
        reactions.append(Reaction(table, equation, phase, process_index, obstacle, joule))
    columns = _dissolved_columns(contents, reactions, processes, phases)
    solver = phases.solver(columns)
    for reaction in reactions:
        if reaction.declared["heat_kj_mol"] is not None:
            _declare_heat(reaction, processes, phases, solver)
    salts = tuple(phases.salts[name] for name in sorted(phases.salts))
    return Recipe(
        reactions=tuple(reactions),
        processes=tuple(processes),
        contents=contents,
        solver=phases.solver(columns),
        salts=salts,
        slow_solids=phases.slow_solver(columns),
    )


def _declare_heat(reaction: Reaction, processes: list[Process], phases: Phases, solver: Solver | None) -> None:
    """Give a declared enthalpy to a process, or to the solid that an equation dissolves."""
    equation, heat = reaction.equation, reaction.declared["heat_kj_mol"]
    joule_by_column = (
        {}
        if solver is None
        else dict(
            zip(
                (phase.column for phase in solver.mixture.phases),
                solver.mixture.joule[len(solver.mixture.species) :].tolist(),
                strict=True,
            )
        )
    )
    joule_by_column |= {column: salt.joule for column, salt in phases.salts.items()}
    solid = _dissolved_solid(equation, reaction.phases, phases)
    changes = processes[reaction.process].changes if reaction.process >= 0 else {solid: 0.0}
    joule = declared_joule(heat, equation, reaction.phases, {**joule_by_column, **dict.fromkeys(changes, 0.0)}, solver)
    if reaction.process >= 0:
        processes[reaction.process] = replace(processes[reaction.process], joule=joule)
    if solid:
        solid_joule = -joule / equation.reagents[solid.removesuffix(SOLID)]
        if solid in phases.salts:
            phases.salts[solid] = replace(phases.salts[solid], joule=solid_joule)
        else:
            phases.phreeqc[solid] = replace(phases.phreeqc[solid], joule=solid_joule)


def asks_phreeqc(tables: Tables, contents: Mapping[str, Contents]) -> bool:
    """Whether anything declared needs PHREEQC.

    A reaction without a rate, a precipitation and an indicator of the pH do, the heat of dissolved ions, a reaction
    with acid beside ions that hold protons, and one that may stop at an equilibrium: activities are PHREEQC's.
    """
    at_once = any(table["rate_per_s"] is None for table in tables.get("reaction", ()))
    has_indicators = any(table["indicator"] or table["from_ph"] is not None for table in tables.get("colour", ()))
    heat = heat_of_ledger(tables) is not None
    return (
        at_once
        or bool(tables.get("precipitation"))
        or has_indicators
        or (heat and _gives_heat(contents))
        or _competes_for_acid(tables, contents)
        or any(_may_stop(_equation(table)) for table in tables.get("reaction", ()))
        or any(SOLUBLE_GASES & set(_equation(table).products) for table in tables.get("reaction", ()))
    )


def _may_stop(equation: Equation) -> bool:
    """Whether an equation of dissolved ions has a constant at which it may leave some of its reagents."""
    changes: Counter[str] = Counter()
    for formula, many in equation.changes.items():
        state = equation.phases.get(formula, "s" if formula in SOLIDS else "g" if formula in GASES else "")
        columns = {f"{formula}({state})": 1} if state in ("s", "g") else dissolved_components(formula)
        for column, count in columns.items():
            changes[column] += many * count
    log_k, is_ester = constant_of(changes, equation)
    return not is_ester and log_k < COMPLETE_LOG_K


def _competes_for_acid(tables: Tables, contents: Mapping[str, Contents]) -> bool:
    """Whether an equation that uses acid stands beside anions of weak acids, or ammonium, which hold protons."""
    equations = [_equation(table) for table in tables.get("reaction", ())]
    acid = any(
        PROTON in (components_of(formula) or {})
        for equation in equations
        for formula in equation.reagents
        if formula != WATER
    )
    components = {
        component
        for content in contents.values()
        for formula in content.amounts
        for component in components_of(formula) or {}
    }
    weak_bases = {component for component in components if charge_of(component) < 0 or component in BASES}
    return acid and bool(weak_bases - STRONG_ANIONS)


def _gives_heat(contents: Mapping[str, Contents]) -> bool:
    """Whether ions stand in the vessels whose heat hangs on how they stand: more than strong acids alone."""
    formulas = {formula for content in contents.values() for formula in (*content.amounts, *content.solids)} - {WATER}
    components = [components_of(formula) for formula in formulas]
    return any(counts is not None and not set(counts) <= STRONG_ANIONS | {PROTON, WATER} for counts in components)


def _equation(declared: Declaration) -> Equation:
    try:
        equation = equation_of(declared["equation"], lambda formula: components_of(formula) is not None)
    except ValueError as error:
        raise declared.fail(f"equation: {error}") from error
    if not set(equation.reagents) - {WATER, PROTON, "OH-"} and set(equation.products) - {WATER, PROTON, "OH-"}:
        raise declared.fail("equation: only water reacts, and nothing says how far; name another reagent")
    return equation


def _requested_database(tables: Tables, contents: Mapping[str, Contents]) -> Database | None:
    """PHREEQC's data with the pieces of text that the tables hold; ``None``: nothing asks for them."""
    if not asks_phreeqc(tables, contents):
        return None
    table_of_text = {table["phreeqc"]: table for table in tables.get("reaction", ()) if table["phreeqc"]}
    try:
        return database_of("\n".join(table_of_text))
    except EffectError as error:
        kinds = ("reaction", "precipitation", "colour", "heat")
        naming_table = next(table for kind in kinds for table in tables.get(kind, ()))
        raise naming_table.fail(str(error)) from error
    except ValueError as error:
        naming_table = next(iter(table_of_text.values()))
        raise PlanError(*(str(naming_table.fail(f"phreeqc: {line}")) for line in str(error).splitlines())) from error


def _slow_solids(
    declared: Sequence[Declaration], equations: Sequence[Equation], named_solids: Iterable[str]
) -> frozenset[str]:
    """Solids that only equations with a rate name: they stand apart from what is at equilibrium."""
    at_once = {
        formula
        for table, eq in zip(declared, equations, strict=True)
        if table["rate_per_s"] is None
        for formula in eq.formulas
    }
    slow_formulas = {
        formula
        for table, eq in zip(declared, equations, strict=True)
        if table["rate_per_s"] is not None
        for formula in eq.formulas
        if len(eq.reagents) > 1
    }
    return frozenset(slow_formulas - at_once - set(named_solids))


def _settling_gases(
    equations: Sequence[Equation], states: Sequence[Mapping[str, str]], separate: frozenset[str]
) -> set[str]:
    """Gases that PHREEQC lets leave, although only equations with a rate make them.

    These equations change more than protons: a solid dissolves, or thiosulfate falls apart. Of the others, such as
    bicarbonate with acid, the rate is that at which the gas leaves.
    """
    settling_gases: set[str] = set()
    leaving_gases: set[str] = set()
    for equation, state in zip(equations, states, strict=True):
        made_gases = {
            formula for formula in SOLUBLE_GASES & separate & set(equation.products) if state.get(formula) == "g"
        }
        changes: Counter[str] = Counter()
        for formula, many, phase in equation.terms(state):
            is_whole = phase in ("s", "g") and formula not in made_gases
            for component, count in ({formula: 1} if is_whole else dissolved_components(formula)).items():
                changes[component] += many * count
        does_cancel = not {component for component, many in changes.items() if many} - {WATER}
        (leaving_gases if does_cancel else settling_gases).update(made_gases)
    return settling_gases - leaving_gases


def _dissolved_gas(changes: Mapping[str, float], phases: Phases) -> float:
    """mol/kg of its gas under one atmosphere, in mol of a reaction, that stays dissolved before any leaves."""
    for column, many in changes.items():
        formula = column.removesuffix(GAS)
        if phases.database is None or many <= 0.0 or formula not in SOLUBLE_GASES or not column.endswith(GAS):
            continue
        gas, molecule = phases.entry(formula, "g"), phases.dissolved_species(formula)
        if gas is not None and molecule is not None:
            return float(10.0 ** (gas.log_k + molecule.log_k)) / many
    return 0.0


def _process(table: Declaration, equation: Equation, phase: Mapping[str, str], phases: Phases) -> Process | None:
    """Process of what an equation changes beyond the equilibrium; ``None``: PHREEQC or a solubility does all."""
    rate_per_s, heat = table["rate_per_s"], table["heat_kj_mol"]
    salt = _dissolving_salt(equation, phase, phases) if rate_per_s is not None else None
    changes = _changes_beyond_equilibrium(equation, phase, phases, {salt.column} if salt is not None else set())
    if not changes:
        unknown_solids = [
            formula
            for formula in equation.reagents
            if phase.get(formula) == "s" and not phases.has_known_solubility(formula)
        ]
        if unknown_solids:
            raise table.fail(UNKNOWN_SOLUBILITY.format(unknown_solids[0]))
        can_settle = any(_can_settle(formula, phase) for formula in equation.formulas)
        if not can_settle and not _makes_neutral_complex(equation, phases):
            raise table.fail(
                "equation: by PHREEQC's data all of it stays dissolved; mark what falls out with (s), or leave the "
                "equation out"
            )
        if rate_per_s is not None:
            raise table.fail("rate_per_s: PHREEQC brings what the equation names to equilibrium at once; leave it out")
        if heat is not None and not _dissolved_solid(equation, phase, phases):
            raise table.fail("heat_kj_mol: its heat follows from PHREEQC's enthalpies; leave it out")
        return None
    _check_dissolving(table, equation, phase, salt)
    joule = -salt.joule if salt is not None else enthalpy_j(changes)
    acid = sum(
        many * _protons_brought(formula)
        for formula, many in equation.reagents.items()
        if formula != WATER and phase.get(formula) not in ("s", "g")
    )
    gas_solubility = _dissolved_gas(changes, phases)
    return Process(
        text=table["equation"],
        changes=changes,
        rate=rate_per_s,
        joule=joule,
        acid=float(acid),
        salt=salt,
        catalysts=_catalyst_columns(equation, phase),
        gas_solubility=gas_solubility,
        dissolving_solid="" if rate_per_s is None else phases.dissolves_slowly(changes),
    )


def _protons_brought(formula: str) -> int:
    """Protons of a dissolved formula, below 0 the hydroxide that it brings: an anion of a weak acid brings neither."""
    components = dissolved_components(formula)
    protons = components.get(PROTON, 0)
    is_anion = charge_of(formula) < 0 and bool(set(components) & ACIDS)
    return 0 if is_anion and protons < 0 else protons


def _catalyst_columns(equation: Equation, phase: Mapping[str, str]) -> frozenset[str]:
    """Columns of what stands on both sides of an equation: it is not used up, and nothing proceeds without it."""
    unchanged_formulas = [
        formula
        for formula in equation.reagents
        if formula != WATER and formula not in equation.dissolved and not equation.changes[formula]
    ]
    columns: set[str] = set()
    for formula in unchanged_formulas:
        state = phase.get(formula, "")
        solutes = solute_components(formula) or dissolved_components(formula)
        columns |= {f"{formula}({state})"} if state in ("s", "g") else set(solutes)
    return frozenset(columns)


def _can_settle(formula: str, phase: Mapping[str, str]) -> bool:
    """Whether a formula is more than ions that stay as they are: a solid, a gas, an acid or base, a complex."""
    if phase.get(formula) in ("s", "g"):
        return True
    components = dissolved_components(formula)
    return PROTON in components or bool(charge_of(formula) and len(components) > 1) or bool(BASES & set(components))


def _makes_neutral_complex(equation: Equation, phases: Phases) -> bool:
    """Whether an equation makes of ions a complex without charge that PHREEQC knows: ``Al3+ + 3 F- -> AlF3``."""
    if phases.database is None or not any(charge_of(formula) for formula in equation.reagents):
        return False
    return any(
        phases.dissolved_species(formula) is not None
        for formula in equation.products
        if len(solute_components(formula)) > 1
    )


def _dissolved_solid(equation: Equation, phase: Mapping[str, str], phases: Phases) -> str:
    """Column of the solid that an equation dissolves and nothing else; ``""``: another equation."""
    solids = [formula + SOLID for formula in equation.reagents if phase.get(formula) == "s"]
    is_alone = len(solids) == 1 and not {formula + SOLID for formula in set(equation.reagents) - {WATER}} - set(solids)
    return solids[0] if is_alone and solids[0] in (*phases.salts, *phases.phreeqc) else ""


def _dissolving_salt(equation: Equation, phase: Mapping[str, str], phases: Phases) -> Salt | None:
    """The salt that an equation dissolves and nothing else."""
    return phases.salts.get(_dissolved_solid(equation, phase, phases))


def _check_dissolving(table: Declaration, equation: Equation, phase: Mapping[str, str], salt: Salt | None) -> None:
    """Raises PlanError: an equation dissolves a solid of which nobody knows how much dissolves."""
    solids = [formula for formula in equation.reagents if phase.get(formula) == "s"]
    if salt is not None or len(solids) != 1 or set(equation.reagents) - {solids[0], WATER}:
        return
    components = dissolved_components(solids[0])
    made_components: dict[str, float] = {}
    for formula, many in equation.products.items():
        for component, count in dissolved_components(formula).items():
            made_components[component] = made_components.get(component, 0.0) + count * many
    coefficient = equation.reagents[solids[0]]
    if {component: many for component, many in made_components.items() if component != WATER} == {
        component: many * coefficient for component, many in components.items() if component != WATER
    }:
        # An oxide of an alkali or earth metal reacts with water to its end, and so does an anhydride.
        is_basic = components.get(WATER, 0) > 0 > components.get(PROTON, 0) and set(components) <= EARTH_METALS | {
            WATER,
            PROTON,
        }
        is_anhydride = components.get(WATER, 0) < 0 < components.get(PROTON, 0) and not METALS & set(components)
        if WATER in equation.reagents and (is_basic or is_anhydride):
            return
        raise table.fail(UNKNOWN_SOLUBILITY.format(solids[0]))


def _changes_beyond_equilibrium(
    equation: Equation, phase: Mapping[str, str], phases: Phases, separate: set[str]
) -> dict[str, float]:
    """Column -> what one mol of reaction makes beyond what is at equilibrium anyway; ions that only look on cancel."""
    changes: dict[str, float] = {}
    for formula, coefficient, state in equation.terms(phase):
        column = f"{formula}({state})"
        if state in ("s", "g") and (column in separate or column not in (*phases.phreeqc, *phases.salts)):
            components: Mapping[str, int] = {column: 1}
        else:
            components = dissolved_components(formula)
        for component, many in components.items():
            changes[component] = changes.get(component, 0.0) + coefficient * many
    return {component: many for component, many in changes.items() if many != 0.0} if set(changes) - {WATER} else {}


def _dissolved_columns(
    contents: Mapping[str, Contents], reactions: Sequence[Reaction], processes: Sequence[Process], phases: Phases
) -> set[str]:
    """Everything that may be dissolved."""
    formulas = [formula for content in contents.values() for formula in content.amounts]
    formulas += [
        formula
        for reaction in reactions
        for formula in reaction.equation.formulas
        if reaction.phases.get(formula) != "s"
    ]
    columns = {component for formula in formulas for component in dissolved_components(formula)}
    columns |= {column for process in processes for column in process.changes if not column.endswith((SOLID, GAS))}
    return columns | {component for salt in phases.salts.values() for component in salt.components}
