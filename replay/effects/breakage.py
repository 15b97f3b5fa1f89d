"""Breakage by the speed across the surface at the moment of impact; a long jump, a loss or a gap breaks nothing.

A tracked pose shows where a rigid body was at each frame, and so the speed with which it came, from the five to nine
frames before, whatever happens afterwards. It cannot show where a body was hit between two frames, but for its box, how
hard a material is, or an impact just after a loss. Nor does it show whether a body at rest that comes a few millimetres
into contact in a frame was pushed by a hand or jumped in tracking: a push of 5 g that begins late in the frame before
moves it there by less than the noise. At 90 Hz 4.4 to 9.8 mm count as a push, of 0.3 to 0.7 m/s.

At 90 Hz a body that falls a metre moves 49 mm from frame to frame and is in contact for a millisecond: hardly ever does
a frame show it touching. What is shown is a path that would have led through the other body, and did not.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cdcore.numerics import BoolArray, IntArray
from replay import words
from replay.effects.contact import EffectContact, touches_of
from replay.effects.declaring import Declaration, Pair
from replay.effects.fitting import HALF_WINDOW, LEAST_SAMPLES, Parabola, fit_parabola, rows_before, settled_runs
from replay.effects.inputs import BodyPoses, EffectInputs
from replay.effects.output import EffectEvent, EffectOutput, Findings, FloatArray, Vector, vector_of
from replay.effects.protocol import spec_of
from sessions.mesh_data import MeshData

MISFIT_M: Final = 0.002
"""Six times the noise of a VIVE tracker (0.3 mm): a path into an impact further from a parabola holds a jump."""

SLOWEST_IMPACT_M_S: Final = 0.3
"""Slower ones are left to the frames that show a contact."""

NOISE_M: Final = 0.0015
"""Five times the noise of a VIVE tracker (0.3 mm): a path that leaves its parabola by less has met nothing."""

LAG_FRACTION: Final = 0.4
"""After an impact a body is behind its path, two frames on, by at least the way of one of them; a hand that brakes at
5 g is behind by a quarter of it."""

REACH_M: Final = 0.005
"""A body that comes no nearer on the path it would have taken has met another one, or a hand."""

PATH_SAMPLES: Final = 24
"""Of the path it would have taken in two frames, at which it is held against the other body."""

CONTAMINATED_M: Final = 6e-4
"""A longer stretch that is further from a parabola than this, twice the noise, began before the fall."""


@dataclass(frozen=True)
class Impact:
    """Two bodies that met between frame ``frame`` and the next, or just before it where it shows them in contact."""

    frame: int
    time: float  # seconds
    speed: float  # before they met, across the surfaces along their normal where it is known (``is_along_normal``), m/s
    is_along_normal: bool
    point: Vector | None


def compute(inputs: EffectInputs) -> EffectOutput:
    """Events ``impact`` with speed and energy, and ``broken`` for the first that is too hard for a body."""
    findings = Findings(len(inputs))
    for declared in inputs.declared:
        impacts = [
            (pair, impact) for pair in declared["between"] for impact in _impacts_of_pair(inputs, pair, findings.ran)
        ]
        broken_bodies: set[str] = set()
        for pair, impact in sorted(impacts, key=lambda row: (row[1].frame, row[0])):
            if pair[0] not in broken_bodies:
                findings.events += _impact_events(inputs, declared, pair, impact)
                if impact.speed > declared["speed_m_s"]:
                    broken_bodies.add(pair[0])
    return findings.output()


def _impacts_of_pair(inputs: EffectInputs, pair: Pair, ran: BoolArray) -> Iterator[Impact]:
    """Bounces of a pair, and begins of contacts that show no bounce; notes in ``ran`` (T,) where it looked."""
    impacts_of_pair = bounces(inputs, pair)
    yield from impacts_of_pair
    for bounce in impacts_of_pair:
        ran[bounce.frame : bounce.frame + 3] = True
    for touch in touches_of(inputs, pair, flickers=True):
        # The frames that show a contact after a bounce show the same impact, or slower ones.
        if not any(0 <= touch.first - bounce.frame <= 2 * HALF_WINDOW for bounce in impacts_of_pair):
            yield from _impact_of_contact(inputs, touch, pair, ran)


def _impact_of_contact(inputs: EffectInputs, touch: EffectContact, pair: Pair, ran: BoolArray) -> Iterator[Impact]:
    """The impact at the begin of a contact; none, and counted, where the path into it is not known."""
    a, b = inputs.poses(pair[0]), inputs.poses(pair[1])
    last_clear_frame = touch.last_clear_frame
    if last_clear_frame < 0:
        inputs.count("not judged: in contact from the start")
        return
    runs = settled_runs(a.times, a.valid & b.valid, a.linked & b.linked)
    frames_before = rows_before(runs, last_clear_frame)
    if touch.first != last_clear_frame + 1 or runs[touch.first] != runs[last_clear_frame] or not len(frames_before):
        inputs.count("not judged: gap, loss or jump before it")
        return
    ran[frames_before[0] : touch.first + 1] = True
    path = _relative_path(a, b, touch, np.append(frames_before, touch.first))
    parabola = fit_parabola(a.times[frames_before], path[:-1])
    if parabola.misfit > MISFIT_M:
        inputs.count("not judged: the path jumps")
        return
    direction = np.array(touch.normal) if touch.normal is not None else None
    time = _time_of_impact(
        parabola, path[-1], (float(a.times[last_clear_frame]), float(a.times[touch.first])), direction
    )
    velocity = parabola.velocity(time)
    speed = float(np.sqrt(velocity @ velocity)) if direction is None else abs(float(velocity @ direction))
    yield Impact(touch.first, time, speed, direction is not None, touch.point)


def _relative_path(a: BodyPoses, b: BodyPoses, touch: EffectContact, frames: IntArray) -> FloatArray:
    """Path (n, 3) of the place of contact on the first body, seen from that on the second, world axes."""
    if touch.point is None:
        return a.translation[frames] - b.translation[frames]
    paths_of_bodies = []
    for body in (a, b):
        local_point = body.rotation[touch.first].T @ (np.array(touch.point) - body.translation[touch.first])
        paths_of_bodies.append(body.translation[frames] + body.rotation[frames] @ local_point)
    return paths_of_bodies[0] - paths_of_bodies[1]


def _time_of_impact(
    parabola: Parabola, contact_position: FloatArray, frame_interval: tuple[float, float], direction: FloatArray | None
) -> float:
    """When the parabola comes to where the bodies met, within the step in which they did.

    A body that stops at once is seen, in the first frame of contact, where it was at the impact. One that went on is
    seen further: then this is the end of the step, and the speed is off by what it gained in the step at most.
    """
    lower, upper = frame_interval
    speed = parabola.velocity(lower)
    # A body at rest has no direction; the least speed only keeps 0 / 0 out.
    direction_of_motion = direction if direction is not None else speed / max(float(np.sqrt(speed @ speed)), 1e-12)
    direction_sign = float(np.copysign(1.0, speed @ direction_of_motion))
    contact_height = direction_sign * float(contact_position @ direction_of_motion)
    for _ in range(60):
        middle_time = 0.5 * (lower + upper)
        lower, upper = (
            (middle_time, upper)
            if direction_sign * float(parabola.position(middle_time) @ direction_of_motion) < contact_height
            else (lower, middle_time)
        )
    return upper


def _impact_events(inputs: EffectInputs, declared: Declaration, pair: Pair, impact: Impact) -> list[EffectEvent]:
    threshold_speed = declared["speed_m_s"]
    event_values = {
        "speed_m_s": impact.speed,
        "across": impact.is_along_normal,
        "threshold_m_s": threshold_speed,
        "broken": impact.speed > threshold_speed,
    }
    mass = inputs.body(pair[0]).extra.get("mass")
    if mass is not None:
        event_values["energy_j"] = 0.5 * float(mass) * impact.speed**2
    message = f"{pair[0]} meets {pair[1]} at {words.decimal(impact.speed, 2)} m/s"
    event = EffectEvent(impact.time, "impact", pair, None, event_values, message, point=impact.point)
    broken_event = replace(event, name="broken", message=f"{pair[0]} breaks: {message}", level="error")
    return [event, broken_event] if event_values["broken"] else [event]


@dataclass(frozen=True, eq=False)
class _Approach:
    """A body in the frame of another one."""

    poses: BodyPoses
    centre: FloatArray  # (T, 3) the middle of its box
    runs: IntArray  # (T,) stretches of known path
    mesh: MeshData
    other: MeshData


def bounces(inputs: EffectInputs, pair: Pair) -> list[Impact]:
    """Impacts of the first body on the second, in order of time: five known frames before each, and two after."""
    a, b = inputs.poses(pair[0]), inputs.poses(pair[1])
    mesh, poses = inputs.mesh(pair[0]), a.relative_to(b)
    centre = poses.translation + poses.rotation @ _bounding_box(mesh).mean(axis=0)
    runs = settled_runs(a.times, poses.valid, poses.linked)
    approach = _Approach(poses, centre, runs, mesh, inputs.mesh(pair[1]))
    impacts: list[Impact] = []
    for row in _candidate_frames(approach):
        impact = _bounce_after_frame(approach, row) if not impacts or row > impacts[-1].frame + 2 else None
        if impact is not None:
            point = b.rotation[row] @ np.array(impact.point) + b.translation[row]
            impacts.append(replace(impact, point=vector_of(point)))
    return impacts


def _candidate_frames(approach: _Approach) -> list[int]:
    """Frames from which two more are known, in which it moves and could come to the other within two steps."""
    times, centre, runs = approach.poses.times, approach.centre, approach.runs
    if len(times) < LEAST_SAMPLES + 2:
        return []
    step_lengths = np.linalg.norm(np.diff(centre, axis=0, prepend=centre[:1]), axis=1)
    speed = step_lengths / np.maximum(np.diff(times, prepend=times[0] - 1.0), 1e-9)
    lower, upper = _bounding_box(approach.other)
    box_distances = np.maximum(0.0, np.maximum(lower - centre, centre - upper))
    radius = 0.5 * float(np.linalg.norm(np.ptp(approach.mesh.vertices, axis=0)))
    is_within_reach = np.linalg.norm(box_distances, axis=1) - radius <= 3.0 * step_lengths + REACH_M
    is_known = np.zeros(len(times), dtype=np.bool_)
    is_known[1:-2] = (runs[1:-2] >= 0) & (runs[1:-2] == runs[:-3]) & (runs[1:-2] == runs[3:])
    return np.flatnonzero(is_known & is_within_reach & (speed > SLOWEST_IMPACT_M_S)).tolist()


def _bounce_after_frame(approach: _Approach, row: int) -> Impact | None:
    """The impact between a frame and the next, at a place in the other's frame; ``None``: it meets nothing there."""
    times, centre = approach.poses.times, approach.centre
    parabola = _fall_parabola(times, centre, rows_before(approach.runs, row))
    if parabola is None:
        return None
    first_time, middle_time, last = times[row : row + 3].tolist()
    velocity = parabola.velocity(first_time)
    speed = float(np.linalg.norm(velocity))
    if speed < SLOWEST_IMPACT_M_S:
        return None
    direction_of_motion = velocity / speed
    heights_behind = [
        float((parabola.position(time) - centre[row + k]) @ direction_of_motion)
        for k, time in ((1, middle_time), (2, last))
    ]
    later_travel = speed * (last - middle_time)
    # What is on its path in the next frame meets after it, and is judged from there.
    on_path = heights_behind[0] < NOISE_M + 0.05 * speed * (middle_time - first_time)
    if heights_behind[1] < NOISE_M + LAG_FRACTION * later_travel or (
        on_path and heights_behind[1] < NOISE_M + 0.95 * later_travel
    ):
        return None
    # Noise may leave the least gap between what met.
    contact_position = _contact_time_and_point(approach, parabola, row, 0.0) or _contact_time_and_point(
        approach, parabola, row, NOISE_M
    )
    if contact_position is None:
        return None
    time, point = contact_position
    velocity = parabola.velocity(time)
    velocity_change = (centre[row + 2] - centre[row + 1]) / (last - middle_time) - velocity
    is_along_normal = velocity_change / max(float(np.linalg.norm(velocity_change)), 1e-12)
    return Impact(row, time, abs(float(velocity @ is_along_normal)), True, point)


