"""A thing is placed when it rests on a support with its centre of mass over what it stands on; else it tips."""

from typing import Final

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from replay.effects.contact import EffectContact, meeting, touches_of
from replay.effects.declaring import Declaration, Pair, number, pairs
from replay.effects.fitting import settled_runs, velocities
from replay.effects.inputs import EffectInputs
from replay.effects.output import EffectEvent, EffectOutput, Findings, FloatArray, vector_of
from replay.effects.protocol import EffectSpec
from replay.effects.spans import spans_of
from sessions.mesh_data import MeshData


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``placed`` and ``tipped`` with tilt and margin, once per contact; a lane of rest per pair."""
    found = Findings(len(inputs))
    for declared in inputs.declared:
        for pair in declared["between"]:
            for touch in touches_of(inputs, pair):
                found.ran[touch.first : touch.stop] = True
                rest = _rest(inputs, declared, pair, touch)
                if rest is not None:
                    found.lane(f"{pair[0]}-{pair[1]}", *inputs.shown([(rest, touch.stop)], "rests"))
                    found.events.append(_event(inputs, declared, touch, pair, rest))
    return found.output()


def _rest(inputs: EffectInputs, declared: Declaration, pair: Pair, touch: EffectContact) -> int | None:
    """First frame of the first stretch of the contact in which the thing stands still on its support long enough."""
    moving = inputs.poses(pair[0]).relative_to(inputs.poses(pair[1]))
    runs = settled_runs(moving.times, moving.valid, moving.linked)
    rows = slice(touch.first, touch.stop)

    def square_speed(places: FloatArray) -> FloatArray:
        return np.asarray((velocities(moving.times[rows], places[rows], runs[rows]) ** 2).sum(axis=1))

    still = np.sqrt(square_speed(moving.translation)) < declared["speed_m_s"]
    # Angular speed: how fast the columns of the rotation move, |dR| = sqrt(2) omega.
    still &= np.sqrt(0.5 * square_speed(moving.rotation.reshape(-1, 9))) < declared["turn_rad_s"]
    times = inputs.times[rows]
    for first, stop in spans_of(still):
        if times[stop - 1] - times[first] >= declared["still_s"]:
            return touch.first + first
    return None


def _event(inputs: EffectInputs, declared: Declaration, touch: EffectContact, pair: Pair, frame: int) -> EffectEvent:
    thing = inputs.poses(pair[0])
    tilt = float(np.degrees(thing.tilt()[frame]))
    centre = thing.rotation[frame] @ centre_of_mass(inputs.mesh(pair[0])) + thing.translation[frame]
    points = meeting(touch.reported, frame)
    margin = margin_over(centre[[0, 2]], points[:, [0, 2]]) if len(points) else float("nan")
    values = {"tilt_deg": tilt} | ({"margin_m": margin} if len(points) else {})
    tipped = tilt > declared["tilt_deg"] or margin < 0.0
    word, level = ("tipped", "warning") if tipped else ("placed", "info")
    message = f"{pair[0]} {'tips over' if tipped else 'is placed'} on {pair[1]}"
    return EffectEvent(float(inputs.times[frame]), word, pair, None, values, message, level, vector_of(centre))


def centre_of_mass(mesh: MeshData) -> FloatArray:
    """Centre (3,) of the volume of a closed mesh, of the area of an open one, in its own frame."""
    corners = np.asarray(mesh.vertices, dtype=np.float64)[np.asarray(mesh.faces)]
    middle = corners.reshape(-1, 3).mean(axis=0)
    a, b, c = (corners[:, k] - middle for k in range(3))
    volume = np.einsum("ij,ij->i", a, np.cross(b, c)) / 6.0
    total = float(volume.sum())
    area = np.sqrt((np.cross(b - a, c - a) ** 2).sum(axis=1)) / 2.0
    # An open surface has no volume: what its cone over the middle sums to is small against its own size.
    if abs(total) > 1e-6 * float(area.sum()) ** 1.5:
        return np.asarray(middle + ((a + b + c) / 4.0 * volume[:, None]).sum(axis=0) / total)
    return np.asarray(middle + ((a + b + c) / 3.0 * area[:, None]).sum(axis=0) / max(float(area.sum()), 1e-300))


def margin_over(point: FloatArray, places: FloatArray) -> float:
    """How far (metres) a point (2,) lies inside the convex hull of places (n, 2); negative outside."""
    try:
        return -float((ConvexHull(places).equations @ [*point, 1.0]).max())
    except (QhullError, ValueError):  # fewer than three, or all on a line
        away = places - point
        return -float(np.sqrt((away * away).sum(axis=1)).min())


OURS: Final = "project specification, section 8.1 (chosen by us: above a resting tracker's noise)"

SPEC = EffectSpec(
    kind="placement",
    about="A thing comes to rest on a support, or tips over.",
    compute=compute,
    needs=("contact",),
    fields={
        "between": pairs("[what is placed, what it stands on]"),
        "speed_m_s": number("slower than this it is at rest", "m/s", default=0.01, above=0.0, source=OURS),
        "turn_rad_s": number("turning slower than this it is at rest", "rad/s", default=0.1, above=0.0, source=OURS),
        "still_s": number("at rest for this long it is placed", "s", default=0.2, least=0.0, source=OURS),
        "tilt_deg": number("tilted further than this it is tipped", "deg", above=0.0, most=180.0),
    },
    trigger="contact with the support",
    sources=(OURS, "tilt: the scene's author", "convex hull: Qhull (Barber, Dobkin and Huhdanpaa, 1996)"),
)
