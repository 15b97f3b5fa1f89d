"""Events of equations that ran and of solids that dissolved or fell out, where no other event reports them."""

from collections.abc import Collection, Iterable, Iterator
from typing import Final

import numpy as np

from replay.effects.chemistry.formulas import molar_mass
from replay.effects.chemistry.limits import Cause
from replay.effects.chemistry.matter import Matter
from replay.effects.chemistry.mixture import GAS, SOLID
from replay.effects.equivalence import Equivalence
from replay.effects.output import EffectEvent
from replay.words import quantity

LEAST_MOL: Final = 1e-9
"""Of a reaction: less is none."""

LEAST_G: Final = 1e-3
LEAST_CHANGED_FRACTION: Final = 1e-3
"""Of a solid: less of it, or of what there was, is not seen."""

USED_UP_FRACTION: Final = 1e-6
"""Of what has run: a reagent that lets less of it run is used up."""

EVENTS_OF_AN_EQUATION: Final = ("stopped", "equilibrium")
"""Events that say of an equation how far it ran."""


def reacted_events(
    matter: Matter, followed: Collection[str], earlier_events: Iterable[EffectEvent]
) -> Iterator[EffectEvent]:
    """An event ``reacted`` for each vessel and equation that ran there and that no other event reports.

    ``followed``: solids that an effect precipitation reports; ``earlier_events``: those of the reactions so far. Gas
    that leaves reports its equation, and so does the end point of a titration, reached or not.
    """
    earlier_events = list(earlier_events)
    reported = {
        (event.values.get("equation"), event.bodies) for event in earlier_events if event.name in EVENTS_OF_AN_EQUATION
    }
    titrated = {
        event.bodies
        for event in earlier_events
        if event.name in ("end-point", "not-reached")
        and event.values.get("of", Equivalence.OXIDANT_AND_REDUCTANT) == Equivalence.OXIDANT_AND_REDUCTANT
    }
    for row, process in enumerate(matter.recipe.processes):
        made = [column for column, many in process.changes.items() if many > 0.0]
        solids = [column.removesuffix(SOLID) for column in made if column.endswith(SOLID)]
        has_gas = any(column.endswith(GAS) for column in made)
        if process.salt is not None or has_gas or (solids and set(solids) <= set(followed)):
            continue
        for vessel, history in matter.histories.items():
            extent = history.extents[:, row]
            run_mol = float(extent[-1] - extent[0])
            if run_mol <= LEAST_MOL or (process.text, (vessel,)) in reported or (vessel,) in titrated:
                continue
            limit_of_cause = matter.ledger.limits.by_cause(row, history.amounts[-1])
            used_up = sorted(
                {
                    matter.recipe.reagent(row, cause).removesuffix(SOLID)
                    for cause, limit in limit_of_cause.items()
                    if not isinstance(cause, Cause) and float(limit) <= USED_UP_FRACTION * run_mol
                }
            )
            text = f"{process.text} runs in {vessel} by {quantity(1e3 * run_mol, 'mmol')}"
            if used_up:
                text += f", until no {' and no '.join(used_up)} is left"
            masses = [
                f"{quantity(run_mol * process.changes[solid + SOLID] * molar_mass(solid), 'g')} {solid}"
                for solid in solids
                if solid not in followed
            ]
            if masses:
                text += f"; {' and '.join(masses)} come as a solid"
            moments = np.flatnonzero(np.diff(extent) > 0.0)
            start, end = float(history.times[moments[0] + 1]), float(history.times[moments[-1] + 1])
            values: dict[str, float | str] = {"equation": process.text, "moles": run_mol}
            yield EffectEvent(start, "reacted", (vessel,), end if end > start else None, values, text)


def solid_events(matter: Matter, followed: Collection[str]) -> Iterator[EffectEvent]:
    """An event ``solid-change`` for each vessel and solid at equilibrium of which more or less stands at the end.

    ``followed``: solids that an effect precipitation reports.
    """
    ledger = matter.ledger
    indices = [*ledger.reactions.phases.tolist(), *ledger.reactions.salt_columns.tolist()]
    for vessel, history in matter.histories.items():
        for index in indices:
            column = ledger.columns[index]
            solid, amount = column.removesuffix(SOLID), history.amounts[:, index]
            grams = float(amount[-1] - amount[0]) * (molar_mass(solid) if column.endswith(SOLID) else 0.0)
            most_grams = float(amount.max()) * (molar_mass(solid) if column.endswith(SOLID) else 0.0)
            is_reported = solid in followed or column in matter.brines(vessel)
            if is_reported or abs(grams) <= max(LEAST_G, LEAST_CHANGED_FRACTION * most_grams):
                continue
            text = f"{quantity(grams, 'g')} {solid} fall out in {vessel}"
            if grams < 0.0:
                brought = quantity(float(amount[0]) * molar_mass(solid), "g")
                text = f"{quantity(-grams, 'g')} of {brought} {solid} dissolve in {vessel}"
            moments = np.flatnonzero(np.diff(amount))
            values: dict[str, float | str] = {"formula": solid, "mass_g": grams}
            yield EffectEvent(float(history.times[moments[0] + 1]), "solid-change", (vessel,), None, values, text)
