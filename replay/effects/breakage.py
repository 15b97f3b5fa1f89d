"""Breakage by the speed across the surface at the moment of impact; a tracking jump, a loss or a gap breaks nothing.

A tracked pose shows where a rigid body was at each frame, and so the speed with which it came, from the five to nine
frames before, whatever happens afterwards. It cannot show where a body was hit between two frames, but for its box, how
hard a material is, or an impact just after a loss.
"""

import math
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from replay.effects.bounces import Impact, bounces
from replay.effects.contact import EffectContact, touches_of
from replay.effects.declaring import Declaration, Pair, number, pairs
from replay.effects.fitting import HALF_WINDOW, Parabola, before, fitted, settled_runs
from replay.effects.inputs import BodyPoses, EffectInputs
from replay.effects.output import EffectEvent, EffectOutput, Findings, FloatArray
from replay.effects.protocol import EffectSpec

MISFIT_M: Final = 0.002
"""Six times the noise of a VIVE tracker (0.3 mm): a path into an impact further from a parabola holds a jump."""


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``impact`` with speed and energy, and ``broken`` for the first that is too hard for a body."""
    found = Findings(len(inputs))
    for declared in inputs.declared:
        impacts: list[tuple[Pair, Impact]] = []
        for pair in declared["between"]:
            seen = bounces(inputs, pair)
            impacts += [(pair, bounce) for bounce in seen]
            for bounce in seen:
                found.ran[bounce.frame : bounce.frame + 3] = True
            for touch in touches_of(inputs, pair, flickers=True):
                # The frames that show a contact after a bounce show the same impact, or slower ones.
                if not any(0 <= touch.first - bounce.frame <= 2 * HALF_WINDOW for bounce in seen):
                    impact = _impact(inputs, touch, pair, found.ran)
                    impacts += [] if impact is None else [(pair, impact)]
        broken: set[str] = set()
        for pair, impact in sorted(impacts, key=lambda row: (row[1].frame, row[0])):
            if pair[0] not in broken:
                found.events += _events(inputs, declared, pair, impact)
                broken |= {pair[0]} if found.events[-1].name == "broken" else set()
    return found.output()


def _impact(inputs: EffectInputs, touch: EffectContact, pair: Pair, ran: NDArray[np.bool_]) -> Impact | None:
    """The impact at the begin of a contact; ``None``, and counted, where the path into it is not known."""
    a, b = inputs.poses(pair[0]), inputs.poses(pair[1])
    last = touch.before
    if last < 0:
        inputs.count("not judged: in contact from the start")
        return None
    runs = settled_runs(a.times, a.valid & b.valid, a.linked & b.linked)
    rows = before(runs, last)
    if touch.first != last + 1 or runs[touch.first] != runs[last] or not len(rows):
        inputs.count("not judged: gap, loss or jump before it")
        return None
    ran[rows[0] : touch.first + 1] = True
    path = _closing(a, b, touch, np.append(rows, touch.first))
    fit = fitted(a.times[rows], path[:-1])
    if fit.misfit > MISFIT_M:
        inputs.count("not judged: the path jumps")
        return None
    direction = np.array(touch.normal) if touch.normal is not None else None
    time = _time_of_impact(fit, path[-1], (float(a.times[last]), float(a.times[touch.first])), direction)
    velocity = fit.velocity(time)
    speed = float(np.sqrt(velocity @ velocity)) if direction is None else abs(float(velocity @ direction))
    return Impact(touch.first, time, speed, direction is not None, len(rows), fit.misfit, touch.point)


def _closing(a: BodyPoses, b: BodyPoses, touch: EffectContact, rows: NDArray[np.int64]) -> FloatArray:
    """Path (n, 3) of the place of contact on the first body, seen from that on the second, world axes."""
    if touch.point is None:
        return a.translation[rows] - b.translation[rows]
    ends = []
    for body in (a, b):
        local = body.rotation[touch.first].T @ (np.array(touch.point) - body.translation[touch.first])
        ends.append(body.translation[rows] + body.rotation[rows] @ local)
    return np.asarray(ends[0] - ends[1])


def _time_of_impact(fit: Parabola, met: FloatArray, span: tuple[float, float], direction: FloatArray | None) -> float:
    """When the parabola comes to where the bodies met, within the step in which they did.

    A body that stops at once is seen, in the first frame of contact, where it was at the impact. One that went on is
    seen further: then this is the end of the step, and the speed is off by what it gained in the step at most.
    """
    low, high = span
    speed = fit.velocity(low)
    # A body at rest has no direction; the least speed only keeps 0 / 0 out.
    way = direction if direction is not None else speed / max(float(np.sqrt(speed @ speed)), 1e-12)
    sign = math.copysign(1.0, float(speed @ way))
    goal = sign * float(met @ way)
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if sign * float(fit.place(middle) @ way) < goal else (low, middle)
    return high


def _events(inputs: EffectInputs, declared: Declaration, pair: Pair, impact: Impact) -> list[EffectEvent]:
    values: dict[str, float | int | str | bool] = {
        "speed_m_s": impact.speed, "across": impact.across, "samples": impact.samples, "misfit_m": impact.misfit,
    }  # fmt: skip
    mass = inputs.body(pair[0]).extra.get("mass")
    if mass is not None:
        values["energy_j"] = 0.5 * float(mass) * impact.speed**2
    values |= {"threshold_m_s": declared["speed_m_s"], "broken": impact.speed > declared["speed_m_s"]}
    words = f"{pair[0]} meets {pair[1]} at {impact.speed:.2f} m/s"
    event = EffectEvent(impact.time, "impact", pair, None, values, words, point=impact.point)
    crash = replace(event, name="broken", message=f"{pair[0]} breaks: {words}", level="error")
    return [event, crash] if values["broken"] else [event]


SPEC = EffectSpec(
    kind="breakage",
    about="A body that meets another too fast breaks.",
    compute=compute,
    needs=("contact",),
    fields={
        "between": pairs("[what may break, what it may fall on]"),
        "speed_m_s": number("speed across the surface above which it breaks", "m/s", above=0.0),
    },
    trigger="the begin of a contact whose path before is known",
    sources=("thresholds: the scene's author",),
)
