"""Declared equations that made nothing, or stopped for want of acid, with the reason."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from cdcore.numerics import BoolArray, FloatArray
from replay import words
from replay.effects.chemistry.components import PROTON, WATER, dissolved_components, solute_components
from replay.effects.chemistry.formulas import charge_of
from replay.effects.chemistry.ledger_columns import ADDED_SUFFIX
from replay.effects.chemistry.limits import Cause
from replay.effects.chemistry.matter import Matter
from replay.effects.chemistry.mixture import GAS, SOLID
from replay.effects.chemistry.processes import Process
from replay.effects.chemistry.recipe import Reaction
from replay.effects.output import EffectEvent

LEAST_FORMED_FRACTION: Final = 0.01
"""Of the scarcer reagent: an equilibrium that makes less of its product did not proceed to speak of."""

SOLID_ROUNDING: Final = 1e-9
"""Of a solid's amount: what differs by less did not dissolve."""

LEAST_DISSOLVED_FRACTION: Final = 1e-4
"""Of a solid that was brought: less did not dissolve to speak of; of the scarcer reagent: less did not react."""

PERMANGANATE, MANGANESE = "MnO4-", "Mn^2+"
DIOXIDE_ADVICE: Final = "; permanganate without acid makes MnO2: write the equation with MnO2, or add acid"

CAUSES_IN_WATER: Final = (Cause.ACID, Cause.HYDROXIDE)
"""What an equation may lack while all of its reagents are there."""

TOO_LITTLE_GAS: Final = "too little for bubbles at 1 atmosphere"

REAGENTS_OF_WATER: Final = frozenset((WATER, PROTON, "OH-", "H3O+"))
"""Reagents that every solution has."""


def no_reaction_events(matter: Matter, has_formed: BoolArray) -> Iterator[EffectEvent]:
    """An event ``no-reaction`` for each equation that made nothing in any vessel, with its reason.

    ``has_formed`` : (reactions,) whether an ion that the equation makes was there.
    """
    first_time = max((float(history.times[0]) for history in matter.histories.values()), default=0.0)
    last_time = max((float(history.times[-1]) for history in matter.histories.values()), default=0.0)
    for number, reaction in enumerate(matter.recipe.reactions):
        reason = reaction.obstacle or _reason_for_nothing(matter, reaction, bool(has_formed[number]))
        if reason:
            equation = reaction.declared["equation"]
            verb = "makes no solid and no gas" if "stays dissolved" in reason else "does not proceed"
            message = f"{equation} {verb}: {reason}"
            event_values = {"equation": equation, "reason": reason}
            # Until the end something may have come that lets it proceed.
            time = first_time if reaction.obstacle else last_time
            yield EffectEvent(time, "no-reaction", (), None, event_values, message, "warning")


def stop_events(matter: Matter) -> Iterator[EffectEvent]:
    """Events ``stopped`` for want of acid or hydroxide alone, and ``equilibrium`` before any reagent is used up."""
    yield from _equilibrium_events(matter)
    for row, process in enumerate(matter.recipe.processes):
        for vessel, history in matter.histories.items():
            extent, amounts = history.extents[-1, row], _dissolved_amounts(matter, vessel)
            if not extent > 0.0:
                continue
            limit_of_cause = matter.ledger.limits.by_cause(row, amounts, _last_celsius(matter, vessel))
            reagents = {cause: float(limit) for cause, limit in limit_of_cause.items() if not isinstance(cause, Cause)}
            causes_of_end = [
                cause
                for cause in CAUSES_IN_WATER
                if cause in limit_of_cause and limit_of_cause[cause] <= SOLID_ROUNDING * extent
            ]
            has_remainder = all(limit > LEAST_FORMED_FRACTION * (limit + extent) for limit in reagents.values())
            if len(reagents) < 2 or not causes_of_end or not has_remainder or _is_nothing(matter, row, vessel):
                continue
            remaining_texts = [
                f"{words.quantity(-1e3 * limit * process.changes[column], 'mmol')} {matter.recipe.reagent(row, column)}"
                for column, limit in reagents.items()
            ]
            message = (
                f"{process.text} stops in {vessel} for want of {causes_of_end[0]}: "
                f"{' and '.join(remaining_texts)} are left{_dioxide_advice(process, causes_of_end[0])}"
            )
            event_values = {"equation": process.text}
            yield EffectEvent(float(history.times[-1]), "stopped", (vessel,), None, event_values, message, "warning")


