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

from replay.effects.bounces import bounces
from replay.effects.declaring import Declaration, number, pairs
from replay.effects.fitting import HALF_WINDOW, Parabola, before, fitted, settled_runs
from replay.effects.inputs import BodyPoses, EffectInputs
from replay.effects.output import EffectEvent, EffectOutput, Findings, FloatArray, Vector
from replay.effects.protocol import EffectSpec
from replay.effects.touches import EffectContact, Touches
from sessions.model.scene import Scene

MISFIT_M: Final = 0.002
"""Six times the noise of a VIVE tracker (0.3 mm): a path into an impact further from a parabola holds a jump."""

THRESHOLDS: Final = ("speed_m_s", "energy_j", "scale_m_s")

Impact = tuple[float, float, dict[str, float | int | str | bool]]
"""Time, seconds, between the last clear frame and the first in contact; speed across the surfaces where their normal is
known, else in all, m/s; and these in figures, with samples and misfit of the parabola behind them."""


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``impact`` with speed and energy, and ``broken`` for the first that is too hard for a body."""
    touches = Touches.told(inputs)
    collected = Findings(len(inputs))
    for declared in inputs.declared:
        broken: set[str] = set()
        judged: list[tuple[int, tuple[str, str], Impact | None, Vector | None]] = []
        for pair in declared.pairs():
            seen = bounces(inputs, pair)
            for bounce in seen:
                inputs.count("impacts between frames")
                collected.ran[bounce.before : bounce.before + 3] = True
                values: dict[str, float | int | str | bool] = {
                    "speed_m_s": bounce.speed, "across": True, "samples": bounce.samples, "misfit_m": bounce.misfit,
                }  # fmt: skip
                judged.append((bounce.before, pair, (bounce.time, bounce.speed, values), bounce.point))
            for touch in touches.of(pair, flickers=True):
                # The frames that show a contact after a bounce show the same impact, or slower ones.
                if not any(0 <= touch.first - bounce.before <= 2 * HALF_WINDOW for bounce in seen):
                    judged.append((touch.first, pair, _impact(inputs, touch, pair, collected.ran), touch.point))
        for _, pair, impact, point in sorted(judged, key=lambda row: row[:2]):
            if impact is not None and pair[0] not in broken:
                found = _events(inputs, declared, pair, point, impact)
                broken |= {pair[0] for event in found if event.name == "broken"}
                collected.events += found
    return collected.output()


def _impact(inputs: EffectInputs, touch: EffectContact, pair: tuple[str, str], ran: NDArray[np.bool_]) -> Impact | None:
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
    inputs.count("impacts")
    direction = np.array(touch.normal) if touch.normal is not None else None
    time = _time_of_impact(fit, path[-1], (float(a.times[last]), float(a.times[touch.first])), direction)
    velocity = fit.velocity(time)
    speed = float(np.sqrt(velocity @ velocity)) if direction is None else abs(float(velocity @ direction))
    across = direction is not None
    return time, speed, {"speed_m_s": speed, "across": across, "samples": len(rows), "misfit_m": fit.misfit}


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


def _events(
    inputs: EffectInputs, declared: Declaration, pair: tuple[str, str], point: Vector | None, impact: Impact
) -> list[EffectEvent]:
    time, speed, values = impact
    mass = inputs.body(pair[0]).extra.get("mass")
    if mass is not None:
        values["energy_j"] = 0.5 * float(mass) * speed**2
    values.update(_judgement(declared, speed, values.get("energy_j")))
    words = f"{pair[0]} meets {pair[1]} at {speed:.2f} m/s"
    events = [EffectEvent(time, "impact", pair, None, values, words, point=point)]
    if values["broken"]:
        events.append(replace(events[0], name="broken", message=f"{pair[0]} breaks: {words}", level="error"))
    return events


def _judgement(declared: Declaration, speed: float, energy: float | int | str | bool | None) -> dict[str, float | bool]:
    if declared.values["speed_m_s"] is not None:
        return {"threshold_m_s": declared.number("speed_m_s"), "broken": speed > declared.number("speed_m_s")}
    if energy is not None and declared.values["energy_j"] is not None:
        return {"threshold_j": declared.number("energy_j"), "broken": float(energy) > declared.number("energy_j")}
    share = -math.expm1(-((speed / declared.number("scale_m_s")) ** declared.number("shape")))
    return {"probability": share, "broken": share > declared.number("probability")}


def _check(declared: Declaration, scene: Scene) -> None:
    given = [key for key in THRESHOLDS if declared.values[key] is not None]
    if len(given) != 1:
        raise declared.fail(f"it has {' and '.join(given) or 'no threshold'}; give one of {', '.join(THRESHOLDS)}")
    for name in dict.fromkeys(pair[0] for pair in declared.pairs()) if given == ["energy_j"] else ():
        found = scene.body(name)
        if found is None or found.extra.get("mass") is None:
            raise declared.fail(f"energy_j needs the mass of {name!r}; give it `mass` in kg")
    if given == ["scale_m_s"] and None in (declared.values["shape"], declared.values["probability"]):
        raise declared.fail("scale_m_s needs shape and probability; give both")


SPEC = EffectSpec(
    kind="breakage",
    about="A body that meets another too fast breaks.",
    compute=compute,
    needs=("contact",),
    uses=("sweep",),
    fields={
        "between": pairs("[what may break, what it may fall on]"),
        "speed_m_s": number("speed across the surface above which it breaks", "m/s", default=None, above=0.0),
        "energy_j": number("kinetic energy above which it breaks", "J", default=None, above=0.0),
        "scale_m_s": number("v0 of P = 1 - exp(-(v/v0)^k)", "m/s", default=None, above=0.0),
        "shape": number("k of P = 1 - exp(-(v/v0)^k)", default=None, above=0.0),
        "probability": number("P above which it counts as broken", default=None, above=0.0, most=1.0),
    },
    trigger="the begin of a contact whose path before is known",
    sources=(
        "thresholds: the scene's author",
        "P = 1 - exp(-(v/v0)^k): Weibull, A statistical distribution function of wide applicability, 1951",
    ),
    check=_check,
)
