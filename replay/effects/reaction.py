"""A declared equation runs to the end of its limiting reagent, at once or at a rate; acids and bases give a pH."""

from dataclasses import dataclass

import numpy as np

from replay.effects.declaring import Declaration, mapping, number, text
from replay.effects.inputs import EffectInputs
from replay.effects.models.acid_base import AcidBase
from replay.effects.models.equation import Equation, approach, equation_of
from replay.effects.models.transfers import History, Mixture
from replay.effects.output import EffectEvent, EffectOutput, Findings, FloatArray, LaneSpan, Series
from replay.effects.protocol import EffectSpec
from sessions.model.scene import Scene
from sessions.scene_files.toml_table import is_number


@dataclass(frozen=True, eq=False)
class Reacted:
    """One equation in one vessel."""

    # vessel, equation: where, and what
    vessel: str
    equation: Equation
    history: History  # of the vessel, as brought
    # times, extent: (n,) seconds and mol of reaction; every frame from the begin on where it has a rate
    times: FloatArray
    extent: FloatArray


def compute(inputs: EffectInputs) -> EffectOutput:
    """Event ``end-point`` where acid and base are equivalent; extents and pH as series."""
    mixed: Mixture = inputs.output("mixing").data
    found, reacted = Findings(len(inputs)), list[Reacted]()
    for declared in inputs.declared:
        equation, chemistry = equation_of(declared.text("equation")), _chemistry(declared)
        for vessel, history in mixed.histories.items():
            goal = equation.extent({formula: history.amount(formula) for formula in equation.reagents})
            if not (goal > 0.0).any():
                continue  # the reagents are never together
            one = Reacted(vessel, equation, history, *_course(inputs, declared, history, goal))
            reacted.append(one)
            found.ran |= np.isin(inputs.times, one.times)
            inputs.count("rows reacted", len(one.times))
            found.series[f"{vessel}/extent"] = Series(one.times, one.extent, "mol")
            found.lanes[vessel] = [LaneSpan(_begin(one), float(one.times[-1]), declared.text("equation"))]
            if any(chemistry.is_acid(formula) or chemistry.is_base(formula) for formula in equation.reagents):
                found.series[f"{vessel}/pH"] = _ph(inputs, one, chemistry)
                found.events += _end_points(one, chemistry)
    return found.output(tuple(reacted))


def _begin(one: Reacted) -> float:
    there = np.flatnonzero(one.extent > 0.0)
    return float(one.times[max(0, int(there[0]) - 1)]) if len(there) else float(one.times[0])


def _course(
    inputs: EffectInputs, declared: Declaration, history: History, goal: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Times and extent, from the extent at the end of the limiting reagent."""
    rate = declared.values["rate_per_s"]
    if rate is None:
        return history.times, goal
    first = int(history.frames[max(0, int(np.argmax(goal > 0.0)) - 1)])
    times = inputs.times[first:]
    held = goal[np.maximum(0, np.searchsorted(history.times, times, side="right") - 1)]
    return times, approach(times, held, float(rate))


def _ph(inputs: EffectInputs, one: Reacted, chemistry: AcidBase) -> Series:
    """pH where there is liquid. Acid and base stand in the charge balance as brought; what else consumes them does not.

    ``HCl + NaOH -> NaCl + H2O`` changes no charge balance: the salt is what the balance says anyway.
    """
    reagents = one.equation.reagents
    neutral = any(map(chemistry.is_acid, reagents)) and any(map(chemistry.is_base, reagents))
    litres = np.interp(one.times, one.history.times, one.history.volume_ml) * 1e-3
    there = litres > 0.0
    concentrations: dict[str, FloatArray] = {}
    for formula in one.history.amounts:
        amount = np.interp(one.times, one.history.times, one.history.amount(formula))
        used = 0.0 if neutral else one.extent * reagents.get(formula, 0)
        concentrations[formula] = np.maximum(0.0, amount - used)[there] / litres[there]
    inputs.count("pH solved", int(there.sum()))
    return Series(one.times[there], chemistry.ph(concentrations), "pH")


def _end_points(one: Reacted, chemistry: AcidBase) -> list[EffectEvent]:
    """Where the excess of acid over base changes its sign, between two rows by a straight line."""
    acids = [formula for formula in one.equation.reagents if chemistry.is_acid(formula)]
    bases = [formula for formula in one.equation.reagents if chemistry.is_base(formula)]
    if len(acids) != 1 or len(bases) != 1:
        return []
    history, parts = one.history, one.equation.reagents
    excess = history.amount(acids[0]) / parts[acids[0]] - history.amount(bases[0]) / parts[bases[0]]
    events = []
    for row in np.flatnonzero(np.sign(excess[1:]) * np.sign(excess[0]) <= 0.0)[:1].tolist():
        if excess[row] == 0.0:
            continue
        share = float(excess[row] / (excess[row] - excess[row + 1]))
        time, volume = (
            float(column[row] + share * (column[row + 1] - column[row])) for column in (history.times, history.added_ml)
        )
        words = f"{acids[0]} and {bases[0]} are equivalent in {one.vessel} after {volume:.2f} mL"
        events.append(EffectEvent(time, "end-point", (one.vessel,), None, {"volume_ml": volume}, words))
    return events


def _chemistry(declared: Declaration) -> AcidBase:
    acids = {formula: tuple(float(value) for value in pka) for formula, pka in declared.mapping("acids").items()}
    bases = {formula: float(value) for formula, value in declared.mapping("bases").items()}
    return AcidBase(acids, bases, declared.number("pkw"))


def _check(declared: Declaration, _scene: Scene) -> None:
    try:
        equation_of(declared.text("equation"))
    except ValueError as error:
        raise declared.fail(f"equation: {error}") from error
    for formula, pka in declared.mapping("acids").items():
        rising = isinstance(pka, list | tuple) and pka and all(map(is_number, pka)) and list(pka) == sorted(pka)
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
