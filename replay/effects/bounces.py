"""Impacts that a tracked pose shows by its path alone: a body meets another between two frames and bounces or stops.

At 90 Hz a body that falls a metre moves 49 mm from frame to frame and is in contact for a millisecond: hardly ever does
a frame show it touching. What is shown is a path that would have led through the other body, and did not.
"""

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from replay.effects.declaring import Pair
from replay.effects.fitting import LEAST_SAMPLES, Parabola, before, fitted, settled_runs
from replay.effects.inputs import BodyPoses, EffectInputs
from replay.effects.output import FloatArray, Vector, vector_of
from sessions.mesh_data import MeshData

SLOWEST_M_S: Final = 0.3
"""Slower ones are left to the frames that show a contact."""

NOISE_M: Final = 0.0015
"""Five times the noise of a VIVE tracker (0.3 mm): a path that leaves its parabola by less has met nothing."""

LAG: Final = 0.4
"""After an impact a body is behind its path, two frames on, by at least the way of one of them; a hand that brakes at
5 g is behind by a quarter of it."""

REACH_M: Final = 0.005
"""A body that comes no nearer on the path it would have taken has met another one, or a hand."""

PLACES: Final = 24
"""Of the path it would have taken in two frames, at which it is held against the other body."""

CONTAMINATED_M: Final = 6e-4
"""A longer stretch that is further from a parabola than this, twice the noise, began before the fall."""


@dataclass(frozen=True)
class Impact:
    """Two bodies that met between frame ``frame`` and the next, or just before it where it shows them in contact."""

    frame: int
    time: float  # seconds
    speed: float  # before they met, across the surfaces where their normal is known (``across``), else in all, m/s
    across: bool
    # samples, misfit: of the parabola behind the speed
    samples: int
    misfit: float
    point: Vector | None


def bounces(inputs: EffectInputs, pair: Pair) -> list[Impact]:
    """Impacts of the first body on the second, in order of time: five known frames before each, and two after."""
    a, b = inputs.poses(pair[0]), inputs.poses(pair[1])
    mesh, other = inputs.mesh(pair[0]), inputs.mesh(pair[1])
    relative = a.relative_to(b)
    box, target = _box(mesh), _box(other)
    middle = 0.5 * (box[0] + box[1])
    centre = relative.translation + relative.rotation @ middle
    runs = settled_runs(a.times, relative.valid, relative.linked)
    found: list[Impact] = []
    free = 0
    for row in _near(a.times, centre, runs, 0.5 * float(np.linalg.norm(box[1] - box[0])), target):
        if row < free:
            continue
        bounce = _bounce(relative, centre, runs, row, (mesh, other))
        if bounce is not None:
            place = b.rotation[row] @ np.array(bounce.point) + b.translation[row]
            found.append(replace(bounce, point=vector_of(place)))
            free = row + 3
    return found


def _near(
    times: FloatArray, centre: FloatArray, runs: NDArray[np.int64], radius: float, target: FloatArray
) -> list[int]:
    """Frames from which two more are known, in which it moves and could come to the other within two steps."""
    if len(times) < LEAST_SAMPLES + 2:
        return []
    step = np.zeros(len(times))
    step[1:] = np.linalg.norm(np.diff(centre, axis=0), axis=1)
    speed = step / np.maximum(np.diff(times, prepend=times[0] - 1.0), 1e-9)
    away = np.maximum(0.0, np.maximum(target[0] - centre, centre - target[1]))
    reach = np.sqrt((away * away).sum(axis=1)) - radius <= 3.0 * step + REACH_M
    known = np.zeros(len(times), dtype=np.bool_)
    known[1:-2] = (runs[1:-2] >= 0) & (runs[1:-2] == runs[:-3]) & (runs[1:-2] == runs[3:])
    return np.flatnonzero(known & reach & (speed > SLOWEST_M_S)).tolist()


def _bounce(
    relative: BodyPoses, centre: FloatArray, runs: NDArray[np.int64], row: int, meshes: tuple[MeshData, MeshData]
) -> Impact | None:
    times = relative.times
    fit, samples = _fall(times, centre, before(runs, row))
    if fit is None:
        return None
    velocity = fit.velocity(float(times[row]))
    speed = float(np.sqrt(velocity @ velocity))
    if speed < SLOWEST_M_S:
        return None
    way = velocity / speed
    step = float(times[row + 1] - times[row])
    behind = [-float((centre[row + k] - fit.place(float(times[row + k]))) @ way) for k in (1, 2)]
    later = float(times[row + 2] - times[row + 1])
    # What is on its path in the next frame meets after it, and is judged from there.
    on_path = behind[0] < NOISE_M + 0.05 * speed * step
    if behind[1] < NOISE_M + LAG * speed * later or (on_path and behind[1] < NOISE_M + 0.95 * speed * later):
        return None
    # Noise may leave the least gap between what met.
    met = _meeting(relative, fit, centre, row, meshes) or _meeting(relative, fit, centre, row, meshes, gap=NOISE_M)
    if met is None:
        return None
    time, point = met
    velocity = fit.velocity(time)
    change = (centre[row + 2] - centre[row + 1]) / later - velocity
    normal = change / max(float(np.sqrt(change @ change)), 1e-12)
    return Impact(row, time, abs(float(velocity @ normal)), True, samples, fit.misfit, point)


def _fall(times: FloatArray, centre: FloatArray, rows: NDArray[np.int64]) -> tuple[Parabola | None, int]:
    """The parabola of the last frames; the last five alone where the others began before the fall."""
    for count in (len(rows), LEAST_SAMPLES):
        if len(rows) >= count >= LEAST_SAMPLES:
            last = rows[-count:]
            fit = fitted(times[last], centre[last])
            if fit.misfit <= (CONTAMINATED_M if count > LEAST_SAMPLES else NOISE_M):
                return fit, count
    return None, 0


def _meeting(
    relative: BodyPoses,
    fit: Parabola,
    centre: FloatArray,
    row: int,
    meshes: tuple[MeshData, MeshData],
    gap: float = 0.0,
) -> tuple[float, Vector] | None:
    """When, and where in the other's frame, it would have come within reach; ``None``: it would have passed."""
    mesh, other = meshes
    turn = relative.rotation[row]
    mine, box = mesh.vertices @ turn.T, _box(other)
    theirs, own = other.vertices, _box(mesh)
    start = relative.translation[row]

    def touching(time: float) -> FloatArray:
        shift = start + fit.place(time) - centre[row]
        inside = _within(mine + shift, box, gap)
        if inside.any():
            return np.asarray((mine + shift)[inside].mean(axis=0))
        held = _within((theirs - shift) @ turn, own, gap)
        return np.asarray(theirs[held].mean(axis=0)) if held.any() else np.zeros(0)

    times = np.linspace(float(relative.times[row]), float(relative.times[row + 2]), PLACES)
    hit = next((k for k, time in enumerate(times.tolist()) if len(touching(time))), None)
    if hit is None:
        return None
    low, high = float(times[max(0, hit - 1)]), float(times[hit])
    for _ in range(20):
        half = 0.5 * (low + high)
        low, high = (low, half) if len(touching(half)) else (half, high)
    return high, vector_of(touching(high))


def _within(points: FloatArray, box: FloatArray, gap: float) -> FloatArray:
    return np.asarray(((points >= box[0] - gap) & (points <= box[1] + gap)).all(axis=1))


def _box(mesh: MeshData) -> FloatArray:
    """Lowest and highest corner (2, 3)."""
    return np.stack([mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)])
