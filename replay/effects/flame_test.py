"""A salt on a wire shows its colour when the wire's tip stays in the flame long enough."""

from collections.abc import Mapping

import numpy as np

from replay import words
from replay.effects.declaring import Declaration
from replay.effects.inputs import BodyPoses, EffectInputs
from replay.effects.output import EffectEvent, EffectOutput, Findings, FloatArray
from replay.effects.protocol import spec_of
from replay.effects.spans import BoolArray, Span, steadied
from replay.effects.vessels import Vessel, check_vessels, inside
from sessions.input_files import nearest
from sessions.model.scene import Scene


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``dip`` and ``flame`` with the salt and the colour seen, ``""`` when the visit was too short."""
    findings = Findings(len(inputs))
    for declared in inputs.declared:
        wire = declared["wire"]
        poses = inputs.poses(wire)
        tips = poses.point(declared["tip"])
        dips = _dips(inputs, declared, tips, poses)
        for vessel, span in dips:
            findings.ran[slice(*span)] = True
            salt = declared["dips"][vessel]
            start, text = float(inputs.times[span[0]]), f"{wire} is dipped into {salt}"
            findings.events.append(EffectEvent(start, "dip", (wire, vessel), inputs.end(span[1]), {"salt": salt}, text))
            findings.lane(wire, *inputs.lane_spans([span], f"in {vessel}"))
        for span in steadied(_in_cone(inputs, declared, tips), poses.valid):
            findings.ran[slice(*span)] = True
            event = _visit(inputs, declared, span, dips)
            findings.events.append(event)
            findings.lane(wire, *inputs.lane_spans([span], str(event.values["seen"]) or "in the flame"))
    return findings.output()


def _dips(inputs: EffectInputs, declared: Declaration, tips: FloatArray, poses: BodyPoses) -> list[tuple[str, Span]]:
    """Vessel and frames of each dip below the level of a liquid, in order."""
    dips: list[tuple[str, Span]] = []
    for name in declared["dips"]:
        vessel = Vessel(inputs.body(name))
        vessel_poses = inputs.poses(name)
        height = vessel_poses.local(tips)[:, 1]
        level = float(vessel.level(np.array([vessel.volume_ml]))[0])
        wet = inside(tips, vessel_poses, vessel) & (height > vessel.floor) & (height <= level)
        dips += [(name, span) for span in steadied(wet, poses.valid)]
    return sorted(dips, key=lambda dip: dip[1])


def _in_cone(inputs: EffectInputs, declared: Declaration, tips: FloatArray) -> BoolArray:
    lamp = inputs.poses(declared["flame"])
    local = lamp.local(tips) - np.array(declared["base"])
    height, radius = declared["flame_height"], declared["flame_radius"]
    across = np.hypot(local[:, 0], local[:, 2])
    return lamp.valid & (local[:, 1] >= 0.0) & (across <= radius * (1.0 - local[:, 1] / height))


def _visit(inputs: EffectInputs, declared: Declaration, span: Span, dips: list[tuple[str, Span]]) -> EffectEvent:
    start, end = inputs.ends(span)
    before = [vessel for vessel, dip in dips if dip[0] < span[0]]
    salt = declared["dips"][before[-1]] if before else ""
    long_enough = end - start >= declared["seconds"]
    colour = declared["colours"].get(salt, "") if long_enough else ""
    text = f"{salt or 'a clean wire'} is in the flame for {words.fixed(end - start, 1)} s: {colour or 'no colour'}"
    bodies = (declared["wire"], declared["flame"])
    return EffectEvent(
        start, "flame", bodies, inputs.end(span[1]), {"salt": salt, "seen": colour, "seconds": end - start}, text
    )


def _check(declared: Declaration, _scene: Scene) -> None:
    known = declared["vessels"]
    for name in declared["dips"]:
        if name not in known:
            raise declared.fail(f"dips: {name!r} is no vessel of the scene{nearest(name, known)}")
    for name in known:
        if name not in declared["dips"]:
            raise declared.fail(f"dips: nothing says which salt is in {name!r}")
    salts = set(declared["dips"].values())
    for salt in declared["colours"]:
        if salt not in salts:
            raise declared.fail(f"colours: no vessel of dips holds {salt!r}{nearest(salt, salts)}")


def _check_all(tables: Mapping[str, tuple[Declaration, ...]], scene: Scene, file: str) -> None:
    check_vessels(tables, scene, file)


SPEC = spec_of("flame-test", compute, check=_check, check_all=_check_all)
