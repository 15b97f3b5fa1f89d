"""The ledger of a run: all that moved, in order of time, and what reacted. Effects of chemistry are views of it."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from cdcore.numerics import FloatArray, IntArray
from replay.effects.chemistry import Recipe, recipe_of
from replay.effects.contents import contents_of
from replay.effects.inputs import EffectInputs
from replay.effects.models.history import History
from replay.effects.models.ledger import LUMPS, Ledger
from replay.effects.models.outflow import GAP_S, Stream
from replay.effects.movement import movement_of
from replay.effects.vessels import Vessel, vessels_of

__all__ = ["Matter", "matter_of"]


@dataclass(frozen=True, eq=False)
class Matter:
    """Everything in every vessel."""

    recipe: Recipe
    ledger: Ledger
    vessels: Mapping[str, Vessel]
    histories: Mapping[str, History]

    def amount(self, vessel: str, column: str) -> FloatArray:
        """Mol (n,) of a column at the rows of a vessel's history; zeros for what never was in it."""
        history = self.histories[vessel]
        place = self.ledger.column.get(column)
        return np.zeros(len(history.times)) if place is None else history.amounts[:, place]

    def states(self, vessel: str, times: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Amounts (n, columns), extents (n, processes) and millilitres (n,) of a vessel at times.

        Between two rows a slow process nears its end by exp(-rate t), the others rest.
        """
        history, ledger = self.histories[vessel], self.ledger
        rows = history.rows(times)
        amounts, extents = history.amounts[rows], history.extents[rows]
        since = np.maximum(0.0, times - history.times[rows])
        for one in ledger.slow:
            more = history.pending[rows, one] * -np.expm1(-since * (ledger.processes[one].rate or 0.0))
            extents[:, one] += more
            for column in np.flatnonzero(ledger.changes[one]).tolist():
                amounts[:, column] += ledger.changes[one, column] * more
        return amounts, extents, history.volume_ml[rows]


def matter_of(inputs: EffectInputs) -> Matter:
    """The ledger of this run, made once."""
    return inputs.shared("matter", lambda: _matter(inputs))


def _matter(inputs: EffectInputs) -> Matter:
    moved = movement_of(inputs)
    names = (name for declared in inputs.tables.get("mixing", ()) for name in declared.bodies("in"))
    vessels = {**vessels_of(inputs, tuple(names)), **moved.vessels}
    recipe = recipe_of(inputs.tables, {name: contents_of(vessel) for name, vessel in vessels.items()})
    along = max((one.number("solids_along") for one in inputs.tables.get("pour", ())), default=0.0)
    ledger = recipe.ledger(along)
    times = inputs.times
    if len(times):
        ledger.begin(float(times[0]))
        for part in _parts(moved.streams, times):
            _carry_out(ledger, *part)
        ledger.end(len(times) - 1, float(times[-1]))
    inputs.count("flows mixed", len(ledger.loads))
    return Matter(recipe, ledger, vessels, {name: ledger.history(name) for name in vessels if len(times)})


Part = tuple[IntArray, FloatArray, list[Stream], FloatArray]


def _parts(streams: tuple[Stream, ...], times: FloatArray) -> Iterator[Part]:
    """Frames, times, streams and millilitres (frames, streams) of stretches in which the same streams flow."""
    frames = np.unique(np.concatenate([one.frames for one in streams] or [np.zeros(0, dtype=np.int64)]))
    volumes = np.zeros((len(frames), len(streams)))
    for column, one in enumerate(streams):
        volumes[np.searchsorted(frames, one.frames), column] = one.volume_ml
    flowing = volumes > 0.0
    breaks = (flowing[1:] != flowing[:-1]).any(axis=1) | (np.diff(times[frames]) > GAP_S)
    cuts = [0, *(np.flatnonzero(breaks) + 1).tolist(), len(frames)]
    for first, stop in pairwise(cuts):
        if stop > first:
            part, rows = np.flatnonzero(flowing[first]), frames[first:stop]
            yield rows, times[rows], [streams[column] for column in part.tolist()], volumes[first:stop][:, part]


def _carry_out(
    ledger: Ledger, frames: IntArray, times: FloatArray, streams: list[Stream], volume_ml: FloatArray
) -> None:
    over = np.array([one.over for one in streams])
    pairs = [(one.source, one.target) for one in streams]
    through = {a for a, _ in pairs} & {b for _, b in pairs}
    if not over.any() and not through:
        ledger.flow(frames, times, pairs, volume_ml)
        return
    # What flows through a vessel goes step by step; what only runs over, in as many steps as are told apart.
    chained = {a for (a, _), brim in zip(pairs, over, strict=True) if not brim} & {b for _, b in pairs}
    count = len(frames) if chained else min(len(frames), LUMPS)
    cuts = np.unique(np.linspace(0, len(frames), count + 1).astype(np.int64))
    for first, stop in pairwise(cuts.tolist()):
        part = volume_ml[first:stop].sum(axis=0)
        for wanted in (False, True):
            moves = [(*pairs[k], float(part[k])) for k in np.flatnonzero((over == wanted) & (part > 0.0)).tolist()]
            if moves:
                ledger.step(int(frames[stop - 1]), float(times[stop - 1]), moves)
