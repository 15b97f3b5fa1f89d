"""Declared equations run to the end of what limits them, at once or at a rate, all on what there is; a pH shows it."""

from typing import Final

import numpy as np

from replay.effects.chemistry import Reaction, dissolved
from replay.effects.declaring import Declaration, mapping, number, text
from replay.effects.inputs import EffectInputs
from replay.effects.matter import Matter, matter_of
from replay.effects.models.ledger import BROUGHT, GAS, SOLID
from replay.effects.output import EffectEvent, EffectOutput, Findings, FloatArray, LaneSpan, Series
from replay.effects.protocol import EffectSpec
from sessions.model.scene import Scene
from sessions.scene_files.toml_table import is_number

LEAST: Final = 1e-6
"""An excess below this share of the greatest there was is none: what a slow reaction leaves ends no titration."""


def compute(inputs: EffectInputs) -> EffectOutput:
    """Event ``end-point`` where acid and base are equivalent; extents and pH as series."""
    matter, found = matter_of(inputs), Findings(len(inputs))
    for one in matter.recipe.reactions:
        for vessel, history in matter.histories.items():
            times = _times(inputs, matter, one, vessel)
            amounts, extents, volume_ml = matter.states(vessel, times)
            extent = extents[:, one.process] / one.per if one.process >= 0 else _protonated(matter, one, amounts)
            if (extent > 0.0).any():
                found.ran |= np.isin(inputs.times, times)
                inputs.count("rows reacted", len(times))
                name, equation = f"{vessel}/extent", one.declared.text("equation")
                found.series[f"{name} of {equation}" if name in found.series else name] = Series(times, extent, "mol")
                moving = np.flatnonzero(np.diff(extent, prepend=0.0))
                found.lane(vessel, LaneSpan(float(times[moving[0]]), float(times[moving[-1]]), equation))
            if one.acid_base and history.added_ml[-1].any() and _any(matter, one, amounts):
                wet = volume_ml > 0.0
                litres = volume_ml[wet] * 1e-3
                there = {
                    column: amounts[wet, place] / litres for column, place in matter.ledger.column.items()
                    if not column.endswith((BROUGHT, SOLID, GAS))
                }  # fmt: skip
                inputs.count("pH solved", len(litres))
                found.series[f"{vessel}/pH"] = Series(times[wet], one.chemistry.ph(there), "pH")
                found.events += _end_points(matter, one, vessel)
    return found.output()


def _times(inputs: EffectInputs, matter: Matter, one: Reaction, vessel: str) -> FloatArray:
    """Where it is told: at every change, and in every frame from its begin on where it is slow."""
    history = matter.histories[vessel]
    if one.declared.values["rate_per_s"] is None:
        return history.times
    on = (history.pending[:, one.process] > 0.0) | (history.extents[:, one.process] > 0.0)
    first = int(history.frames[int(np.argmax(on))]) if on.any() else len(inputs)
    return inputs.times[first:]


def _any(matter: Matter, one: Reaction, amounts: FloatArray) -> bool:
    """Whether anything that an acid or base of the equation brings to the pH is, or was, there."""
    parts = {part for formula in one.equation.reagents for part in dissolved(one.chemistry, formula)}
    mine = [place for column, place in matter.ledger.column.items() if column in parts]
    return bool((amounts[:, mine] > 0.0).any())


def _takers(one: Reaction) -> tuple[str, float]:
    """The weakest part that keeps protons when all has reacted, and how many on each; ``""``: none does."""
    sides = []
    for side in (one.equation.products, one.equation.reagents):
        parts: dict[str, float] = {}
        for formula, coefficient in side.items():
            for part, many in dissolved(one.chemistry, formula).items():
                parts[part] = parts.get(part, 0.0) + coefficient * many
        sides.append(parts)
    products, reagents = sides
    base, pka = one.chemistry.molecule_base, one.chemistry.pka
    weak = {part: pka[part][-1] for part in reagents if pka.get(part)}
    weak.update((part, step) for part in reagents if (step := base(part)) is not None)
    weakest = max(weak, key=lambda part: weak[part], default="")
    # What leaves as a gas has taken all protons there were on the left.
    kept = products if weakest in products else reagents
    return weakest, kept.get("H+", 0.0) / kept[weakest] if weakest else 0.0


