"""Quantities of which a titration draws its curve beside the pH: redox potential, free metal, and what is left."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from replay.effects.chemistry.components import PROTON, WATER
from replay.effects.chemistry.formulas import atoms
from replay.effects.chemistry.matter import Matter
from replay.effects.chemistry.mixture import GAS, SOLID
from replay.effects.chemistry.redox import potential
from replay.effects.end_points import titrated_metals
from replay.effects.output import Series

ABSENT_LOG10_ACTIVITY: Final = -50.0
"""log10 of an activity below which PHREEQC means that there is nothing."""


def titrated_quantities(matter: Matter, vessel: str) -> Iterator[tuple[str, Series]]:
    """Name and series of the potential, of pM of each titrated metal, and of reagents whose potential is not known."""
    history = matter.histories[vessel]
    times, volts = potential(matter, vessel, history.times)
    if len(times):
        yield f"{vessel}/potential", Series(times, volts, "V")
    else:
        yield from _reagents_left(matter, vessel)
    for metal in sorted(titrated_metals(matter, vessel)):
        assert matter.solver is not None
        wet, equilibria = matter.equilibria(vessel, history.times)
        logs = equilibria.log_activity[:, matter.solver.mixture.components.index(metal)]
        has_activity = logs > ABSENT_LOG10_ACTIVITY
        if has_activity.any():
            (element,) = atoms(metal)
            yield f"{vessel}/p{element}", Series(history.times[wet][has_activity], -logs[has_activity], f"p{element}")


def _reagents_left(matter: Matter, vessel: str) -> Iterator[tuple[str, Series]]:
    """Name and mol of each reagent that a vessel held and that a redox equation uses up there."""
    history = matter.histories[vessel]
    for row, process in enumerate(matter.recipe.processes):
        reagents = [column for column, many in process.changes.items() if many < 0.0 and column not in (PROTON, WATER)]
        undissolved = any(column.endswith((SOLID, GAS)) for column in reagents)
        if len(reagents) != 2 or undissolved or not history.extents[-1, row] > 0.0:
            continue
        for column in reagents:
            amount = matter.states(vessel, history.times)[0][:, matter.ledger.column[column]]
            if amount[0] > 0.0:
                name = f"{vessel}/{matter.recipe.reagent(row, column)} left"
                yield name, Series(history.times, np.asarray(amount), "mol")
