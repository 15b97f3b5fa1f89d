"""What the tables of a scene say of its chemistry, in the columns of the ledger; what does not fit together is refused.

Raised are PlanErrors of the table concerned, with the nearest name: at the plan already, not in the run.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from replay.effects.contents import WATER, Contents, contents_of_scene
from replay.effects.declaring import Declaration
from replay.effects.models.acid_base import AcidBase
from replay.effects.models.equation import COMMON, Equation, equation_of
from replay.effects.models.history import NEUTRALISATION, Process
from replay.effects.models.ledger import BROUGHT, SOLID, Ledger
from replay.effects.models.species import GASES, IONS, SOLIDS
from replay.effects.vessels import check_vessels, vessel_names
from sessions.model.scene import Scene
from sessions.scene_files.toml_table import nearest

WATCHED: Final = (("colour", "in"), ("gas", "from"))
"""Kinds that look at one vessel, and the field that names it."""

Tables = Mapping[str, tuple[Declaration, ...]]


@dataclass(frozen=True, eq=False)
class Reaction:
    """One table of an effect reaction."""

    declared: Declaration
    equation: Equation
    chemistry: AcidBase
    process: int  # its place among the ledger's processes; -1: it only takes or gives protons
    per: float  # mol of the process in one mol of the equation

    @property
    def acid_base(self) -> bool:
        """Whether it has an acid or a base, so that a pH is asked for."""
        return any(self.chemistry.is_acid(one) or self.chemistry.is_base(one) for one in self.equation.reagents)


@dataclass(frozen=True, eq=False)
class Recipe:
    """What all tables make together."""

    reactions: tuple[Reaction, ...]
    processes: tuple[Process, ...]
    contents: Mapping[str, Contents]  # vessel -> what is in it at first
    chemistry: AcidBase  # all acids and bases of all tables

    def ledger(self, along: float) -> Ledger:
        """A ledger with everything in its vessels."""
        fills = {name: (one.volume_ml, self._columns(one)) for name, one in self.contents.items()}
        columns = {column: None for _, there in fills.values() for column in there}
        columns.update((column, None) for process in self.processes for column in process.changes)
        made = Ledger(tuple(fills), tuple(columns), self.processes, along)
        for name, (volume, there) in fills.items():
            made.fill(name, volume, there)
        return made

    def _columns(self, contents: Contents) -> dict[str, float]:
        found: dict[str, float] = {}
        for formula, amount in contents.amounts.items():
            for part, many in dissolved(self.chemistry, formula).items():
                found[part] = found.get(part, 0.0) + many * amount
            if formula != WATER:
                found[formula + BROUGHT] = amount
        return found | {formula + SOLID: amount for formula, amount in contents.solids.items()}


def dissolved(chemistry: AcidBase, formula: str) -> Mapping[str, int]:
    """Parts of a formula in solution; one that stays whole is its only part."""
    return chemistry.parts(formula) or {formula: 1}


def recipe_of(tables: Tables, contents: Mapping[str, Contents]) -> Recipe:
    """Read the tables of reactions, precipitations and gases against what stands in the vessels.

    Raises PlanError: an equation, formula or product that fits nothing.
    """
    declared = tables.get("reaction", ())
    equations = [_read(one) for one in declared]
    acids, bases = (_together(declared, key) for key in ("acids", "bases"))
    chemistry = AcidBase({k: tuple(map(float, v)) for k, v in acids.items()}, bases)
    solids = {f for one in contents.values() for f in one.solids}
    solids |= {one.text("solid") for one in tables.get("precipitation", ())}
    gases = {one.text("gas") for one in tables.get("gas", ())}
    processes: list[Process] = [NEUTRALISATION] if declared else []
    reactions = []
    for one, equation in zip(declared, equations, strict=True):
        phases = {**dict.fromkeys(SOLIDS | solids, "s"), **dict.fromkeys(GASES | gases, "g"), **equation.phases}
        changes, per = _left_over(_changes(equation, phases, chemistry))
        rate = one.values["rate_per_s"]
        product = _product(one, changes, tables)
        several = (part for part, many in changes.items() if changes.get("H+", 0.0) <= 2.0 * many < 0.0)
        bound = next((part for part in several if chemistry.pka.get(part)), "")
        process = Process(one.text("equation"), changes, None if rate is None else float(rate), bound, product)
        place = next((k for k, known in enumerate(processes) if _same(known, process)), len(processes))
        if not changes and not any("H+" in dissolved(chemistry, formula) for formula in equation.reagents):
            raise one.fail("equation: nothing happens, all of it stays dissolved; mark what falls out with (s)")
        if changes and place == len(processes):
            processes.append(process)
        # Protons meet hydroxide at once, and what has a solubility product falls out at once.
        if rate is not None and (changes == NEUTRALISATION.changes or not changes or product is not None):
            what = "acids and bases meet" if product is None else "a solid of an effect precipitation falls out"
            raise one.fail(f"rate_per_s: {what} at once; leave it out")
        own = AcidBase(chemistry.acids, chemistry.bases, one.number("pkw"))
        reactions.append(Reaction(one, equation, own, place if changes else -1, per))
    return Recipe(tuple(reactions), tuple(processes), contents, chemistry)


def check_chemistry(tables: Tables, scene: Scene, file: str) -> None:
    """Raises PlanError: a table, or a formula in a vessel, that fits nothing else in the scene."""
    check_vessels(tables, scene, file)
    contents = contents_of_scene(scene, file)
    recipe = recipe_of(tables, contents)
    equations = [one.equation for one in recipe.reactions]
    for one in recipe.reactions:
        _check_brought(one, equations, contents)
    _check_made(tables, equations)
    _check_known(recipe)
    for declared in tables.get("colour", ()):
        if not any(one.acid_base for one in recipe.reactions):
            raise declared.fail(f"no reaction of an acid or base gives {declared.body('in')!r} a pH; declare one")
    followed = vessel_names(tables)
    for declared, key in [(one, key) for kind, key in WATCHED for one in tables.get(kind, ())]:
        if declared.body(key) not in followed:
            words = f"{key}: nothing is mixed in {declared.body(key)!r}; name it in an effect mixing, pour or burette"
            raise declared.fail(words + nearest(declared.body(key), followed))
    for declared in tables.get("heat", ()):
        if declared.text("solute"):
            _check_diluted(declared, contents)


def _check_diluted(declared: Declaration, contents: Mapping[str, Contents]) -> None:
    solute, there = declared.text("solute"), {formula for held in contents.values() for formula in held.amounts}
    if solute not in there:
        raise declared.fail(f"solute: nobody brings {solute!r}{nearest(solute, there - {WATER})}")
    for name, held in contents.items():
        if solute in held.amounts and WATER not in held.amounts:
            raise declared.fail(
                f"nothing says how much water is with the {solute} in {name!r}; "
                "give liquid.water_molar, mol of water per litre of the solution"
            )


def _together(declared: Sequence[Declaration], key: str) -> dict[str, Any]:
    """What all tables say of acids or bases; of one formula they say the same."""
    found: dict[str, Any] = {}
    for one in declared:
        for formula, value in one.mapping(key).items():
            if found.setdefault(formula, value) != value:
                raise one.fail(f"{key}.{formula} is {value!r} and another table says {found[formula]!r}; give it once")
    return found


def _read(declared: Declaration) -> Equation:
    try:
        return equation_of(declared.text("equation"), IONS)
    except ValueError as error:
        raise declared.fail(f"equation: {error}") from error


def _changes(equation: Equation, phases: Mapping[str, str], chemistry: AcidBase) -> dict[str, float]:
    """Column -> what one mol of reaction makes; ions that only look on cancel."""
    found: dict[str, float] = {}
    for sign, side in ((-1.0, equation.reagents), (1.0, equation.products)):
        for formula, coefficient in side.items():
            phase = phases.get(formula, "")
            parts = {formula + f"({phase})": 1} if phase in ("s", "g") else dissolved(chemistry, formula)
            for part, many in parts.items():
                found[part] = found.get(part, 0.0) + sign * coefficient * many
    return {part: many for part, many in found.items() if many != 0.0}


def _left_over(changes: dict[str, float]) -> tuple[dict[str, float], float]:
    """What an equation does beside neutralisation, which happens anyway; where that is all, neutralisation so often."""
    often = min(-changes.get(part, 0.0) for part in ("H+", "OH-"))
    if often <= 0.0:
        return changes, 1.0
    anyway = NEUTRALISATION.changes
    rest = {part: changes.get(part, 0.0) - often * anyway.get(part, 0.0) for part in {**changes, **anyway}}
    rest = {part: many for part, many in rest.items() if many != 0.0}
    return (rest, 1.0) if rest else (dict(anyway), often)


def _same(known: Process, new: Process) -> bool:
    return known.changes == new.changes and (known.rate, known.product) == (new.rate, new.product)


def _product(declared: Declaration, changes: Mapping[str, float], tables: Tables) -> float | None:
    """Solubility product of the solid that a process makes, where an effect precipitation declares it."""
    for one in tables.get("precipitation", ()):
        made = changes.get(one.text("solid") + SOLID, 0.0)
        if made > 0.0:
            for ion, many in changes.items():
                if many < 0.0 and many / made != round(many / made):
                    raise declared.fail(
                        f"equation: {-many:g} {ion} for {made:g} {one.text('solid')} is no whole number of ions; "
                        f"write {ion} with the ions it brings"
                    )
            return one.number("ksp")
    return None


def _check_brought(one: Reaction, equations: list[Equation], contents: Mapping[str, Contents]) -> None:
    """Every reagent stands in a vessel, under this formula or as one of its ions, or another equation makes it."""
    declared, equation, chemistry = one.declared, one.equation, one.chemistry
    there = {formula for held in contents.values() for formula in (*held.amounts, *held.solids)} | {WATER}
    there |= {formula for other in equations if other is not equation for formula in other.products}
    parts = [dict(dissolved(chemistry, formula)) for formula in there]
    ions = {part for held in parts for part in held}
    for formula in equation.reagents:
        if formula not in there | ions and dict(dissolved(chemistry, formula)) not in parts:
            raise declared.fail(f"equation: nobody brings {formula!r}{nearest(formula, there - {WATER})}")
    known = there | set(equation.reagents) | set(equation.products)
    for key in ("acids", "bases"):
        for formula in declared.mapping(key):
            if formula not in known and dict(dissolved(chemistry, formula)) not in parts:
                raise declared.fail(f"{key}: nobody brings {formula!r}{nearest(formula, known - {WATER})}")


def _check_made(tables: Tables, equations: list[Equation]) -> None:
    made = {formula for one in equations for formula in one.products}
    for kind, key in (("precipitation", "solid"), ("gas", "gas")):
        for one in tables.get(kind, ()):
            if one.text(key) not in made:
                raise one.fail(f"{key}: no reaction makes {one.text(key)!r}{nearest(one.text(key), made)}")


def _check_known(recipe: Recipe) -> None:
    """Where a pH is asked for, every dissolved formula has its part in it."""
    asking, chemistry = [one for one in recipe.reactions if one.acid_base], recipe.chemistry
    for name, held in recipe.contents.items() if asking else ():
        for formula in held.amounts:
            if not chemistry.known(formula):
                raise asking[0].declared.fail(
                    f"the pH needs data of {formula!r} in {name!r}; give acids = {{ {formula} = [pKa, ...] }} or "
                    f"bases, or acids = {{ {formula} = [] }} if it neither gives nor takes protons"
                    f"{nearest(formula, (*COMMON, *chemistry.acids, *chemistry.bases))}"
                )