def _protonated(matter: Matter, one: Reaction, amounts: FloatArray) -> FloatArray:
    """Mol (n,) of a base that holds a proton, for an equation that does nothing but hand it over."""
    part, many = _takers(one)
    free, base = (amounts[:, matter.ledger.column[name]] for name in ("H+", part))
    sources = [parts for formula in one.equation.reagents if part in (parts := dissolved(one.chemistry, formula))]
    own = max(parts.get("H+", 0) / parts[part] for parts in sources)
    return np.clip((free - own * base) / max(many - own, 1.0), 0.0, base)


def _end_points(matter: Matter, one: Reaction, vessel: str) -> list[EffectEvent]:
    """Where the excess of acid over base changes its sign, between two rows by a straight line.

    The volume is that which came from where the flow came from that did it: the titrant, rinses left out.
    """
    acids = [formula for formula in one.equation.reagents if one.chemistry.is_acid(formula)]
    bases = [formula for formula in one.equation.reagents if one.chemistry.is_base(formula)]
    # What is both, such as hydrogen carbonate, is a base to an acid and an acid to a base.
    if set(acids) < set(bases):
        bases = [formula for formula in bases if formula not in acids]
    else:
        acids = [formula for formula in acids if formula not in bases]
    if len(acids) != 1 or len(bases) != 1:
        return []
    history, (part, many) = matter.histories[vessel], _takers(one)
    excess = matter.amount(vessel, "H+") - matter.amount(vessel, "OH-") - many * matter.amount(vessel, part)
    rows = np.flatnonzero(np.abs(excess) > LEAST * np.abs(excess).max())
    turns = np.flatnonzero(np.diff(np.sign(excess[rows])))
    if not len(turns):
        return []
    a, b = rows[turns[0]], rows[turns[0] + 1]
    share = float(excess[a] / (excess[a] - excess[b]))
    came = history.added_ml[b] - history.added_ml[a] > 0.0
    added = history.added_ml[:, came].sum(axis=1)
    time, volume = (float(column[a] + share * (column[b] - column[a])) for column in (history.times, added))
    over = float(added[-1]) - volume
    words = f"{acids[0]} and {bases[0]} are equivalent in {vessel} after {volume:.2f} mL; overshot by {over:.2f} mL"
    values = {"volume_ml": volume, "overshot_ml": over}
    return [EffectEvent(time, "end-point", (vessel,), None, values, words)]


def _check(declared: Declaration, _scene: Scene) -> None:
    for formula, pka in declared.mapping("acids").items():
        rising = isinstance(pka, list | tuple) and all(map(is_number, pka)) and list(pka) == sorted(pka)
        if not rising:
            raise declared.fail(f"acids.{formula} is {pka!r}; give its pKa as a rising list of numbers")
    for formula, value in declared.mapping("bases").items():
        if not is_number(value):
            raise declared.fail(f"bases.{formula} is {value!r}; give the pKa of its conjugate acid")


SPEC = EffectSpec(
    kind="reaction",
    about="What is mixed reacts.",
    compute=compute,
    needs=("mixing",),
    fields={
        "equation": text("a balanced equation; its reagents are the formulas of solutes and solids"),
        "rate_per_s": number("first-order rate; absent: it ends at once", "1/s", default=None, above=0.0),
        "acids": mapping("weak acids: formula = [pKa of each proton, rising]", default={}),
        "bases": mapping("weak bases: formula = pKa of the conjugate acid", default={}),
        "pkw": number(
            "ion product of water", "", default=13.995, above=0.0,
            source="IAPWS R11-07: 13.995 at 25 degC and 0.1 MPa",
        ),
    },
    trigger="all reagents in one vessel, and a change of what is in it (or, with a rate, the time after)",
    sources=(
        "limiting reagent; first-order approach where a rate is declared",
        "pH: charge balance solved by bisection, activities taken as concentrations; strong acids and bases by name",
        "ion product of water: IAPWS R11-07",
    ),
    check=_check,
)  # fmt: skip
