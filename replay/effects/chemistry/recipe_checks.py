"""Checks of a scene's chemistry: tables, formulas and numbers that fit nothing else in the scene are refused.

Raised are PlanErrors of the table concerned, with the nearest name: at the plan already, not in the run.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from replay import words
from replay.effects.chemistry.components import (
    ACIDS,
    INERT_FORMULAS,
    METALS,
    PROTON,
    WATER,
    component_of,
    components_of,
    dissolved_components,
    dry_components,
    is_known,
    solute_components,
)
from replay.effects.chemistry.contents import contents_of_scene
from replay.effects.chemistry.formulas import COMMON_FORMULAS, atoms, charge_of, crystal_water
from replay.effects.chemistry.ledger_columns import UNFOLLOWED_WARMTH, WITHOUT_HEAT_C
from replay.effects.chemistry.mixture import GAS, SOLID
from replay.effects.chemistry.processes import Process
from replay.effects.chemistry.recipe import UNKNOWN_SOLUBILITY, Reaction, Recipe, Tables, recipe_of
from replay.effects.chemistry.salts import anhydrous
from replay.effects.colour_tables import coloured_species
from replay.effects.declaring import Declaration
from replay.effects.flame import heat_of_ledger
from replay.effects.temperatures import liquid_boils
from replay.effects.vessels import Vessel, check_vessels, vessel_names
from replay.errors import PlanError
from sessions.input_files import nearest
from sessions.model.scene import Scene


def check_chemistry(tables: Tables, scene: Scene, file: str) -> None:
    """Raises PlanError: a table, or a formula in a vessel, that fits nothing else in the scene."""
    check_vessels(tables, scene, file)
    contents = contents_of_scene(scene, file)
    recipe = recipe_of(tables, contents)
    for reaction in recipe.reactions:
        _check_brought(reaction, recipe)
        _check_complexes(reaction, recipe)
        _check_basic_salts(reaction, recipe)
    _check_made(tables, recipe)
    _check_known(tables, recipe)
    _check_solids(tables, recipe, file)
    _check_decided(recipe)
    followed_vessels = vessel_names(tables)
    for declared in tables.get("colour", ()):
        vessel = declared["in"]
        if vessel not in followed_vessels:
            problem = f"in: nothing is mixed in {vessel!r}; name it in an effect mixing, pour or burette"
            raise declared.fail(problem + nearest(vessel, followed_vessels))
        _check_coloured_species(declared, recipe)
    followed_heat = heat_of_ledger(tables)
    if followed_heat is not None:
        _check_heat(recipe, file)
        _check_temperatures(followed_heat, recipe, scene)
        _check_heated(followed_heat, tables, recipe, scene)
    if followed_heat is None and (recipe.salts or recipe.reactions or recipe.solver is not None):
        _check_no_temperature(vessel_names(tables), scene, file)


def _check_coloured_species(declared: Declaration, recipe: Recipe) -> None:
    """Raises PlanError: nothing brings or makes the species whose colour a table declares."""
    if not declared["species"]:
        return
    species = coloured_species(declared["species"])
    columns = recipe.ledger(0.0, UNFOLLOWED_WARMTH).column
    is_computed = recipe.solver is not None and recipe.solver.mixture.row_of(species) is not None
    if species not in columns and not is_computed:
        raise declared.fail(
            f"species: no vessel holds {species!r} and no equation makes it; add the reaction that makes it, or name "
            f"an ion that is there{nearest(species, [name for name in columns if charge_of(name)])}"
        )


def _check_solids(tables: Tables, recipe: Recipe, file: str) -> None:
    """Raises PlanError: a salt or molecule stands in a vessel, and nothing says how much of it dissolves."""
    if not any(tables.get(kind) for kind in ("reaction", "precipitation", "colour", "heat")):
        return
    known = {salt.column for salt in recipe.salts} | {
        column for process in recipe.processes for column in process.changes
    }
    if recipe.solver is not None:
        known |= {phase.column for phase in recipe.solver.mixture.phases}
    named = {formula for reaction in recipe.reactions for formula in reaction.equation.reagents}
    for name in vessel_names(tables):
        for solid in recipe.contents[name].solids if name in recipe.contents else ():
            is_ionic = recipe.solver is not None and components_of(solid) is not None
            if (is_ionic or solid in INERT_FORMULAS) and solid + SOLID not in known and solid not in named:
                raise PlanError(f"{file}: body {name!r}: {UNKNOWN_SOLUBILITY.format(solid)}")


def _check_heat(recipe: Recipe, file: str) -> None:
    """Raises PlanError: the heat of an equation is not known."""
    for reaction in recipe.reactions:
        if reaction.process >= 0 and np.isnan(recipe.processes[reaction.process].joule):
            raise reaction.declared.fail(
                "heat_kj_mol is missing: no table knows the enthalpies of formation of its formulas"
            )
    unknown = [salt.formula for salt in recipe.salts if np.isnan(salt.joule)]
    if unknown:
        solid = unknown[0]
        problem = f"no table knows the enthalpy of dissolving {solid!r}"
        equation = f"{solid}(s) -> {anhydrous(solid)}"
        if crystal_water(solid):
            equation += f" + {crystal_water(solid)} H2O"
        for reaction in recipe.reactions:
            if reaction.equation.reagents.keys() - {WATER} == {solid}:
                raise reaction.declared.fail(f"heat_kj_mol is missing: {problem}")
        raise PlanError(
            f'{file}: {problem}; declare it: [[effect]] kind = "reaction", equation = "{equation}", heat_kj_mol = ...'
        )


def _check_temperatures(declared: Declaration, recipe: Recipe, scene: Scene) -> None:
    """Raises PlanError: a liquid is colder at first than it freezes, or hotter than it boils."""
    ledger = recipe.ledger(0.0, UNFOLLOWED_WARMTH)
    top = liquid_boils(declared)
    for name, contents in recipe.contents.items():
        body = scene.body(name)
        if contents.volume_ml <= 0.0 or body is None:
            continue
        celsius = Vessel(body).celsius(declared["ambient_c"])
        bottom = 0.0 + float(ledger.freezing_point_c(ledger.amounts[[ledger.at[name]]])[0])
        if not bottom <= celsius <= top:
            raise declared.fail(
                f"the liquid in {name!r} has {celsius:g} degC at first; it is a liquid between "
                f"{words.decimal(bottom, 1)} and {top:g} degC: give temperature_c of the body, or ambient_c"
            )


def _check_heated(declared: Declaration, tables: Tables, recipe: Recipe, scene: Scene) -> None:
    """Raises PlanError: a vessel has a temperature of its own, and nothing in it that keeps one."""
    for name in vessel_names(tables):
        body = scene.body(name)
        contents = recipe.contents.get(name)
        if body is None or (contents is not None and (contents.volume_ml > 0.0 or contents.solids)):
            continue
        vessel = Vessel(body)
        celsius = vessel.celsius(declared["ambient_c"])
        if celsius != declared["ambient_c"] and vessel.glass_j_per_k <= 0.0:
            raise declared.fail(
                f"{name!r} is empty and has temperature_c = {celsius:g}: give properties.heat_capacity_j_per_k, the "
                "heat that the vessel keeps, or leave temperature_c out"
            )


def _check_no_temperature(names: Sequence[str], scene: Scene, file: str) -> None:
    """Raises PlanError: a vessel has a temperature of its own, and no effect follows it."""
    for name in names:
        body = scene.body(name)
        celsius = WITHOUT_HEAT_C if body is None else Vessel(body).celsius(WITHOUT_HEAT_C)
        if celsius != WITHOUT_HEAT_C:
            raise PlanError(
                f"{file}: body {name!r} has temperature_c = {celsius:g} and no effect follows it: what dissolves and "
                f'reacts would be that of {WITHOUT_HEAT_C:g} degC; add [[effect]] with kind = "heat", of = "liquids"'
            )


def _check_brought(reaction: Reaction, recipe: Recipe) -> None:
    """Every reagent stands in a vessel, under this formula or as some of its ions, or another equation makes it."""
    declared, equation = reaction.declared, reaction.equation
    available = {formula for content in recipe.contents.values() for formula in (*content.amounts, *content.solids)} | {
        WATER
    }
    available |= {formula for other in recipe.reactions if other is not reaction for formula in other.equation.products}
    components = [dry_components(dissolved_components(formula)) for formula in available]
    # A base brings protons below nothing, and water that it takes apart gives both.
    ions = {(component, many > 0) for counts in components for component, many in counts.items()}
    for formula in equation.reagents:
        mine = dry_components(dissolved_components(formula))
        # An ion that stands in a vessel may hold protons or none; a salt is there where all of its ions are.
        needed_ions = [(component, many > 0) for component, many in mine.items() if component != PROTON]
        dissolved = components_of(formula) is not None and reaction.phases.get(formula) not in ("s", "g")
        is_ionic = bool(charge_of(formula)) or (bool(METALS & set(mine)) and PROTON not in mine)
        # A weak acid is there where its anion meets a stronger one: oxalic acid of sodium oxalate in sulfuric acid; a
        # weak base where its ion meets a stronger one.
        brings_protons = bool({(PROTON, True), (PROTON, False)} & ions)
        freed = brings_protons and bool(needed_ions) and not METALS & set(mine)
        as_ions = dissolved and (is_ionic or freed) and set(needed_ions) <= ions
        if charge_of(formula) and components_of(formula) is None and recipe.solver is not None:
            raise declared.fail(f"equation: PHREEQC's data do not know {formula!r}; take an ion that they know")
        if not (formula in available or mine in components or as_ions):
            others = available - {WATER}
            advice = nearest(formula, others) if others else "; the vessels hold water alone"
            if needed_ions and {name for name, _ in needed_ions} <= {name for name, _ in ions}:
                advice = f"; its ions are there: write the equation that makes {formula} as well"
            raise declared.fail(f"equation: nobody brings {formula!r}{advice}")


def _check_complexes(reaction: Reaction, recipe: Recipe) -> None:
    """Raises PlanError: PHREEQC has no constant of an ion that an equation makes."""
    if recipe.solver is None or reaction.process >= 0:
        return
    for formula in reaction.equation.products:
        components = components_of(formula)
        if (
            charge_of(formula)
            and components is not None
            and recipe.solver.mixture.row_of(formula) is None
            and len(components) > 1
        ):
            raise reaction.declared.fail(
                f"equation: PHREEQC's data do not know {formula!r}; give its log_k as a piece of PHREEQC text, "
                "phreeqc = '''SOLUTION_SPECIES ...'''"
            )


def _check_basic_salts(reaction: Reaction, recipe: Recipe) -> None:
    """Raises PlanError: an equation makes a basic salt that no data know, and that would stay dissolved as its ions."""
    if recipe.solver is None or reaction.process >= 0:
        return
    mixture = recipe.solver.mixture
    for formula in reaction.equation.products:
        components, solutes = components_of(formula), solute_components(formula)
        known = formula + SOLID in {phase.column for phase in mixture.phases} or mixture.row_of(formula) is not None
        # A borate or silicate takes protons from its acid, and is no basic salt.
        if charge_of(formula) or components is None or known or len(solutes) < 2 or ACIDS & set(solutes):
            continue
        if components.get(PROTON, 0) >= 0 or not METALS & set(solutes) or set(solutes) <= METALS:
            continue
        basic = sorted(
            entry.equation.split()[0]
            for entry in mixture.database.phases.values()
            if set(entry.makeup) - {PROTON, WATER} == set(solutes) and entry.makeup.get(PROTON, 0.0) < 0.0
        )
        others = f"; of its ions they have {' and '.join(basic)}" if basic else ""
        raise reaction.declared.fail(
            f"equation: PHREEQC's data do not know how much {formula!r} dissolves{others}; write the equation with a "
            "solid that they know, or give its log_k, phreeqc = '''PHASES ...'''"
        )


def _check_made(tables: Tables, recipe: Recipe) -> None:
    mixture = None if recipe.solver is None else recipe.solver.mixture
    formed = {salt.column for salt in recipe.salts} | {phase.column for phase in (mixture.phases if mixture else ())}
    made = {
        formula
        for reaction in recipe.reactions
        for formula in reaction.equation.formulas
        if formula in reaction.equation.products or formula + SOLID in formed
    }
    brought = {formula for content in recipe.contents.values() for formula in (*content.amounts, *content.solids)}
    ions = {component for formula in (*brought, *made) for component in solute_components(formula)}
    # What PHREEQC or a solubility lets fall out needs no equation.
    made |= {
        table["solid"]
        for table in tables.get("precipitation", ())
        if table["solid"] + SOLID in formed and set(solute_components(table["solid"])) <= ions
    }
    for table in tables.get("precipitation", ()):
        if table["solid"] + SOLID not in formed and not any(
            table["solid"] + SOLID in process.changes for process in recipe.processes
        ):
            raise table.fail(
                f"solid: PHREEQC's data do not know {table['solid']!r}; give it in PHASES of `phreeqc` of a reaction, "
                "or solid.solubility_g_100g to a body that holds it"
            )
    for table in tables.get("precipitation", ()):
        if table["solid"] not in made:
            raise table.fail(f"solid: no reaction makes {table['solid']!r}{nearest(table['solid'], made)}")


def _check_decided(recipe: Recipe) -> None:
    """Raises PlanError: equations without a constant that want the same, so that their order would decide.

    Beside what PHREEQC brings to equilibrium, an equation that stops at its own equilibrium leaves no choice.
    """
    at_once = [
        (reaction, recipe.processes[reaction.process])
        for reaction in recipe.reactions
        if reaction.process >= 0 and reaction.declared["rate_per_s"] is None
    ]
    equations: list[tuple[str, Mapping[str, float]]] = [(process.text, process.changes) for _, process in at_once]
    phases: list[tuple[str, Mapping[str, float]]] = []
    if recipe.solver is not None:
        mixture = recipe.solver.mixture
        phases = [
            (repr(phase.column[:-3]), changes) for phase, changes in zip(mixture.phases, mixture.changes, strict=True)
        ]
    for reaction, process in at_once:
        has_equilibrium = np.isfinite(process.log_k) and not any(name.endswith(GAS) for name in process.changes)
        rivals = equations if has_equilibrium else equations + phases
        for text, changes in rivals:
            own = text.strip("'") in reaction.equation.formulas
            shared = sorted(_consumed_columns(process.changes) & _consumed_columns(changes))
            if shared and changes is not process.changes and not own:
                formula = recipe.reagent(reaction.process, shared[0]).removesuffix(SOLID)
                raise reaction.declared.fail(
                    f"{text} uses {formula} at once too, and nothing says which comes first; "
                    f"give {_missing_key(process)}, or leave one of them out"
                )


def _missing_key(process: Process) -> str:
    """Names the key that parts a process from others of its reagent: the constant of a solid, or a rate."""
    solids = [column for column in process.changes if column.endswith(SOLID)]
    is_precipitation = len(solids) == 1 and process.changes[solids[0]] > 0.0
    return f"the log_k of {solids[0].removesuffix(SOLID)} in phreeqc" if is_precipitation else "rate_per_s"


def _consumed_columns(changes: Mapping[str, float]) -> set[str]:
    return {column for column, many in changes.items() if many < 0.0 and column != WATER}


def _check_known(tables: Tables, recipe: Recipe) -> None:
    """Raises PlanError: PHREEQC is asked and does not know a dissolved formula."""
    if recipe.solver is None:
        return
    chemistry_tables = [
        table for kind in ("reaction", "colour", "precipitation", "heat") for table in tables.get(kind, ())
    ]
    for name, content in recipe.contents.items():
        for formula in content.amounts:
            if not is_known(formula):
                meant = [
                    common
                    for common in (*COMMON_FORMULAS, *sorted(INERT_FORMULAS, reverse=True))
                    if atoms(common) == atoms(formula)
                ]
                advice = (
                    f"did you mean {meant[0]!r}?" if meant else "take an acid or base that they know, or leave it out"
                )
                raise chemistry_tables[0].fail(
                    f"PHREEQC's data do not know {formula!r} in {name!r}, which may change the pH; {advice}"
                )
    for reaction in recipe.reactions:
        has_protons = reaction.process >= 0 and PROTON in recipe.processes[reaction.process].changes
        for formula in reaction.equation.products if has_protons else ():
            metal_atoms = {atom for metal in METALS for atom in component_of(metal).heavy_atoms}
            is_salt = bool(charge_of(formula)) or bool(metal_atoms & atoms(formula).keys())
            if is_salt and not is_known(formula) and reaction.phases.get(formula) not in ("s", "g"):
                raise reaction.declared.fail(
                    f"equation: PHREEQC's data do not know {formula!r}, which may change the pH; mark what falls out "
                    "with (s), or leave the equation out"
                )
