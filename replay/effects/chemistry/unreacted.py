"""Declared equations that made nothing, with the reason."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from cdcore.numerics import BoolArray
from replay import words
from replay.effects.chemistry.components import PROTON, WATER, dissolved_components, heavy_components
from replay.effects.chemistry.formulas import charge_of
from replay.effects.chemistry.ledger_columns import ADDED
from replay.effects.chemistry.matter import Matter
from replay.effects.chemistry.mixture import GAS, SOLID
from replay.effects.chemistry.recipe import Reaction
from replay.effects.output import EffectEvent

LEAST_FORMED: Final = 0.01
"""Of the scarcer reagent: an equilibrium that makes less of its product did not proceed to speak of."""

ROUNDING: Final = 1e-9
"""Of a solid's amount: what differs by less did not dissolve."""

TOO_LITTLE_GAS: Final = "too little for bubbles at 1 atmosphere"

OF_WATER: Final = frozenset((WATER, PROTON, "OH-", "H3O+"))
"""Reagents that every solution has."""


def unreacted(matter: Matter, formed: BoolArray) -> Iterator[EffectEvent]:
    """An event ``no-reaction`` for each equation that made nothing in any vessel, with its reason.

    ``formed`` : (reactions,) whether an ion that the equation makes was there.
    """
    begin = max((float(history.times[0]) for history in matter.histories.values()), default=0.0)
    end = max((float(history.times[-1]) for history in matter.histories.values()), default=0.0)
    for number, reaction in enumerate(matter.recipe.reactions):
        reason = reaction.unwilling or _reason(matter, reaction, bool(formed[number]))
        if reason:
            equation = reaction.declared["equation"]
            verb = "makes no solid and no gas" if "stays dissolved" in reason else "does not proceed"
            text = f"{equation} {verb}: {reason}"
            values = {"equation": equation, "reason": reason}
            # Until the end something may have come that lets it proceed.
            time = begin if reaction.unwilling else end
            yield EffectEvent(time, "no-reaction", (), None, values, text, "warning")


def _reason(matter: Matter, reaction: Reaction, formed: bool) -> str:
    """Why an equation made nothing; ``""``: it did."""
    if reaction.process >= 0:
        if any(history.extents[-1, reaction.process] > 0.0 for history in matter.histories.values()):
            return ""
        process = matter.recipe.processes[reaction.process]
        missing = _missing(matter, reaction)
        if process.stays and not missing:
            gas = next(column for column, many in process.changes.items() if many > 0.0 and column.endswith(GAS))
            return f"all {gas.removesuffix(GAS)} stays dissolved, there is {TOO_LITTLE_GAS}"
        rival = "what else is in the vessel uses up one of its reagents first"
        acid = "no acid gives its H+, or " if "H+" in reaction.equation.reagents else ""
        return missing or acid + rival
    if formed:
        return ""
    missing = _missing(matter, reaction)
    if missing:
        return missing
    products = _products(matter, reaction)
    if products is not None:
        return products
    solid = _undissolved(matter, reaction)
    if solid:
        return f"{solid} does not dissolve"
    complexes = [
        formula for formula in reaction.equation.products if charge_of(formula) and len(heavy_components(formula)) > 1
    ]
    return f"less than {words.fixed(100 * LEAST_FORMED, 0)} % becomes {complexes[0]}" if complexes else ""


def _products(matter: Matter, reaction: Reaction) -> str | None:
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
        text = text or f"all {formula} stays dissolved, there is {reason}"
    return text


def _has_come(matter: Matter, vessel: str, formula: str, column: str) -> bool:
    """Whether a solid or gas came in a vessel, in the run or at its first moment."""
    amount = matter.amount(vessel, column)
    contents = matter.recipe.contents.get(vessel)
    brought = 0.0 if contents is None else contents.solids.get(formula, 0.0)
    return bool(np.ptp(amount) > 0.0 or amount[0] > brought * (1.0 + ROUNDING))


def _undissolved(matter: Matter, reaction: Reaction) -> str:
    """A solid reagent that stands as it stood; ``""``: some of each dissolved, or none is a solid."""
    for formula in reaction.equation.reagents:
        column = formula + SOLID
        if reaction.phases.get(formula) != "s" or column not in matter.ledger.column:
            continue
        left = [
            float(matter.amount(name, column).min()) / contents.solids[formula]
            for name, contents in matter.recipe.contents.items()
            if contents.solids.get(formula, 0.0) > 0.0
        ]
        if left and min(left) > 1.0 - ROUNDING:
            return formula
    return ""


def _missing(matter: Matter, reaction: Reaction) -> str:
    """Names the reagents that were never in one liquid with the rest; ``""``: none."""
    fewest: list[str] | None = None
    for name, history in matter.histories.items():
        wet = history.volume_ml > 0.0
        if not wet.any():
            continue
        absent = [
            formula
            for formula in reaction.equation.reagents
            if not _present(matter, reaction, name, formula)[wet].any()
        ]
        if fewest is None or len(absent) < len(fewest):
            fewest = absent
    if fewest is None:
        return "no liquid came to its reagents"
    return f"{' and '.join(fewest)} never came to its other reagents" if fewest else ""


def _present(matter: Matter, reaction: Reaction, vessel: str, formula: str) -> BoolArray:
    """(n,) rows of a vessel at which a reagent, or what it is made of, is or was in it."""
    count = len(matter.histories[vessel].times)
    standing = reaction.phases.get(formula) == "s" and matter.recipe.contents[vessel].solids.get(formula, 0.0) > 0.0
    if formula in OF_WATER or standing:
        return np.ones(count, dtype=np.bool_)
    present = np.ones(count, dtype=np.bool_)
    for component in heavy_components(formula) or dissolved_components(formula):
        brought = [
            matter.amount(vessel, column) > 0.0
            for column in matter.ledger.columns
            if column.endswith(ADDED) and component in dissolved_components(column.removesuffix(ADDED))
        ]
        present &= np.any([matter.amount(vessel, component) > 0.0, *brought], axis=0)
    return present
