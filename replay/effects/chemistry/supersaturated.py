"""Solids that a solution is supersaturated with although no table of the scene names them."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from replay.effects.chemistry.matter import Matter
from replay.effects.chemistry.mixture import SOLID, mixture_of
from replay.effects.chemistry.recipe import undeclared_phases
from replay.effects.chemistry.solver import Solver
from replay.effects.output import EffectEvent

ROWS: Final = 24
"""Compositions of a vessel that are examined, evenly over its history."""

BEYOND: Final = 0.3
"""Saturation index, log10, from which a solid counts: twice its product; constants are hardly known better."""


def supersaturated(matter: Matter) -> Iterator[EffectEvent]:
    """An event ``supersaturated`` for each vessel and solid that would fall out there, and that no table names."""
    phases = undeclared_phases(matter.recipe)
    if matter.solver is None or not phases:
        return
    ledger, mixture = matter.ledger, matter.solver.mixture
    solver = Solver(mixture_of(mixture.database, mixture.components, phases))
    columns = [ledger.column[name] for name in solver.mixture.components]
    for vessel, history in matter.histories.items():
        wet = (history.volume_ml > 0.0) & (history.amounts[:, ledger.water] > 0.0)
        rows = np.flatnonzero(wet) if history.added_ml[-1].any() else np.zeros(0, dtype=np.int64)
        rows = rows[np.unique(np.linspace(0, len(rows) - 1, ROWS).astype(np.int64))] if len(rows) else rows
        if not len(rows):
            continue
        amounts = history.amounts[rows]
        celsius = matter.celsius(vessel, history.times[rows])
        indices = solver.saturation(amounts[:, columns], amounts[:, ledger.water], celsius)
        for phase, values in zip(phases, indices.T, strict=True):
            beyond = np.flatnonzero(values > BEYOND)
            if not len(beyond):
                continue
            solid = phase.column.removesuffix(SOLID)
            text = (
                f"{solid} is beyond its solubility in {vessel}, and no effect lets it fall out: it stays dissolved. "
                f'To let it fall out, add [[effect]] kind = "precipitation", solid = "{solid}"'
            )
            data: dict[str, float | str] = {"formula": solid, "saturation_index": float(values[beyond].max())}
            time = float(history.times[rows[beyond[0]]])
            yield EffectEvent(time, "supersaturated", (vessel,), None, data, text, "warning")