def _fall_parabola(times: FloatArray, centre: FloatArray, rows: IntArray) -> Parabola | None:
    """The parabola of the last frames; the last five alone where the others began before the fall."""
    for last_rows in (rows, rows[-LEAST_SAMPLES:]) if len(rows) else ():
        parabola = fit_parabola(times[last_rows], centre[last_rows])
        if parabola.misfit <= (CONTAMINATED_M if len(last_rows) > LEAST_SAMPLES else NOISE_M):
            return parabola
    return None


def _contact_time_and_point(
    approach: _Approach, parabola: Parabola, row: int, gap: float
) -> tuple[float, Vector] | None:
    """When, and where in the other's frame, it would have come within reach; ``None``: it would have passed."""
    rotation, times = approach.poses.rotation[row], approach.poses.times
    mine, box = approach.mesh.vertices @ rotation.T, _bounding_box(approach.other)
    other_vertices, own_box = approach.other.vertices, _bounding_box(approach.mesh)
    centre_offset = approach.poses.translation[row] - approach.centre[row]

    def contact_point(time: float) -> FloatArray:
        shift = centre_offset + parabola.position(time)
        is_inside = _is_inside_box(mine + shift, box, gap)
        if is_inside.any():
            return (mine + shift)[is_inside].mean(axis=0)
        near_vertices = _is_inside_box((other_vertices - shift) @ rotation, own_box, gap)
        return np.asarray(other_vertices[near_vertices].mean(axis=0)) if near_vertices.any() else np.zeros(0)

    trial_times = np.linspace(times[row], times[row + 2], PATH_SAMPLES).tolist()
    hit_index = next((k for k, time in enumerate(trial_times) if len(contact_point(time))), None)
    if hit_index is None:
        return None
    time_before, time_after = trial_times[max(0, hit_index - 1)], trial_times[hit_index]
    for _ in range(20):
        half = 0.5 * (time_before + time_after)
        time_before, time_after = (time_before, half) if len(contact_point(half)) else (half, time_after)
    return time_after, vector_of(contact_point(time_after))


def _is_inside_box(points: FloatArray, box: FloatArray, gap: float) -> FloatArray:
    return ((points >= box[0] - gap) & (points <= box[1] + gap)).all(axis=1)


def _bounding_box(mesh: MeshData) -> FloatArray:
    """Lowest and highest corner (2, 3)."""
    return np.stack([mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)])


SPEC = spec_of("breakage", compute)
