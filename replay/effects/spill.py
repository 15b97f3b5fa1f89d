"""What was poured and met no declared opening is spilled: how much, when and where it landed."""

from collections.abc import Mapping

import numpy as np

from replay.effects.declaring import Declaration, bodies, number
from replay.effects.inputs import EffectInputs
from replay.effects.models.outflow import Stream, flows
from replay.effects.movement import movement_of
from replay.effects.output import EffectOutput, Findings, FloatArray, LaneSpan, Series
from replay.effects.protocol import EffectSpec
from replay.effects.vessels import flow_event
from sessions.model.scene import Scene
from sessions.scene_files.toml_table import nearest


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``spill`` with a marker where it landed; all that was spilled so far as a series."""
    moved = movement_of(inputs)
    found = Findings(len(inputs))
    lost: dict[int, Stream] = {}
    for declared in inputs.declared:
        watched = declared.bodies("from")
        mine = [one for one in moved.streams if not one.target and not one.over and one.source in watched]
        lost.update({id(one): one for one in mine})
        inputs.count("transfers that missed", sum(len(one.frames) for one in mine))
        for flow in flows(mine, declared.number("least_ml")):
            found.events.append(flow_event(inputs, flow, "spill", f"are spilled from {flow.source}"))
            found.lane(flow.source, LaneSpan(float(flow.times[0]), float(flow.times[-1]), "spills"))
    for one in lost.values():
        found.ran[one.frames] = True
    found.series["spilled/volume"] = _together(inputs.times, list(lost.values()))
    return found.output()


def _together(times: FloatArray, lost: list[Stream]) -> Series:
    """All that was lost by each time it was, from the first frame to the last."""
    gone = np.zeros(len(times))
    for one in lost:
        gone[one.frames] += one.volume_ml
    rows = np.unique(np.concatenate([np.array([0, len(times) - 1][: len(times)]), np.flatnonzero(gone)]))
    return Series(times[rows], np.cumsum(gone)[rows], "mL")


def _check_all(tables: Mapping[str, tuple[Declaration, ...]], _scene: Scene, _file: str) -> None:
    poured = {name for one in tables["pour"] for name in one.bodies("from")}
    for declared in tables["spill"]:
        for name in declared.bodies("from"):
            if name not in poured:
                raise declared.fail(f"from: {name!r} is no vessel of an effect pour{nearest(name, poured)}")


SPEC = EffectSpec(
    kind="spill",
    about="Liquid that misses every opening is lost.",
    compute=compute,
    check_all=_check_all,
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
