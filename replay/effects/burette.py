"""Liquid runs out of a burette as far as its stopcock is turned, and falls into what stands below."""

import numpy as np

from replay.effects.declaring import Declaration
from replay.effects.inputs import EffectInputs
from replay.effects.models.outflow import flows
from replay.effects.movement import gone_ml, movement_of
from replay.effects.output import EffectOutput, Findings, FloatArray, Series
from replay.effects.protocol import spec_of
from replay.effects.spans import BoolArray, spans_of
from replay.effects.vessels import check_vessels, flow_event
from sessions.model.scene import Scene


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``run-in``, ``spill`` and ``overflow``; delivered and left volume as series; a lane of the open spans."""
    findings, liquid_movement = Findings(len(inputs)), movement_of(inputs)
    burette_names = dict.fromkeys(declared["body"] for declared in inputs.declared)
    pouring_targets = {name for declared in inputs.tables.get("pour", ()) for name in declared["into"]}
    receiving_vessels = {name for declared in inputs.declared for name in declared["into"]}
    own_streams = [
        stream
        for stream in liquid_movement.streams
        if stream.source in (receiving_vessels - pouring_targets if stream.over else burette_names)
    ]
    for name in burette_names:
        gone_volumes = gone_ml(
            len(inputs), (stream for stream in own_streams if stream.source == name and not stream.over)
        )
        # Shown too at the frames about a flow, so that a line through them has no slope where nothing ran.
        is_flowing = gone_volumes > 0.0
        findings.ran |= is_flowing
        findings.lanes[name] = inputs.lane_spans(spans_of(is_flowing), "open")
        findings.series[f"{name}/delivered"] = _series_around_flow(inputs, is_flowing, np.cumsum(gone_volumes))
        findings.series[f"{name}/volume"] = remaining_volume = _series_around_flow(
            inputs, is_flowing, liquid_movement.volume_ml[name]
        )
        findings.liquids[name] = liquid_movement.vessels[name].liquid_to_draw(
            remaining_volume.times, remaining_volume.values
        )
    for flow in flows(own_streams, 0.0):
        name, where = ("run-in", f"into {flow.target}") if flow.target else ("spill", "beside everything")
        findings.events.append(flow_event(inputs, flow, name, f"run from {flow.source} {where}", digits=2))
    return findings.output(liquid_movement)


def _series_around_flow(inputs: EffectInputs, flowing: BoolArray, values: FloatArray) -> Series:
    """Series of the frames in which it flowed, those beside them, and the first and last."""
    is_flowing = flowing.copy()
    is_flowing[:-1] |= flowing[1:]
    is_flowing[1:] |= flowing[:-1]
    is_flowing[[0, -1]] = True
    return Series(inputs.times[is_flowing], values[is_flowing], "mL")


def _check_declaration(declared: Declaration, _scene: Scene) -> None:
    if not any(declared["axis"]):
        raise declared.fail("axis is (0, 0, 0); give the direction about which the stopcock turns")
    if declared["body"] in declared["into"]:
        raise declared.fail(f"into: {declared['body']!r} runs into itself; name what stands below")


SPEC = spec_of("burette", compute, check=_check_declaration, check_all=check_vessels)
