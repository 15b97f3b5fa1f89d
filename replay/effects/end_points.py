"""End points of a titration: where acid and base, oxidant and reductant, or the ions of a salt are equivalent.

What is equivalent follows from the amounts alone: the excess of protons over all steps of pKa above a cut changes its
sign. Only a cut at which the pH has an inflection is an end point: nobody could see the others.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray
from replay.effects.matter import Matter
from replay.effects.models.equation import charge_of
from replay.effects.models.equilibrium import equilibrium
from replay.effects.models.ledger import BROUGHT
from replay.effects.models.speciation import PROTON
from replay.effects.output import EffectEvent

LEAST: Final = 1e-6
"""An excess below this share of the greatest there was is none: what a slow reaction leaves ends no titration."""

STEEPER: Final = 1.5
"""An inflection is so many times steeper than the curve on either side; at half a step there a buffer is flattest."""

HALF_STEP: Final = np.linspace(-0.5, 0.5, 42)
"""Shares of the smaller step next to a cut at which the pH is asked for; none is the cut itself."""

NARROW: Final = 0.15
"""An inflection further from the cut, as a share of that step, is none of it."""

ABOUT: Final = 0.02
"""Share of a metal ion by which it is looked at before and after it is equivalent."""

STRONGEST, WEAKEST = -2.0, 16.0
"""A pKa beyond these is no step: the acid gives its proton whole, or keeps it in water."""


@dataclass(frozen=True)
class _Crossing:
    """Where an excess changes its sign: between two rows of a history, by a straight line."""

    before: int
    after: int
    share: float
    rising: bool

    def same(self, other: "_Crossing") -> bool:
        """Whether it is where another one is."""
        return self.before == other.before and abs(self.share - other.share) < 1e-6


def end_points(matter: Matter, vessel: str) -> list[EffectEvent]:
    """Events in order of what came in, with its volume, what overshot it, and whose it is.

    The volume is that which came from where the flow came from that did it: the titrant, rinses left out.
    """
    history = matter.histories[vessel]
    if not history.added_ml[-1].any():
        return []
    found = sorted(
        [*_of_protons(matter, vessel), *_of_electrons(matter, vessel), *_of_ions(matter, vessel)],
        key=lambda row: (row[0].before, row[0].share),
    )
    # Where a salt falls out of an acid and its base both are equivalent at once.
    found = [row for k, row in enumerate(found) if not k or not row[0].same(found[k - 1][0])]
    events = []
    for number, (crossing, left, right) in enumerate(found, start=1):
        a, b = crossing.before, crossing.after
        came = history.added_ml[b] - history.added_ml[a] > 0.0
        added = history.added_ml[:, came].sum(axis=1)
        columns = (history.times, added)
        time, volume = (float(one[a] + crossing.share * (one[b] - one[a])) for one in columns)
        over = float(added[-1]) - volume
        which = f" (end point {number} of {len(found)})" if len(found) > 1 else ""
        tail = f"; overshot by {over:.2f} mL" if number == len(found) else ""
        words = f"{left} and {right} are equivalent in {vessel} after {volume:.2f} mL{which}{tail}"
        values = {"volume_ml": volume, "overshot_ml": over, "number": number}
        events.append(EffectEvent(time, "end-point", (vessel,), None, values, words))
    return events


def _of_protons(matter: Matter, vessel: str) -> Iterator[tuple[_Crossing, str, str]]:
    speciation, chemistry = matter.recipe.speciation, matter.recipe.chemistry
    if speciation is None:
        return
    history, parts = matter.histories[vessel], speciation.mixture.parts
    totals = matter.totals(history.amounts)
    there = {part: totals[:, place] for place, part in enumerate(parts) if place and totals[:, place].any()}
    steps = sorted({pka for part in there for pka in chemistry.pka.get(part, ()) if STRONGEST < pka < WEAKEST})
    for low, high in zip([-np.inf, *steps], [*steps, np.inf], strict=True):
        kept = sum(
            (sum(pka >= high for pka in chemistry.pka.get(part, ())) * amount for part, amount in there.items()),
            np.zeros(len(totals)),
        )
        excess = totals[:, 0] - kept
        for crossing in _crossings(excess):
            a, b = crossing.before, crossing.after
            point = totals[a] + crossing.share * (totals[b] - totals[a])
            litres = 1e-3 * float(history.volume_ml[a] + crossing.share * (history.volume_ml[b] - history.volume_ml[a]))
            amounts = dict(zip(parts, point.tolist(), strict=True))
            sizes = [
                sum(amount for part, amount in amounts.items() if pka in chemistry.pka.get(part, ()))
                for pka in (low, high) if np.isfinite(pka)
            ]  # fmt: skip
            size = min(sizes, default=float(np.abs(excess).max()))
            if size > 0.0 and litres > 0.0 and _inflects(matter, point, size, litres):
                names = _names(matter, vessel, crossing, low, high)
                if names is not None:
                    yield crossing, names[0], names[1]


def _inflects(matter: Matter, point: FloatArray, size: float, litres: float) -> bool:
    """Whether the pH is steepest where as many protons are there as counted, and flatter on both sides."""
    assert matter.recipe.speciation is not None
    totals = np.tile(point, (len(HALF_STEP), 1))
    totals[:, 0] += HALF_STEP * size
    ph = equilibrium(matter.recipe.speciation.mixture, totals, np.full(len(totals), litres)).ph
    steep, middle = -np.diff(ph) / np.diff(HALF_STEP), 0.5 * (HALF_STEP[1:] + HALF_STEP[:-1])
    near = np.abs(middle) <= NARROW
    flat = (steep[middle < -NARROW].min(), steep[middle > NARROW].min())
    return bool(steep[near].max() > STEEPER * max(flat))


def _names(matter: Matter, vessel: str, crossing: _Crossing, low: float, high: float) -> tuple[str, str] | None:
    """Acids and bases, as they were brought, that are equivalent at a cut; ``None``: one of the two is missing."""
    history, chemistry = matter.histories[vessel], matter.recipe.chemistry
    came = np.flatnonzero(history.added_ml[crossing.after] > history.added_ml[crossing.before])
    fills = matter.recipe.contents
    sources = [name for name, place in matter.ledger.at.items() if place in came]
    titrants = {formula for name in sources if name in fills for formula in fills[name].amounts}
    brought = {
        column.removesuffix(BROUGHT) for column in matter.ledger.column
        if column.endswith(BROUGHT) and matter.amount(vessel, column)[crossing.before] > 0.0
    }  # fmt: skip

    def steps(formula: str) -> list[float]:
        return [pka for part in chemistry.parts(formula) or () for pka in chemistry.pka.get(part, ())]

    def gives(formula: str) -> bool:
        strong = all(pka <= STRONGEST for pka in steps(formula))
        return chemistry.is_acid(formula) and (strong or any(pka <= low for pka in steps(formula)))

    def takes(formula: str) -> bool:
        strong = (chemistry.parts(formula) or {}).get(PROTON, 0) < 0
        return strong or (chemistry.is_base(formula) and any(pka >= high for pka in steps(formula)))

    mine = sorted(brought - titrants) or sorted(brought)
    if crossing.rising:
        acids, bases = sorted(filter(chemistry.is_acid, titrants)), [formula for formula in mine if takes(formula)]
    else:
        acids, bases = [formula for formula in mine if gives(formula)], sorted(filter(chemistry.is_base, titrants))
    return (" + ".join(acids), " + ".join(bases)) if acids and bases else None


def _of_ions(matter: Matter, vessel: str) -> Iterator[tuple[_Crossing, str, str]]:
    """Where a metal ion has as much as falls out with it, one salt after the other, the least soluble first."""
    speciation = matter.recipe.speciation
    if speciation is None:
        return
    mixture, history = speciation.mixture, matter.histories[vessel]
    totals = matter.totals(history.amounts)
    salts = [row for row, uses in enumerate(mixture.uses) if uses[0] == 0.0 and np.count_nonzero(uses) == 2]
    for metal in (place for place, part in enumerate(mixture.parts) if charge_of(part) > 0):
        bound, names = np.zeros(len(totals)), []
        for salt in sorted((row for row in salts if mixture.uses[row, metal]), key=lambda row: mixture.products[row]):
            (other,) = (place for place in np.flatnonzero(mixture.uses[salt]).tolist() if place != metal)
            bound = bound + totals[:, other] * mixture.uses[salt, metal] / mixture.uses[salt, other]
            names.append(mixture.parts[other])
            if not totals[:, other].any():
                continue
            for crossing in _crossings(totals[:, metal] - bound):
                if _jumps(matter, vessel, crossing, metal, totals):
                    yield crossing, mixture.parts[metal], " + ".join(sorted(names))


def _jumps(matter: Matter, vessel: str, crossing: _Crossing, metal: int, totals: FloatArray) -> bool:
    """Whether the free metal ion changes by a power of ten about a crossing: less nobody sees."""
    assert matter.recipe.speciation is not None
    mixture, volume = matter.recipe.speciation.mixture, matter.histories[vessel].volume_ml
    a, b = crossing.before, crossing.after
    point = np.tile(totals[a] + crossing.share * (totals[b] - totals[a]), (2, 1))
    point[:, metal] *= (1.0 - ABOUT, 1.0 + ABOUT)
    litres = np.full(2, 1e-3 * (volume[a] + crossing.share * (volume[b] - volume[a])))
    free = mixture.species.index(mixture.parts[metal])
    low, high = equilibrium(mixture, point, litres).species[:, free]
    return bool(low > 0.0 and high > 10.0 * low)


def _of_electrons(matter: Matter, vessel: str) -> Iterator[tuple[_Crossing, str, str]]:
    """Where the second of two reagents of an equation that runs to its end begins to be left over."""
    history = matter.histories[vessel]
    for reaction in matter.recipe.reactions:
        process = matter.recipe.processes[reaction.process] if reaction.process >= 0 else None
        if process is None or process.rate is not None:
            continue
        used = [column for column, many in process.changes.items() if many < 0.0 and column not in (PROTON, "H2O")]
        if len(used) == 2:
            left, right = (matter.amount(vessel, column) / -process.changes[column] for column in used)
            if not history.extents[-1, reaction.process] > 0.0:
                continue
            for crossing in _crossings(left - right):
                first, second = sorted(used)
                yield crossing, first, second


def _crossings(excess: FloatArray) -> Iterator[_Crossing]:
    rows = np.flatnonzero(np.abs(excess) > LEAST * np.abs(excess).max(initial=0.0))
    signs = np.sign(excess[rows])
    for turn in np.flatnonzero(np.diff(signs)).tolist():
        a, b = int(rows[turn]), int(rows[turn + 1])
        yield _Crossing(a, b, float(excess[a] / (excess[a] - excess[b])), bool(excess[b] > excess[a]))
