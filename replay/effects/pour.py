"""Liquid leaves a tilted vessel as soon as the tilt keeps less than stands in it, and goes where it falls."""

import numpy as np

from replay.effects.declaring import Declaration, bodies, number
from replay.effects.inputs import EffectInputs
from replay.effects.models.outflow import GAP_S, flows
from replay.effects.movement import gone_ml, movement_of, volumes
from replay.effects.output import EffectEvent, EffectOutput, Findings, LaneSpan
from replay.effects.protocol import EffectSpec
from replay.effects.vessels import check_vessels, flow_event
from sessions.model.scene import Scene


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``pour``, ``spill``, ``overflow`` and ``glitch``; volumes of vessels and of all that was spilled.

    A tilt that the doctor calls a ``turn-outlier``, or that only a jump leads to, pours nothing: ``glitch`` says so.
    """
    moved = movement_of(inputs)
    sources = dict.fromkeys(name for declared in inputs.declared for name in declared["from"])
    names = dict.fromkeys((*sources, *(name for declared in inputs.declared for name in declared["into"])))
    least = min(declared["least_ml"] for declared in inputs.declared)
    found = Findings(len(inputs))
    mine = [one for one in moved.streams if one.source in (names if one.over else sources)]
    for one in mine:
        found.ran[one.frames] |= not one.over
    for flow in flows(mine, least):
        source, target = flow.source, flow.target
        name, words = ("pour", f"poured from {source} into {target}") if target else ("spill", f"spilled from {source}")
        found.events.append(flow_event(inputs, flow, name, f"are {words}"))
        word = f"into {target}" if target else "runs over" if flow.over else "spills"
        found.lane(source, LaneSpan(float(flow.times[0]), float(flow.times[-1]), word))
    for name in sources:
        for row in moved.glitches[name]:
            words = f"{name} lies tipped in one frame: a glitch of the tracker, which pours nothing"
            found.events.append(EffectEvent(float(inputs.times[row]), "glitch", (name,), None, {}, words, "warning"))
    for name in names:
        found.series[f"{name}/volume"] = volume = moved.changes(inputs.times, name)
        found.liquids[name] = moved.vessels[name].drawn(volume.times, volume.values)
    spilled = [one for one in mine if not one.target and not one.over]
    gone = np.cumsum(gone_ml(len(inputs), spilled))
    found.series["spilled/volume"] = volumes(inputs.times, spilled, gone)
    return found.output(moved)


def _check(declared: Declaration, _scene: Scene) -> None:
    if set(declared["from"]) == set(declared["into"]) and len(declared["from"]) == 1:
        raise declared.fail(f"{declared['from'][0]!r} pours into itself; name another vessel in into")


SPEC = EffectSpec(
    kind="pour",
    about="Liquid leaves a tilted vessel.",
    compute=compute,
    uses=("burette",),
    fields={
        "from": bodies("vessels that may pour"),
        "into": bodies("vessels that may receive", default=()),
        "least_ml": number(
            "less than this in one go is booked and is no event", "mL", default=0.05, least=0.0,
            source="chosen by us: about a drop, which nobody calls a pour",
        ),
        "solids_along": number(
            "share of a solid that goes along with the liquid", default=0.0, least=0.0, most=1.0,
            source="a settled solid stays when liquid is decanted; 1 is a solid stirred up evenly",
        ),
    },
    trigger="a vessel tilted beyond the angle at which its liquid reaches the lip",
    sources=(
        "volume kept: the cavity's mesh, or the declared cylinder, cut by the plane through its rim (models/sliced.py)",
        "rate: as the tilt says, without inertia, and no faster than a weir as wide as the opening (Poleni)",
        "destination: free fall from the lip with the lip's velocity, standard gravity (CGPM 1901)",
        f"flows within {GAP_S} s are one: chosen by us",
    ),
    check=_check,
    check_all=check_vessels,
)  # fmt: skip
