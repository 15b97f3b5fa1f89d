"""What is mixed reacts: by constants to equilibrium, by an equation to its end, at once or at a rate; a pH shows it."""

from typing import Final

import numpy as np

from replay.effects.chemistry import Reaction
from replay.effects.declaring import Declaration
from replay.effects.end_points import end_points
from replay.effects.inputs import EffectInputs
from replay.effects.matter import Matter, matter_of
from replay.effects.models.speciation import GAS
from replay.effects.output import EffectEvent, EffectOutput, Findings, FloatArray, LaneSpan, Series
from replay.effects.protocol import spec_of
from sessions.model.scene import Scene
from sessions.scene_files.toml_table import is_number

LEAST_GAS: Final = 1e-6
"""mol of a gas that nobody sees: a bubble of 0.02 mL."""

LEAST_PH: Final = 0.05
"""A pH that ends nearer to its begin tells no result; a school's meter shows 0.1."""


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``end-point`` where acid and base, or oxidant and reductant, are equivalent, ``gas`` and ``ph``.

    Series of pH, of gas that left, and of the extent of what has no constant: at equilibrium no equation has its own.
    """
    matter, found = matter_of(inputs), Findings(len(inputs))
    reactions = matter.recipe.reactions
    for vessel, history in matter.histories.items():
        mixed = bool(history.added_ml[-1].any())
        found.ran[history.frames[1:]] |= mixed
        for reaction in reactions:
            if reaction.process >= 0:
                _tell_extent(inputs, matter, reaction, vessel, found)
        asked = [reaction for reaction in reactions if reaction.asks_ph and _any(matter, reaction, vessel)]
        if asked and mixed:
            times = np.unique(np.concatenate([_times(inputs, matter, reaction, vessel) for reaction in asked]))
            wet, solved = matter.solved(vessel, times)
            found.series[f"{vessel}/pH"] = Series(times[wet], solved.ph, "pH")
        _tell_gases(inputs, matter, vessel, found)
        found.events += end_points(matter, vessel) or _changed_ph(vessel, found.series.get(f"{vessel}/pH"))
    return found.output()


def _tell_extent(inputs: EffectInputs, matter: Matter, reaction: Reaction, vessel: str, found: Findings) -> None:
    """How far an equation without a constant went in a vessel: a series, and a lane while it goes on."""
    times = _times(inputs, matter, reaction, vessel)
    extent = matter.states(vessel, times)[1][:, reaction.process]
    moving = np.flatnonzero(np.diff(extent, prepend=0.0))
    if len(moving):
        found.ran |= np.isin(inputs.times, times)
        equation = reaction.declared["equation"]
        # Named by the equation wherever there are several, so that no order of tables names one.
        which = f" of {equation}" if len(matter.recipe.reactions) > 1 else ""
        found.series[f"{vessel}/extent{which}"] = Series(times, extent, "mol")
        found.lane(vessel, LaneSpan(float(times[moving[0]]), float(times[moving[-1]]), equation))


def _tell_gases(inputs: EffectInputs, matter: Matter, vessel: str, found: Findings) -> None:
    """What left as a gas, wherever it went: an event from the first to the last of it, and its amount as a series."""
    times = inputs.times if matter.ledger.slow else matter.histories[vessel].times
    amounts = matter.states(vessel, times)[0]
    for column, place in matter.ledger.column.items():
        gone = np.maximum.accumulate(amounts[:, place] - amounts[0, place])
        if column.endswith(GAS) and gone[-1] > LEAST_GAS:
            gas, growing = column.removesuffix(GAS), np.flatnonzero(np.diff(gone, prepend=0.0))
            start, end = (float(times[row]) for row in growing[[0, -1]])
            words = f"{1e3 * gone[-1]:.3g} mmol {gas} leave {vessel} as gas"
            found.series[f"{vessel}/{gas} gone"] = Series(times, gone, "mol")
            found.events.append(
                EffectEvent(start, "gas", (vessel,), end, {"moles": float(gone[-1]), "formula": gas}, words)
            )


def _changed_ph(vessel: str, series: Series | None) -> list[EffectEvent]:
    """What became of a pH that has no end point, at its last change."""
    if series is None or not len(series.times) or abs(series.values[-1] - series.values[0]) < LEAST_PH:
        return []
    times, ph = series.times, series.values
    changes = np.flatnonzero(np.diff(ph))
    values = {"from_ph": float(ph[0]), "to_ph": float(ph[-1])}
    words = f"the pH in {vessel} goes from {ph[0]:.2f} to {ph[-1]:.2f}"
    return [EffectEvent(float(times[changes[-1] + 1]), "ph", (vessel,), None, values, words)]


def _times(inputs: EffectInputs, matter: Matter, reaction: Reaction, vessel: str) -> FloatArray:
    """Where it is told: at every change, and in every frame from its begin on where it is slow."""
    history = matter.histories[vessel]
    if reaction.declared["rate_per_s"] is None:
        return history.times
    on = (history.pending[:, reaction.process] > 0.0) | (history.extents[:, reaction.process] > 0.0)
    first = int(history.frames[int(np.argmax(on))]) if on.any() else len(inputs)
    return inputs.times[first:]


def _any(matter: Matter, reaction: Reaction, vessel: str) -> bool:
    """Whether anything that an acid or base of the equation brings to the pH is, or was, there."""
    chemistry = matter.recipe.chemistry
    parts = {part for formula in reaction.equation.reagents for part in chemistry.dissolved(formula)} - {"H2O"}
    return any(matter.amount(vessel, part).any() for part in parts)


def _check(declared: Declaration, _scene: Scene) -> None:
    for formula, pka in declared["acids"].items():
        if not (isinstance(pka, list | tuple) and all(map(is_number, pka)) and list(pka) == sorted(pka)):
            raise declared.fail(f"acids.{formula} is {pka!r}; give its pKa as a rising list of numbers")
    for formula, value in declared["bases"].items():
        if not is_number(value):
            raise declared.fail(f"bases.{formula} is {value!r}; give the pKa of its conjugate acid")


SPEC = spec_of("reaction", compute, check=_check)
