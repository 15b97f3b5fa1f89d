"""What was poured and met no declared opening is spilled: how much, when and where it landed."""

import numpy as np

from replay.effects.declaring import bodies, number
from replay.effects.inputs import EffectInputs
from replay.effects.models.transfers import Liquids, Transfer, flows
from replay.effects.output import EffectOutput, Findings, FloatArray, LaneSpan, Series
from replay.effects.protocol import EffectSpec
from replay.effects.vessels import flow_event


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``spill`` with a marker where it landed; all that was spilled so far as a series."""
    poured: Liquids = inputs.output("pour").data
    found = Findings(len(inputs))
    lost: list[Transfer] = []
    for declared in inputs.declared:
        watched = declared.bodies("from")
        for name in watched:
            if name not in poured.initial_ml:
                raise declared.unmet(f"{name!r} is no vessel of an effect pour; name it there")
        mine = [one for one in poured.transfers if not one.target and one.source in watched]
        lost += mine
        inputs.count("transfers that missed", len(mine))
        for flow in flows(mine, declared.number("least_ml")):
            found.events.append(flow_event(inputs, flow, "spill", f"spilled from {flow[0].source}"))
            found.lane(flow[0].source, LaneSpan(flow[0].time, flow[-1].time, "spills"))
    found.ran[[one.frame for one in lost]] = True
    found.series["spilled/volume"] = _together(inputs.times, sorted(set(lost), key=lambda one: one.frame))
    return found.output()


def _together(times: FloatArray, lost: list[Transfer]) -> Series:
    """All that was lost by each time it was, from the first frame to the last."""
    at = [float(times[0]), *(one.time for one in lost), float(times[-1])] if len(times) else []
    sums = np.cumsum([0.0, *(one.volume_ml for one in lost), 0.0])
    return Series(np.array(at), sums[: len(at)], "mL")


SPEC = EffectSpec(
    kind="spill",
    about="Liquid that misses every opening is lost.",
    compute=compute,
    needs=("pour",),
    fields={
        "from": bodies("vessels of an effect pour"),
        "least_ml": number(
            "less than this in one go is booked and is no event", "mL", default=0.05, least=0.0,
            source="chosen by us: about a drop, as of a pour",
        ),
    },
    trigger="a pour whose arc enters no declared opening",
    sources=("destination: as of the effect pour",),
)  # fmt: skip
