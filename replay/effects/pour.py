"""Liquid leaves a tilted vessel as soon as the tilt keeps less than stands in it, and goes where it falls."""

import numpy as np

from replay.effects.declaring import Declaration
from replay.effects.inputs import EffectInputs
from replay.effects.models.outflow import flows
from replay.effects.movement import gone_ml, movement_of, volumes
from replay.effects.output import EffectOutput, Findings, LaneSpan
from replay.effects.protocol import spec_of
from replay.effects.vessels import check_vessels, flow_event
from sessions.model.scene import Scene


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``pour``, ``spill`` and ``overflow``; volumes of vessels and of all that was spilled.

    A tilt that the doctor calls a ``turn-outlier``, or that only a jump leads to, pours nothing.
    """
    liquid_movement = movement_of(inputs)
    source_names = dict.fromkeys(name for declared in inputs.declared for name in declared["from"])
    names = dict.fromkeys((*source_names, *(name for declared in inputs.declared for name in declared["into"])))
    least_ml = min(declared["least_ml"] for declared in inputs.declared)
    findings = Findings(len(inputs))
    own_streams = [
        stream for stream in liquid_movement.streams if stream.source in (names if stream.over else source_names)
    ]
    for stream in own_streams:
        findings.ran[stream.frames] |= not stream.over
    for flow in flows(own_streams, least_ml):
        source, target = flow.source, flow.target
        name, text = ("pour", f"poured from {source} into {target}") if target else ("spill", f"spilled from {source}")
        findings.events.append(flow_event(inputs, flow, name, f"are {text}"))
        flow_word = f"into {target}" if target else "runs over" if flow.over else "spills"
        findings.add_lane(source, LaneSpan(float(flow.times[0]), float(flow.times[-1]), flow_word))
    for name in names:
        findings.series[f"{name}/volume"] = volume = liquid_movement.changes(inputs.times, name)
        findings.liquids[name] = liquid_movement.vessels[name].liquid_to_draw(volume.times, volume.values)
    spilled_streams = [stream for stream in own_streams if not stream.target and not stream.over]
    spilled_ml = np.cumsum(gone_ml(len(inputs), spilled_streams))
    findings.series["spilled/volume"] = volumes(inputs.times, spilled_streams, spilled_ml)
    return findings.output(liquid_movement)


def _check_declaration(declared: Declaration, _scene: Scene) -> None:
    if set(declared["from"]) == set(declared["into"]) and len(declared["from"]) == 1:
        raise declared.fail(f"{declared['from'][0]!r} pours into itself; name another vessel in into")


SPEC = spec_of("pour", compute, check=_check_declaration, check_all=check_vessels)
