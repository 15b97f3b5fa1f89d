"""Gas that a reaction gives is collected while the tube leads from the flask into the jar; else it leaks."""

import numpy as np

from replay.effects.chemistry.gas_laws import gas_ml_per_mol
from replay.effects.chemistry.matter import matter_of
from replay.effects.chemistry.mixture import GAS
from replay.effects.declaring import Declaration
from replay.effects.inputs import EffectInputs
from replay.effects.output import EffectEvent, EffectOutput, Findings, FloatArray, Series
from replay.effects.protocol import spec_of
from replay.effects.spans import BoolArray, Span, spans_of
from replay.effects.vessels import Vessel, check_vessels, inside, vessels_of
from sessions.model.scene import Scene


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``collect`` with volume and amount; collected and leaked volume as series, a lane of where it goes."""
    found = Findings(len(inputs))
    for declared in inputs.declared:
        gas, jar = declared["gas"], declared["jar"]
        evolved = _evolved(inputs, declared)
        gained = np.diff(evolved, prepend=0.0)
        evolving = gained > 0.0
        found.ran |= evolving
        if not evolving.any():
            continue
        caught = evolving & _led_in(inputs, declared)
        per_mol = _ml_per_mol(declared)
        collected = np.minimum(np.cumsum(np.where(caught, gained, 0.0)) * per_mol, Vessel(inputs.body(jar)).brim_ml)
        leaked = evolved * per_mol - collected
        shown = slice(max(0, int(np.argmax(evolving)) - 1), None)
        found.series[f"{jar}/{gas} collected"] = Series(inputs.times[shown], collected[shown], "mL")
        found.series[f"{jar}/{gas} leaked"] = Series(inputs.times[shown], leaked[shown], "mL")
        leaks = inputs.shown(spans_of(evolving & ~caught), "leaks")
        found.lanes[jar] = inputs.shown(spans_of(caught), "collected") + leaks
        found.events += [_event(inputs, declared, span, collected, leaked, per_mol) for span in spans_of(caught)]
    return found.output()


def _evolved(inputs: EffectInputs, declared: Declaration) -> FloatArray:
    """Mol (T,) of gas that the flask's reactions have given; what is poured off takes no gas back."""
    matter = matter_of(inputs)
    place = matter.ledger.column.get(declared["gas"] + GAS)
    if place is None:
        return np.zeros(len(inputs))
    return np.maximum.accumulate(matter.states(declared["from"], inputs.times)[0][:, place])


def _led_in(inputs: EffectInputs, declared: Declaration) -> BoolArray:
    """(T,) whether the tube's inlet is in the flask and its outlet in the jar, which stands on its mouth."""
    tube = inputs.poses(declared["tube"])
    vessels = vessels_of(inputs, (declared["from"], declared["jar"]))
    flask, jar = (inputs.poses(name).held() for name in vessels)
    enters = inside(tube.point(declared["inlet"]), flask, vessels[declared["from"]])
    leads = inside(tube.point(declared["outlet"]), jar, vessels[declared["jar"]])
    overturned = jar.rotation[:, 1, 1] < 0.0
    return enters & leads & overturned


def _ml_per_mol(declared: Declaration) -> float:
    return gas_ml_per_mol(declared["temperature_c"], declared["pressure_pa"], declared["antoine"])


def _event(
    inputs: EffectInputs, declared: Declaration, span: Span, collected: FloatArray, leaked: FloatArray, per_mol: float
) -> EffectEvent:
    first, stop = span
    before = float(collected[first - 1]) if first else 0.0
    volume = float(collected[stop - 1]) - before
    leaked_mol = float(leaked[first]) / per_mol
    values = {"volume_ml": volume, "moles": volume / per_mol, "leaked_before_mol": leaked_mol}
    bodies = (declared["jar"], declared["tube"])
    words = f"{volume:.1f} mL {declared['gas']} are collected in {bodies[0]}"
    return EffectEvent(float(inputs.times[first]), "collect", bodies, inputs.end(stop), values, words)


def _check(declared: Declaration, _scene: Scene) -> None:
    try:
        _ml_per_mol(declared)
    except ValueError as error:
        raise declared.fail(str(error)) from error


SPEC = spec_of("gas", compute, check=_check, check_all=check_vessels)