def _equilibrium_events(matter: Matter) -> Iterator[EffectEvent]:
    """An event ``equilibrium`` for each vessel and equation at once that left some of each of its reagents."""
    ledger = matter.ledger
    for row, process in enumerate(matter.recipe.processes):
        if process.rate is not None or not ledger.limits.has_equilibrium(row):
            continue
        for vessel, history in matter.histories.items():
            extent, amounts = float(history.extents[-1, row]), _dissolved_amounts(matter, vessel)
            extent_to_end = float(ledger.limits.extent_to_the_end(row, amounts, _last_celsius(matter, vessel)))
            if not extent > 0.0 or extent_to_end <= LEAST_FORMED_FRACTION * (extent_to_end + extent):
                continue
            percent = 100.0 * extent / (extent_to_end + extent)
            percent_text = f"{words.decimal(percent, 0)} %" if percent >= 1.0 else "less than 1 %"
            message = (
                f"{process.text} stops at its equilibrium in {vessel}: {percent_text} has reacted, by its free energy"
            )
            event_values: dict[str, float | str] = {"equation": process.text, "log_k": process.log_k}
            yield EffectEvent(float(history.times[-1]), "equilibrium", (vessel,), None, event_values, message)


def _dissolved_amounts(matter: Matter, vessel: str) -> FloatArray:
    """Amounts (columns,) of a vessel at the end with PHREEQC's solids dissolved, as equations at once find them."""
    reactions, amounts = matter.ledger.reactions, matter.histories[vessel].amounts[-1]
    return np.asarray(amounts - (amounts[reactions.phases] * ~reactions.gas) @ reactions.formation)


def _last_celsius(matter: Matter, vessel: str) -> FloatArray:
    """Temperature (1,) of a vessel at the end."""
    return matter.celsius(vessel, matter.histories[vessel].times[-1:])


def _is_nothing(matter: Matter, row: int, vessel: str) -> bool:
    """Whether less than a trace of a process ran in a vessel, of what its scarcest reagent would give."""
    extent = float(matter.histories[vessel].extents[-1, row])
    amounts, celsius = _dissolved_amounts(matter, vessel), _last_celsius(matter, vessel)
    limits = matter.ledger.limits.by_cause(row, amounts, celsius)
    scarcest = min((float(limit) for cause, limit in limits.items() if not isinstance(cause, Cause)), default=0.0)
    return extent <= LEAST_DISSOLVED_FRACTION * (extent + scarcest)


def _dioxide_advice(process: Process, cause: str | Cause) -> str:
    """Advice where permanganate lacks the acid to become manganese(II); ``""``: anything else is lacking."""
    changes = process.changes
    lacks_acid = cause is Cause.ACID and changes.get(PERMANGANATE, 0.0) < 0.0 and changes.get(MANGANESE, 0.0) > 0.0
    return DIOXIDE_ADVICE if lacks_acid else ""


def _reason_for_nothing(matter: Matter, reaction: Reaction, has_formed: bool) -> str:
    """Why an equation made nothing; ``""``: it did."""
    if reaction.process >= 0:
        return _reason_of_process(matter, reaction)
    if has_formed:
        return ""
    missing_text = _missing_reagents_text(matter, reaction)
    if missing_text:
        return missing_text
    products = _no_product_reason(matter, reaction)
    solid = _undissolved_solid(matter, reaction) if products != "" else ""
    if solid:
        return f"{solid} hardly dissolves in it"
    if products is not None:
        return products
    complexes = [
        product for product in reaction.equation.products if charge_of(product) and len(solute_components(product)) > 1
    ]
    return f"less than {words.decimal(100 * LEAST_FORMED_FRACTION, 0)} % becomes {complexes[0]}" if complexes else ""


