"""Liquid runs out of a burette as far as its stopcock is turned, and falls into what stands below."""

from collections.abc import Mapping

import numpy as np

from replay.effects.declaring import Declaration, bodies, body, number, vector
from replay.effects.inputs import EffectInputs
from replay.effects.models.ballistic import GRAVITY
from replay.effects.models.transfers import Liquids, Transfer, flows
from replay.effects.output import EffectOutput, Findings, FloatArray, Series
from replay.effects.protocol import EffectSpec
from replay.effects.spans import BoolArray, spans_of
from replay.effects.vessels import ML, Vessel, flow_event, landing, vessels_of
from sessions.model.scene import Scene


def volume_run_out(
    times: FloatArray, area: FloatArray, *, discharge: float, section: float, head: float, available: float
) -> FloatArray:
    """Volume (n,) in m3 that has run out by each time; it never falls and never exceeds what is there.

    Torricelli: dV/dt = c A sqrt(2 g h) with dV = -S dh, so sqrt(h) falls by sqrt(g / 2) c / S times the integral of A.

    ``times``: (n,) seconds, not decreasing.
    ``area``: (n,) open area, m2, linear between the times.
    ``discharge``: c, without unit.
    ``section``, ``head``: S of the column, m2, and the level above the outlet at the first time, metres.
    ``available``: what may run out, m3.
    """
    if not len(times):
        return np.zeros(0)
    opened = np.concatenate([[0.0], np.cumsum(0.5 * (area[1:] + area[:-1]) * np.diff(times))])
    top = float(np.sqrt(max(0.0, head)))
    fall = np.minimum(np.sqrt(0.5 * GRAVITY) * discharge / section * opened, top)
    # S (h0 - (sqrt(h0) - fall)^2) without the difference of two nearly equal numbers.
    return np.asarray(np.minimum(section * fall * (2.0 * top - fall), max(0.0, available)))


def twist(rotation: FloatArray, axis: FloatArray) -> FloatArray:
    """Angle (T,) in radians, -pi to pi, by which rotations (T, 3, 3) about the unit ``axis`` (3,) turn."""
    vee = np.stack(
        [rotation[:, 2, 1] - rotation[:, 1, 2], rotation[:, 0, 2] - rotation[:, 2, 0],
         rotation[:, 1, 0] - rotation[:, 0, 1]], axis=1,
    )  # fmt: skip
    return np.asarray(np.arctan2(vee @ axis, np.trace(rotation, axis1=1, axis2=2) - 1.0))


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``run-in`` and ``spill`` with volumes; delivered and left volume as series; a lane of the open spans."""
    found = Findings(len(inputs))
    transfers: list[Transfer] = []
    initial: dict[str, float] = {}
    for declared in inputs.declared:
        name, into = declared.body("body"), vessels_of(inputs, declared.bodies("into"))
        burette = Vessel(inputs.body(name))
        delivered, opened = _run_out(inputs, declared, burette)
        transfers += _transfers(inputs, declared, into, delivered)
        initial.update({one: vessel.volume_ml for one, vessel in {name: burette, **into}.items()})
        left = _shown(inputs, opened, initial[name] - delivered)
        found.series[f"{name}/delivered"] = _shown(inputs, opened, delivered)
        found.series[f"{name}/volume"] = left
        found.liquids[name] = burette.drawn(left.times, left.values)
        found.lanes[name] = inputs.shown(spans_of(opened), "open")
        found.ran |= opened
    transfers.sort(key=lambda one: (one.frame, one.source))
    for flow in flows(transfers, 0.0):
        source, target = flow[0].source, flow[0].target
        what, where = ("run-in", f"into {target}") if target else ("spill", "beside everything")
        found.events.append(flow_event(inputs, flow, what, f"run from {source} {where}", digits=2))
    return found.output(Liquids(initial, tuple(transfers)))


def _run_out(inputs: EffectInputs, declared: Declaration, vessel: Vessel) -> tuple[FloatArray, BoolArray]:
    """Millilitres (T,) that have run out by each frame, and whether it is open in it."""
    angle = np.abs(np.degrees(_angle(inputs, declared)))
    angle[angle < declared.number("closed_below_deg")] = 0.0
    area = declared.number("full_area_m2") * np.minimum(1.0, angle / declared.number("full_angle_deg"))
    inputs.count("angles compared", len(area))
    inputs.count("frames open", int((area > 0.0).sum()))
    floor = vessel.floor - declared.vector("tip")[1]
    level = floor + vessel.volume_ml * ML / vessel.section_m2
    delivered = volume_run_out(
        inputs.times, area, discharge=declared.number("discharge"), section=vessel.section_m2, head=level,
        available=vessel.volume_ml * ML,
    )  # fmt: skip
    return delivered / ML, area > 0.0


def _angle(inputs: EffectInputs, declared: Declaration) -> FloatArray:
    """Angle (T,) in radians of the stopcock in the burette's frame; where it was not seen, as it was seen last."""
    key, stand = inputs.poses(declared.body("joint")), inputs.poses(declared.body("body"))
    axis = np.array(declared.vector("axis"))
    relative = key.relative_to(stand).held()
    return np.where(relative.valid, twist(relative.rotation, axis / np.sqrt(axis @ axis)), 0.0)


def _transfers(
    inputs: EffectInputs, declared: Declaration, vessels: Mapping[str, Vessel], delivered_ml: FloatArray
) -> list[Transfer]:
    held = {name: inputs.poses(name).held() for name in vessels}
    burette = inputs.poses(declared.body("body")).held()
    tips = burette.point(declared.vector("tip"))
    gained = np.diff(delivered_ml, prepend=0.0)
    found: list[Transfer] = []
    for frame in np.flatnonzero((gained > 0.0) & burette.valid).tolist():
        target, point = landing(inputs, vessels, held, frame, tips[frame], np.zeros(3))
        time, volume = float(inputs.times[frame]), float(gained[frame])
        found.append(Transfer(frame, time, declared.body("body"), target, volume, point))
    return found


def _shown(inputs: EffectInputs, opened: BoolArray, values: FloatArray) -> Series:
    """Where it changed, at the frame before, and at the first and last frame."""
    wanted = opened.copy()
    wanted[:-1] |= opened[1:]
    wanted[1:] |= opened[:-1]
    wanted[[0, -1]] = True
    return Series(inputs.times[wanted], values[wanted], "mL")


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
