"""What the tables of a scene say of its chemistry, in the columns of the ledger; what does not fit together is refused.

Raised are PlanErrors of the table concerned, with the nearest name: at the plan already, not in the run.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from replay.effects.contents import WATER, Contents, contents_of_scene
from replay.effects.declaring import Declaration
from replay.effects.models.equation import COMMON, Equation, charge_of, equation_of
from replay.effects.models.ledger import BROUGHT, Ledger, Process, Warmth
from replay.effects.models.speciation import GAS, PROTON, SOLID, Speciation, enthalpy_j, gas_parts, speciation_of
from replay.effects.models.species import GASES, HENRY, HYDROLYSIS, IONS, KSP, SOLIDS, Chemistry
from replay.effects.vessels import check_vessels, vessel_names
from sessions.model.scene import Scene
from sessions.scene_files.toml_table import nearest

Tables = Mapping[str, tuple[Declaration, ...]]


@dataclass(frozen=True, eq=False)
class Reaction:
    """One table of an effect reaction."""

    declared: Declaration
    equation: Equation
    process: int  # its place among the ledger's processes; -1: it is at equilibrium, by constants
    asks_ph: bool  # it has an acid, a base, or a metal ion that water takes apart


@dataclass(frozen=True, eq=False)
class Recipe:
    """What all tables make together."""

    reactions: tuple[Reaction, ...]
    processes: tuple[Process, ...]
    contents: Mapping[str, Contents]  # vessel -> what is in it at first
    chemistry: Chemistry  # all acids and bases of all tables
    speciation: Speciation

    def ledger(self, along: float, warmth: Warmth) -> Ledger:
        """A ledger with everything in its vessels."""
        fills = {name: self._columns(one) for name, one in self.contents.items()}
        columns = tuple(column for there in fills.values() for column in there)
        made = Ledger(tuple(fills), columns, self.processes, self.speciation, along, warmth)
        for name, there in fills.items():
            made.fill(name, self.contents[name].volume_ml, there)
        return made

    def _columns(self, contents: Contents) -> dict[str, float]:
        found = {formula + BROUGHT: amount for formula, amount in contents.amounts.items() if formula != WATER}
        found |= {formula + SOLID: amount for formula, amount in contents.solids.items()}
        for formula, amount in contents.amounts.items():
            for part, many in self.chemistry.dissolved(formula).items():
                found[part] = found.get(part, 0.0) + many * amount
        return found


def recipe_of(tables: Tables, contents: Mapping[str, Contents]) -> Recipe:
    """Read the tables of reactions, precipitations and gases against what stands in the vessels.

    Raises PlanError: an equation, formula or product that fits nothing, or a constant that is missing.
    """
    declared, precipitates = tables.get("reaction", ()), tables.get("precipitation", ())
    chemistry = _chemistry(declared)
    ksp = {**KSP, **{one["solid"]: one["ksp"] for one in precipitates if one["ksp"]}}
    named = {*(one["solid"] for one in precipitates), *(solid for one in contents.values() for solid in one.solids)}
    gases = GASES | {one["gas"] for one in tables.get("gas", ())}
    usual = {**dict.fromkeys(SOLIDS | named, "s"), **dict.fromkeys(gases, "g")}
    equations = []
    for one in declared:
        try:
            equations.append(equation_of(one["equation"], IONS))
        except ValueError as error:
            raise one.fail(f"equation: {error}") from error
    phases = [{**usual, **one.phases} for one in equations]
    meant = {(formula, "s") for formula in named}
    for equation, phase in zip(equations, phases, strict=True):
        meant |= {(formula, phase.get(formula, "")) for formula in equation.formulas}
    products = {
        formula: ksp[formula] for formula, phase in sorted(meant)
        if phase == "s" and formula in ksp and chemistry.parts(formula) is not None
    }  # fmt: skip
    bubbling = sorted(formula for formula, phase in meant if phase == "g" and formula in HENRY)
    processes: list[Process] = []
    reactions = []
    for one, equation, phase in zip(declared, equations, phases, strict=True):
        changes = _changes(equation, phase, chemistry, (*products, *bubbling))
        falls = any(formula in products for formula in equation.formulas)
        asks_ph = any(_gives_ph(chemistry, formula) for formula in equation.reagents)
        if not (changes or falls or asks_ph):
            raise one.fail("equation: nothing happens, all of it stays dissolved; mark what falls out with (s)")
        if one["rate_per_s"] is not None and not changes:
            what = "a solid with a solubility product falls out" if falls else "acids and bases meet"
            raise one.fail(f"rate_per_s: {what} at once; leave it out")
        if one["heat_kj_mol"] is not None and not changes:
            raise one.fail("heat_kj_mol: its heat follows from tables, for it has constants; leave it out")
        joule = enthalpy_j(changes) if one["heat_kj_mol"] is None else 1e3 * one["heat_kj_mol"]
        process = Process(one["equation"], changes, one["rate_per_s"], joule)
        if changes and process not in processes:
            processes.append(process)
        place = processes.index(process) if changes else -1
        reactions.append(Reaction(one, equation, place, asks_ph))
    formulas = [*products, *(formula for one in contents.values() for formula in one.amounts)]
    columns = {part for formula in formulas for part in chemistry.dissolved(formula)}
    columns |= {column for process in processes for column in process.changes if not column.endswith((SOLID, GAS))}
    columns |= {HENRY[formula][0] for formula in bubbling}
    speciation = speciation_of(chemistry, sorted(columns), products, bubbling)
    return Recipe(tuple(reactions), tuple(processes), contents, chemistry, speciation)


def _chemistry(declared: Sequence[Declaration]) -> Chemistry:
    """Acids and bases of all tables; of one thing they say the same."""
    told: dict[str, dict[str, Any]] = {"acids": {}, "bases": {}}
    for one in declared:
        for key, known in told.items():
            for formula, value in one[key].items():
                if known.setdefault(formula, value) != value:
                    words = f"{value!r} and another table says {known[formula]!r}; give it once"
                    raise one.fail(f"{key}.{formula} is {words}")
    acids = {formula: tuple(map(float, steps)) for formula, steps in told["acids"].items()}
    return Chemistry(acids, told["bases"])


def _gives_ph(chemistry: Chemistry, formula: str) -> bool:
    parts = chemistry.parts(formula) or {}
    return bool(parts.get(PROTON)) or chemistry.is_base(formula) or any(part in HYDROLYSIS for part in parts)


def check_chemistry(tables: Tables, scene: Scene, file: str) -> None:
    """Raises PlanError: a table, or a formula in a vessel, that fits nothing else in the scene."""
    check_vessels(tables, scene, file)
    recipe = recipe_of(tables, contents_of_scene(scene, file))
    for one in recipe.reactions:
        _check_brought(one, recipe)
    _check_made(tables, recipe)
    _check_known(recipe)
    _check_decided(recipe)
    for declared in tables.get("colour", ()):
        if not any(one.asks_ph for one in recipe.reactions):
            raise declared.fail(f"no reaction of an acid or base gives {declared['in']!r} a pH; declare one")
    followed = vessel_names(tables)
    for declared, key in (
        *((one, "in") for one in tables.get("colour", ())), *((one, "from") for one in tables.get("gas", ())),
    ):  # fmt: skip
        if declared[key] not in followed:
            words = f"{key}: nothing is mixed in {declared[key]!r}; name it in an effect mixing, pour or burette"
            raise declared.fail(words + nearest(declared[key], followed))
    for declared in tables.get("heat", ()):
        if declared["solute"]:
            _check_diluted(declared, recipe.contents)
        if declared["of"] == "neutralisation":
            _check_heat(declared, recipe)


def _check_heat(declared: Declaration, recipe: Recipe) -> None:
    """Raises PlanError: a heat of what does not happen, or whose constants are missing."""
    if not recipe.reactions:
        raise declared.fail("of: no effect reaction says what gives the heat; declare one")
    for one in recipe.reactions:
        if one.process >= 0 and np.isnan(recipe.processes[one.process].joule):
            raise one.declared.fail(
                "heat_kj_mol is missing: no table knows the enthalpies of formation of its formulas"
            )
    speciation = recipe.speciation
    for name, joule in zip((*speciation.mixture.species, *speciation.mixture.phases), speciation.joule, strict=True):
        if np.isnan(joule):
            raise declared.fail(
                f"of: no table knows the enthalpies of {name!r} and of what it makes; leave the heat out"
            )


def _check_diluted(declared: Declaration, contents: Mapping[str, Contents]) -> None:
    solute, there = declared["solute"], {formula for held in contents.values() for formula in held.amounts}
    if solute not in there:
        raise declared.fail(f"solute: nobody brings {solute!r}{nearest(solute, there - {WATER})}")
    for name, held in contents.items():
        if solute in held.amounts and WATER not in held.amounts:
            raise declared.fail(
                f"nothing says how much water is with the {solute} in {name!r}; "
                "give liquid.water_molar, mol of water per litre of the solution"
            )


def _changes(
    equation: Equation, phases: Mapping[str, str], chemistry: Chemistry, equilibrated: Sequence[str]
) -> dict[str, float]:
    """Column -> what one mol of reaction makes beyond what is at equilibrium anyway; ions that only look on cancel."""
    found: dict[str, float] = {}
    for formula, coefficient in equation.changes.items():
        phase = phases.get(formula, "")
        if phase == "g" and formula in equilibrated:
            parts: Mapping[str, float] = gas_parts(formula)
        elif phase in ("s", "g") and formula not in equilibrated:
            parts = {f"{formula}({phase})": 1}
        else:
            parts = chemistry.dissolved(formula)
        for part, many in parts.items():
            found[part] = found.get(part, 0.0) + coefficient * many
    return {part: many for part, many in found.items() if many != 0.0}


def _check_brought(one: Reaction, recipe: Recipe) -> None:
    """Every reagent stands in a vessel, under this formula or as some of its ions, or another equation makes it."""
    declared, equation, chemistry = one.declared, one.equation, recipe.chemistry
    there = {formula for held in recipe.contents.values() for formula in (*held.amounts, *held.solids)} | {WATER}
    there |= {formula for other in recipe.reactions if other is not one for formula in other.equation.products}
    parts = [dict(chemistry.dissolved(formula)) for formula in there]
    # A base brings protons below nothing, and water that it takes apart gives both.
    ions = {(part, many > 0) for held in parts for part, many in held.items()}
    basic = any(chemistry.is_base(formula) for formula in there)

    for formula in equation.reagents:
        mine = dict(chemistry.dissolved(formula))
        as_ions = charge_of(formula) and all(
            (part, many > 0) in ions or part == WATER or (part == PROTON and basic) for part, many in mine.items()
        )
        if not (formula in there or mine in parts or as_ions):
            raise declared.fail(f"equation: nobody brings {formula!r}{nearest(formula, there - {WATER})}")
    known = there.union(equation.formulas)
    for key in ("acids", "bases"):
        for formula in declared[key]:
            if formula not in known and dict(chemistry.dissolved(formula)) not in parts:
                raise declared.fail(f"{key}: nobody brings {formula!r}{nearest(formula, known - {WATER})}")


def _check_made(tables: Tables, recipe: Recipe) -> None:
    phases = recipe.speciation.mixture.phases
    made = {
        formula for one in recipe.reactions for formula in one.equation.formulas
        if formula in one.equation.products or formula + SOLID in phases
    }  # fmt: skip
    for one in tables.get("precipitation", ()):
        if one["solid"] + SOLID not in phases:
            raise one.fail(f"ksp is missing: no table knows {one['solid']!r}, or which ions it is of")
    for kind, key in (("precipitation", "solid"), ("gas", "gas")):
        for one in tables.get(kind, ()):
            if one[key] not in made:
                raise one.fail(f"{key}: no reaction makes {one[key]!r}{nearest(one[key], made)}")


def _check_decided(recipe: Recipe) -> None:
    """Raises PlanError: equations without a constant that want the same, so that their order would decide."""
    at_once = [
        (one, recipe.processes[one.process]) for one in recipe.reactions
        if one.process >= 0 and one.declared["rate_per_s"] is None
    ]  # fmt: skip
    rivals = [(process.text, process.changes) for _, process in at_once]
    names = [name.removesuffix(SOLID).removesuffix(GAS) for name in recipe.speciation.mixture.phases]
    rivals += [(repr(name), changes) for name, changes in zip(names, recipe.speciation.changes, strict=True)]
    for one, process in at_once:
        solid = next((column for column, many in process.changes.items() if column.endswith(SOLID) and many > 0.0), "")
        missing = f"the ksp of {solid.removesuffix(SOLID)!r} is" if solid else "rate_per_s is"
        for text, changes in rivals:
            shared = sorted(_used(process.changes) & _used(changes))
            if shared and changes is not process.changes:
                words = f"{text} wants {shared[0]} too, and nothing says which gets it"
                raise one.declared.fail(f"{missing} missing: {words}")


def _used(changes: Mapping[str, float]) -> set[str]:
    return {column for column, many in changes.items() if many < 0.0 and column != WATER}


def _check_known(recipe: Recipe) -> None:
    """Where a pH is asked for, every dissolved formula has its part in it."""
    asking, chemistry = [one for one in recipe.reactions if one.asks_ph], recipe.chemistry
    for name, held in recipe.contents.items() if asking else ():
        for formula in held.amounts:
            if not chemistry.known(formula):
                raise asking[0].declared.fail(
                    f"the pH needs data of {formula!r} in {name!r}; give acids = {{ {formula} = [pKa, ...] }} or "
                    f"bases, or acids = {{ {formula} = [] }} if it neither gives nor takes protons"
                    f"{nearest(formula, (*COMMON, *chemistry.acids, *chemistry.bases))}"
                )