def _reason_of_process(matter: Matter, reaction: Reaction) -> str:
    """Why an equation without a constant made nothing; ``""``: it did."""
    process = matter.recipe.processes[reaction.process]
    extents = sum(float(history.extents[-1, reaction.process]) for history in matter.histories.values())
    pending_extent = sum(float(history.pending[-1, reaction.process]) for history in matter.histories.values())
    solid = process.dissolving_solid.removesuffix(SOLID)
    brought_solid = sum(contents.solids.get(solid, 0.0) for contents in matter.recipe.contents.values())
    is_hardly_dissolved = (
        bool(solid)
        and -(extents + pending_extent) * process.changes[process.dissolving_solid]
        < LEAST_DISSOLVED_FRACTION * brought_solid
    )
    is_at_once = process.rate is None
    has_run = any(
        history.extents[-1, reaction.process] > 0.0
        and not (is_at_once and _is_nothing(matter, reaction.process, vessel))
        for vessel, history in matter.histories.items()
    )
    if has_run and not is_hardly_dissolved:
        return ""
    missing_text = _missing_reagents_text(matter, reaction)
    if missing_text:
        return missing_text
    if is_hardly_dissolved:
        return f"{solid} hardly dissolves in it"
    for vessel, history in matter.histories.items():
        is_wet = history.volume_ml > 0.0
        if all(_is_present(matter, reaction, vessel, formula)[is_wet].any() for formula in reaction.equation.reagents):
            return _reason_in_vessel(matter, reaction, vessel)
    return "its reagents were never together"


def _reason_in_vessel(matter: Matter, reaction: Reaction, vessel: str) -> str:
    """Return the cause that kept an equation from running in a vessel that had all of its reagents."""
    history = matter.histories[vessel]
    wet_rows = np.flatnonzero(history.volume_ml > 0.0)
    celsius = matter.celsius(vessel, history.times[wet_rows])
    limit_of_cause = matter.ledger.limits.by_cause(reaction.process, history.amounts[wet_rows], celsius)
    # What is lacking may be there in traces, as hydroxide of a weak base.
    most = np.max([limit for limit in limit_of_cause.values() if np.isfinite(limit).all()], axis=0, initial=0.0)
    is_lacking = {
        cause: np.broadcast_to(limit <= LEAST_DISSOLVED_FRACTION * most, wet_rows.shape)
        for cause, limit in limit_of_cause.items()
    }
    # The moment at which the least was lacking.
    row = int(np.argmin(np.sum(list(is_lacking.values()), axis=0)))
    causes = [cause for cause, is_lacking_in_row in is_lacking.items() if is_lacking_in_row[row]]
    process = matter.recipe.processes[reaction.process]
    if not causes and process.gas_solubility:
        gas = next(column for column, many in process.changes.items() if many > 0.0 and column.endswith(GAS))
        return f"all {gas.removesuffix(GAS)} stays dissolved, there is {TOO_LITTLE_GAS}"
    if not causes and matter.ledger.limits.has_equilibrium(reaction.process):
        return f"its equilibrium in {vessel} is on the side of its reagents, by its free energy"
    return " and ".join(_cause_text(matter, reaction, vessel, cause) for cause in causes) or "it ends before it begins"


def _cause_text(matter: Matter, reaction: Reaction, vessel: str, cause: str | Cause) -> str:
    """Words for what an equation lacked in a vessel."""
    process = matter.recipe.processes[reaction.process]
    if cause is Cause.SATURATION and process.salt is not None:
        return f"{vessel} is saturated with {process.salt.formula}"
    if cause is Cause.ACID or (cause is Cause.CATALYST and PROTON in process.catalysts):
        advice = _dioxide_advice(process, cause)
        if not _was_added(matter, vessel, proton_sign=1):
            return f"it needs acid, and none came into {vessel}{advice}"
        return f"it needs acid, and none is free in {vessel}: a base takes it up, or the acid is too weak{advice}"
    if cause is Cause.HYDROXIDE:
        if not _was_added(matter, vessel, proton_sign=-1):
            return f"it needs hydroxide, and none came into {vessel}"
        return f"it needs hydroxide, and none is free in {vessel}: an acid takes it up, or the base is too weak"
    if cause is Cause.CATALYST:
        return f"what else is in {vessel} binds what it needs"
    return f"what else is in {vessel} uses up {matter.recipe.reagent(reaction.process, cause)} first"


def _was_added(matter: Matter, vessel: str, *, proton_sign: int) -> bool:
    """Whether a formula with protons (1), or one that takes them (-1), was ever added to a vessel."""
    return any(
        proton_sign * dissolved_components(column.removesuffix(ADDED_SUFFIX)).get(PROTON, 0) > 0
        for column in matter.ledger.columns
        if column.endswith(ADDED_SUFFIX) and matter.amount(vessel, column).any()
    )


