"""Liquid runs out of a burette as far as its stopcock is turned, and falls into what stands below."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from replay.effects.declaring import Declaration, bodies, body, number, vector
from replay.effects.inputs import EffectInputs
from replay.effects.models.ballistic import disc_entered, place_at_height
from replay.effects.models.outflow import twist, volume_run_out
from replay.effects.models.transfers import Liquids, Transfer, flows, total_ml
from replay.effects.output import EffectEvent, EffectOutput, FloatArray, LaneSpan, Series
from replay.effects.pour_events import GAP_S, vector_of
from replay.effects.protocol import EffectSpec
from replay.effects.spans import BoolArray, spans_of
from replay.effects.vessels import ML, Vessel, last_known, vessels_of
from sessions.scene import Scene


@dataclass(frozen=True, eq=False)
class _Run:
    """One burette: its angle, what has run out, and in which frames it was open."""

    declared: Declaration
    name: str
    delivered_ml: FloatArray
    open: BoolArray


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``run-in`` and ``spill`` with volumes; delivered and left volume as series; a lane of the open spans."""
    runs = [_run(inputs, declared) for declared in inputs.declared]
    transfers = [one for run in runs for one in _transfers(inputs, run)]
    transfers.sort(key=lambda one: (one.frame, one.source))
    initial: dict[str, float] = {}
    series: dict[str, Series] = {}
    lanes: dict[str, tuple[LaneSpan, ...]] = {}
    for run in runs:
        vessels = vessels_of(inputs, (run.name, *run.declared.bodies("into")))
        initial.update({name: vessel.volume_ml for name, vessel in vessels.items()})
        series[f"{run.name}/delivered"] = _shown(inputs, run, run.delivered_ml)
        series[f"{run.name}/volume"] = _shown(inputs, run, initial[run.name] - run.delivered_ml)
        lanes[run.name] = tuple(LaneSpan(*_ends(inputs, span), "open") for span in spans_of(run.open))
    events = [_event(inputs, flow) for flow in flows(transfers, GAP_S, 0.0)]
    ran = np.any([run.open for run in runs], axis=0) if runs else np.zeros(len(inputs), dtype=np.bool_)
    left = {run.name: series[f"{run.name}/volume"] for run in runs}
    liquids = {name: Vessel(inputs.body(name)).drawn(one.times, one.values) for name, one in left.items()}
    return EffectOutput(tuple(events), series, lanes, ran, liquids, Liquids(initial, tuple(transfers)))


def _run(inputs: EffectInputs, declared: Declaration) -> _Run:
    name = declared.body("body")
    vessel = Vessel(inputs.body(name))
    angle = np.abs(np.degrees(_angle(inputs, declared)))
    angle[angle < declared.number("closed_below_deg")] = 0.0
    area = declared.number("full_area_m2") * np.minimum(1.0, angle / declared.number("full_angle_deg"))
    inputs.count("angles compared", len(area))
    inputs.count("frames open", int((area > 0.0).sum()))
    floor = vessel.size("floor", above=-np.inf) - declared.vector("tip")[1]
    level = floor + vessel.volume_ml * ML / vessel.section_m2
    delivered = volume_run_out(
        inputs.times, area, discharge=declared.number("discharge"), section=vessel.section_m2, head=level,
        available=vessel.volume_ml * ML,
    )  # fmt: skip
    return _Run(declared, name, delivered / ML, area > 0.0)


def _angle(inputs: EffectInputs, declared: Declaration) -> FloatArray:
    """Angle (T,) in radians of the stopcock in the burette's frame; where it was not seen, as it was seen last."""
    key, stand = inputs.poses(declared.body("joint")), inputs.poses(declared.body("body"))
    axis = np.array(declared.vector("axis"))
    relative = key.relative_to(stand)
    seen = last_known(relative)
    angle = twist(relative.rotation, axis / np.sqrt(axis @ axis))
    return np.where(seen < 0, 0.0, angle[np.maximum(seen, 0)])


