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
    found, moved = Findings(len(inputs)), movement_of(inputs)
    names = dict.fromkeys(declared["body"] for declared in inputs.declared)
    told = {name for declared in inputs.tables.get("pour", ()) for name in declared["into"]}
    into = {name for declared in inputs.declared for name in declared["into"]}
    mine = [one for one in moved.streams if one.source in (into - told if one.over else names)]
    for name in names:
        gone = gone_ml(len(inputs), (one for one in mine if one.source == name and not one.over))
        # Shown too at the frames about a flow, so that a line through them has no slope where nothing ran.
        wanted = gone > 0.0
        found.ran |= wanted
        found.lanes[name] = inputs.shown(spans_of(wanted), "open")
        found.series[f"{name}/delivered"] = _shown(inputs, wanted, np.cumsum(gone))
        found.series[f"{name}/volume"] = left = _shown(inputs, wanted, moved.volume_ml[name])
        found.liquids[name] = moved.vessels[name].drawn(left.times, left.values)
    for flow in flows(mine, 0.0):
        name, where = ("run-in", f"into {flow.target}") if flow.target else ("spill", "beside everything")
        found.events.append(flow_event(inputs, flow, name, f"run from {flow.source} {where}", digits=2))
    return found.output(moved)


def _shown(inputs: EffectInputs, flowing: BoolArray, values: FloatArray) -> Series:
    """Where it flowed, at the frames before and after, and at the first and last."""
    wanted = flowing.copy()
    wanted[:-1] |= flowing[1:]
    wanted[1:] |= flowing[:-1]
    wanted[[0, -1]] = True
    return Series(inputs.times[wanted], values[wanted], "mL")


def _check(declared: Declaration, _scene: Scene) -> None:
    if not any(declared["axis"]):
        raise declared.fail("axis is (0, 0, 0); give the direction about which the stopcock turns")
    if declared["body"] in declared["into"]:
        raise declared.fail(f"into: {declared['body']!r} runs into itself; name what stands below")


SPEC = spec_of("burette", compute, check=_check, check_all=check_vessels)
