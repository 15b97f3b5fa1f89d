"""A salt on a wire shows its colour when the wire's tip stays in the flame long enough."""

from collections.abc import Mapping

import numpy as np

from replay import words
from replay.effects.declaring import Declaration
from replay.effects.inputs import BodyPoses, EffectInputs
from replay.effects.output import EffectEvent, EffectOutput, Findings, FloatArray
from replay.effects.protocol import spec_of
from replay.effects.spans import BoolArray, FrameRange, steady_spans
from replay.effects.vessels import Vessel, check_vessels, is_inside
from sessions.input_files import nearest
from sessions.model.scene import Scene


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``dip`` and ``flame`` with the salt and the colour seen, ``""`` when the visit was too short."""
    findings = Findings(len(inputs))
    for declared in inputs.declared:
        wire = declared["wire"]
        poses = inputs.poses(wire)
        tips = poses.point(declared["tip"])
        dips = _dips_in_liquids(inputs, declared, tips, poses)
        for vessel, span in dips:
            findings.ran[slice(*span)] = True
            salt = declared["dips"][vessel]
            start, text = float(inputs.times[span[0]]), f"{wire} is dipped into {salt}"
            findings.events.append(EffectEvent(start, "dip", (wire, vessel), inputs.end(span[1]), {"salt": salt}, text))
            findings.add_lane(wire, *inputs.lane_spans([span], f"in {vessel}"))
        for span in steady_spans(_in_cone(inputs, declared, tips), poses.valid):
            findings.ran[slice(*span)] = True
            event = _flame_event(inputs, declared, span, dips)
            findings.events.append(event)
            findings.add_lane(wire, *inputs.lane_spans([span], str(event.values["seen"]) or "in the flame"))
    return findings.output()


def _dips_in_liquids(
    inputs: EffectInputs, declared: Declaration, tips: FloatArray, poses: BodyPoses
) -> list[tuple[str, FrameRange]]:
    """Vessel and frames of each dip below the level of a liquid, in order."""
    dips: list[tuple[str, FrameRange]] = []
    for name in declared["dips"]:
        vessel = Vessel(inputs.body(name))
        vessel_poses = inputs.poses(name)
        height = vessel_poses.to_body_frame(tips)[:, 1]
        liquid_level = float(vessel.level(np.array([vessel.volume_ml]))[0])
        is_dipped = is_inside(tips, vessel_poses, vessel) & (height > vessel.floor) & (height <= liquid_level)
        dips += [(name, span) for span in steady_spans(is_dipped, poses.valid)]
    return sorted(dips, key=lambda dip: dip[1])


def _in_cone(inputs: EffectInputs, declared: Declaration, tips: FloatArray) -> BoolArray:
    lamp = inputs.poses(declared["flame"])
    lamp_points = lamp.to_body_frame(tips) - np.array(declared["base"])
    height, radius = declared["flame_height"], declared["flame_radius"]
    axis_distance = np.hypot(lamp_points[:, 0], lamp_points[:, 2])
    return lamp.valid & (lamp_points[:, 1] >= 0.0) & (axis_distance <= radius * (1.0 - lamp_points[:, 1] / height))


def _flame_event(
    inputs: EffectInputs, declared: Declaration, span: FrameRange, dips: list[tuple[str, FrameRange]]
) -> EffectEvent:
    start, end = inputs.span_times(span)
    earlier_vessels = [vessel for vessel, dip in dips if dip[0] < span[0]]
    salt = declared["dips"][earlier_vessels[-1]] if earlier_vessels else ""
    long_enough = end - start >= declared["seconds"]
    colour = declared["colours"].get(salt, "") if long_enough else ""
    message = f"{salt or 'a clean wire'} is in the flame for {words.decimal(end - start, 1)} s: {colour or 'no colour'}"
    bodies = (declared["wire"], declared["flame"])
    return EffectEvent(
        start, "flame", bodies, inputs.end(span[1]), {"salt": salt, "seen": colour, "seconds": end - start}, message
    )


def _check_declaration(declared: Declaration, _scene: Scene) -> None:
    vessel_names = declared["vessels"]
    for name in declared["dips"]:
        if name not in vessel_names:
            raise declared.fail(f"dips: {name!r} is no vessel of the scene{nearest(name, vessel_names)}")
    for name in vessel_names:
        if name not in declared["dips"]:
            raise declared.fail(f"dips: nothing says which salt is in {name!r}")
    salts = set(declared["dips"].values())
    for salt in declared["colours"]:
        if salt not in salts:
            raise declared.fail(f"colours: no vessel of dips holds {salt!r}{nearest(salt, salts)}")


def _check_all(tables: Mapping[str, tuple[Declaration, ...]], scene: Scene, file: str) -> None:
    check_vessels(tables, scene, file)


SPEC = spec_of("flame-test", compute, check=_check_declaration, check_all=_check_all)