def _transfers(inputs: EffectInputs, run: _Run) -> list[Transfer]:
    poses = {name: inputs.poses(name) for name in run.declared.bodies("into")}
    known = {name: last_known(one) for name, one in poses.items()}
    vessels = vessels_of(inputs, tuple(poses))
    burette = inputs.poses(run.name)
    tips, seen = burette.point(run.declared.vector("tip")), last_known(burette)
    gained = np.diff(run.delivered_ml, prepend=0.0)
    found: list[Transfer] = []
    for frame in np.flatnonzero((gained > 0.0) & (seen >= 0)).tolist():
        start = tips[seen[frame]]
        there = {name: row for name in poses if (row := int(known[name][frame])) >= 0}
        discs = [vessels[name].opening(poses[name], row) for name, row in there.items()]
        inputs.count("arcs", len(discs))
        target = disc_entered(start, np.zeros(3), discs)
        floor = min((float(poses[name].translation[row, 1]) for name, row in there.items()), default=float(start[1]))
        point = vector_of(start if target else place_at_height(start, np.zeros(3), floor))
        found.append(Transfer(frame, float(inputs.times[frame]), run.name, target, float(gained[frame]), point))
    return found


def _shown(inputs: EffectInputs, run: _Run, values: FloatArray) -> Series:
    """Where it changed, at the frame before, and at the first and last frame."""
    wanted = run.open.copy()
    wanted[:-1] |= run.open[1:]
    wanted[1:] |= run.open[:-1]
    wanted[[0, -1]] = True
    return Series(inputs.times[wanted], values[wanted], "mL")


def _event(inputs: EffectInputs, flow: tuple[Transfer, ...]) -> EffectEvent:
    first, last, volume = flow[0], flow[-1], total_ml(flow)
    end = None if last.frame == len(inputs) - 1 else last.time
    values = {"volume_ml": volume, "seconds": last.time - first.time}
    if first.target:
        words = f"{volume:.2f} mL run from {first.source} into {first.target}"
        return EffectEvent(first.time, "run-in", (first.source, first.target), end, values, words, point=first.point)
    words = f"{volume:.2f} mL run from {first.source} beside everything"
    return EffectEvent(first.time, "spill", (first.source,), end, values, words, "warning", first.point)


def _ends(inputs: EffectInputs, span: tuple[int, int]) -> tuple[float, float]:
    return float(inputs.times[span[0]]), float(inputs.times[min(span[1], len(inputs) - 1)])


def _check(declared: Declaration, _scene: Scene) -> None:
    if not any(declared.vector("axis")):
        raise declared.fail("axis is (0, 0, 0); give the direction about which the stopcock turns")


SPEC = EffectSpec(
    kind="burette",
    about="Liquid runs out of a burette through its stopcock.",
    compute=compute,
    fields={
        "body": body("the burette; its liquid stands from its cavity's floor on"),
        "joint": body("the stopcock, whose turn in the burette's frame opens it"),
        "into": bodies("vessels that may receive"),
        "full_area_m2": number("open area at the full angle", "m2", above=0.0),
        "full_angle_deg": number("turn that opens it fully; beyond it opens no further", "deg", above=0.0),
        "discharge": number("discharge coefficient of the outlet", above=0.0, most=1.0),
        "axis": vector("axis of the stopcock in the burette's frame", "", default=(0.0, 0.0, 1.0)),
        "tip": vector("where the liquid leaves, in the burette's frame", default=(0.0, 0.0, 0.0)),
        "closed_below_deg": number(
            "less turn than this is closed", "deg", default=0.1, least=0.0,
            source="chosen by us: five times the rotation noise of a VIVE tracker (0.02 deg, Niehorster et al. 2017)",
        ),
    },
    trigger="a stopcock turned beyond its closed range",
    sources=(
        "outflow: Torricelli's law with the scene's discharge coefficient, open area proportional to the angle",
        "the body's origin is the tip unless the scene says otherwise; drops fall straight down",
    ),
    check=_check,
)  # fmt: skip
