"""What was poured and met no declared opening is spilled: how much, when and where it landed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from replay.effects.declaring import bodies, number
from replay.effects.inputs import EffectInputs
from replay.effects.models.transfers import Transfer, flows, total_ml
from replay.effects.output import EffectEvent, EffectOutput, FloatArray, LaneSpan, Series
from replay.effects.pour_events import GAP_S
from replay.effects.protocol import EffectSpec
from replay.errors import EffectError

if TYPE_CHECKING:
    from replay.effects.models.transfers import Liquids


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``spill`` with a marker where it landed; all that was spilled so far as a series."""
    poured: Liquids = inputs.output("pour").data
    events: list[EffectEvent] = []
    lanes: dict[str, list[LaneSpan]] = {}
    lost: list[Transfer] = []
    ran = np.zeros(len(inputs), dtype=np.bool_)
    for declared in inputs.declared:
        watched = declared.bodies("from")
        for name in watched:
            if name not in poured.initial_ml:
                raise EffectError(
                    f"{declared.file}: {declared.place}: {name!r} is no vessel of an effect pour; name it there"
                )
        mine = [one for one in poured.transfers if not one.target and one.source in watched]
        lost += mine
        inputs.count("transfers that missed", len(mine))
        for flow in flows(mine, GAP_S, declared.number("least_ml")):
            events.append(_event(inputs, flow))
            lanes.setdefault(flow[0].source, []).append(LaneSpan(flow[0].time, flow[-1].time, "spills"))
    ran[[one.frame for one in lost]] = True
    return EffectOutput(
        tuple(sorted(events, key=lambda event: event.time)),
        {"spilled/volume": _together(inputs.times, sorted(set(lost), key=lambda one: one.frame))},
        {name: tuple(spans) for name, spans in lanes.items()},
        ran,
    )


def _together(times: FloatArray, lost: list[Transfer]) -> Series:
    """All that was lost by each time it was, from the first frame to the last."""
    at = [float(times[0]), *(one.time for one in lost), float(times[-1])] if len(times) else []
    sums = np.cumsum([0.0, *(one.volume_ml for one in lost), 0.0])
    return Series(np.array(at), sums[: len(at)], "mL")


def _event(inputs: EffectInputs, flow: tuple[Transfer, ...]) -> EffectEvent:
    first, last, volume = flow[0], flow[-1], total_ml(flow)
    end = None if last.frame == len(inputs) - 1 else last.time
    values = {"volume_ml": volume, "seconds": last.time - first.time}
    words = f"{volume:.1f} mL spilled from {first.source}"
    return EffectEvent(first.time, "spill", (first.source,), end, values, words, "warning", first.point)


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