def _no_product_reason(matter: Matter, reaction: Reaction) -> str | None:
    """Why no solid and no gas of an equation came; ``""``: one did; ``None``: it makes neither."""
    text = None
    for formula in reaction.equation.products:
        phase = reaction.phases.get(formula, "")
        column = f"{formula}({phase})"
        if phase not in ("s", "g") or column not in matter.ledger.column:
            continue
        if any(_has_come(matter, name, formula, column) for name in matter.histories):
            return ""
        reason = TOO_LITTLE_GAS if column.endswith(GAS) else "less than what dissolves"
        sentence = f"all {formula} stays dissolved, there is {reason}"
        if column.endswith(GAS) and not _is_dissolved(matter, formula):
            reagent = "acid" if dissolved_components(formula).get(PROTON, 0) > 0 else "base"
            sentence = f"no {formula} forms, there is too little {reagent}"
        text = text or sentence
    return text


def _is_dissolved(matter: Matter, formula: str) -> bool:
    """Whether a gas ever stood dissolved as such, and not as the ions of its acid or base alone."""
    row = None if matter.solver is None else matter.solver.mixture.row_of(formula)
    if row is None:
        return True
    for vessel, history in matter.histories.items():
        wet, equilibria = matter.equilibria(vessel, history.times)
        amounts = history.amounts[wet]
        for component in solute_components(formula):
            whole = amounts[:, matter.ledger.column[component]]
            if (equilibria.species[:, row] > LEAST_FORMED_FRACTION * whole)[whole > 0.0].any():
                return True
    return False


def _has_come(matter: Matter, vessel: str, formula: str, column: str) -> bool:
    """Whether a solid or gas came in a vessel, in the run or at its first moment."""
    amount = matter.amount(vessel, column)
    contents = matter.recipe.contents.get(vessel)
    brought = 0.0 if contents is None else contents.solids.get(formula, 0.0)
    return bool(np.ptp(amount) > 0.0 or amount[0] > brought * (1.0 + SOLID_ROUNDING))


def _undissolved_solid(matter: Matter, reaction: Reaction) -> str:
    """A solid reagent of which next to nothing dissolved; ``""``: some of each did, or none is a solid."""
    for formula in reaction.equation.reagents:
        column = formula + SOLID
        if reaction.phases.get(formula) != "s" or column not in matter.ledger.column:
            continue
        left = [
            float(matter.amount(name, column).min()) / contents.solids[formula]
            for name, contents in matter.recipe.contents.items()
            if contents.solids.get(formula, 0.0) > 0.0
        ]
        if left and min(left) > 1.0 - LEAST_DISSOLVED_FRACTION:
            return formula
    return ""


def _missing_reagents_text(matter: Matter, reaction: Reaction) -> str:
    """Names the reagents that were never in one liquid with the rest; ``""``: none."""
    fewest: list[str] | None = None
    for name, history in matter.histories.items():
        wet = history.volume_ml > 0.0
        if not wet.any():
            continue
        absent = [
            formula
            for formula in reaction.equation.reagents
            if not _is_present(matter, reaction, name, formula)[wet].any()
        ]
        if fewest is None or len(absent) < len(fewest):
            fewest = absent
    if fewest is None:
        return "no liquid came to its reagents"
    return f"{' and '.join(fewest)} never came to its other reagents" if fewest else ""


def _is_present(matter: Matter, reaction: Reaction, vessel: str, formula: str) -> BoolArray:
    """(n,) rows of a vessel at which a reagent, or what it is made of, is or was in it."""
    count = len(matter.histories[vessel].times)
    standing = reaction.phases.get(formula) == "s" and matter.recipe.contents[vessel].solids.get(formula, 0.0) > 0.0
    if formula in REAGENTS_OF_WATER or standing:
        return np.ones(count, dtype=np.bool_)
    present = np.ones(count, dtype=np.bool_)
    for component in solute_components(formula) or dissolved_components(formula):
        brought = [
            matter.amount(vessel, column) > 0.0
            for column in matter.ledger.columns
            if column.endswith(ADDED_SUFFIX) and component in dissolved_components(column.removesuffix(ADDED_SUFFIX))
        ]
        present &= np.any([matter.amount(vessel, component) > 0.0, *brought], axis=0)
    return present
