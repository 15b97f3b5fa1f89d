"""A made-up session for timing: the same arguments always give the same meshes and poses, and bodies touch in it.

A tray, a cup, a ring and a bottle stand; a rod stirs in the cup and knocks at its wall, a tube is put into the ring and
leans on it, then pours over the cup's rim, a hand touches bottle, cup and tray. Things are near each other for much of
the time and touch in some 10 % of the frames, which makes such a session hard. Places, profiles and motions are rows of
`bench_loads.toml`. Meshes have nearly as many faces as asked for, none of them degenerate; corners are rounded to
single precision, so that engines of either precision see the same geometry.
"""

import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from replay.constants import HEADSET_HZ

TABLE = tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))
PLACES, PROFILES, KEYS = TABLE["places"], TABLE["profiles"], TABLE["keys"]
PERIOD = 30.0
STATION = ("cup", "rod", "ring", "tube", "bottle", "hand")
"""What follows the tray, again and again."""
STATION_STEP = 0.9
"""Metres from one station to the next."""
DISTANCE = 5.0
"""Metres between neighbouring bodies of a distant session."""
TREMOR = (0.0012, 0.02)
"""Largest amplitude in metres and radians."""
SLACK = (0.001, 0.03)
"""How far a seed moves a pose near something, metres an axis, and a pose in the air."""
TRAY_SIZE = (1.2, 0.7)


@dataclass(frozen=True, eq=False)
class BenchWorkload:
    """N meshes, their poses (T, N, 4, 4) and the pairs (P, 2) of which at least one body moves."""

    names: tuple
    meshes: tuple
    poses: np.ndarray
    pairs: np.ndarray
    rate_hz: float = HEADSET_HZ


def make_workload(faces, frames=5400, *, bodies=7, seed=0, distant=False):
    """Lay the bench: a tray, then stations of six ``bodies`` with nearly so many ``faces`` each.

    ``seed`` is of tremor, times and places. ``distant``: every body is 5 m from the next, and each moves as it does on
    the bench.
    """
    rng = np.random.default_rng(seed)
    kinds = ["tray"] + [STATION[k % len(STATION)] for k in range(bodies - 1)]
    shapes = {kind: mesh_of(kind, faces) for kind in dict.fromkeys(kinds)}
    poses = np.tile(np.eye(4), (frames, bodies, 1, 1))
    seconds = np.arange(frames) / HEADSET_HZ
    for body, kind in enumerate(kinds):
        if kind in KEYS:
            follow(KEYS[kind], seconds, rng, poses[:, body])
        else:
            poses[:, body, :3, 3] = PLACES[kind]
        poses[:, body, 0, 3] += DISTANCE * body if distant else STATION_STEP * (max(0, body - 1) // len(STATION))
    pairs = [(i, j) for i in range(bodies) for j in range(i + 1, bodies) if {kinds[i], kinds[j]} & set(KEYS)]
    names = tuple(f"{kind}-{k}" for k, kind in enumerate(kinds))
    return BenchWorkload(names, tuple(shapes[kind] for kind in kinds), poses, np.array(pairs, dtype=np.int64))


def follow(keys, seconds, rng, poses):
    """Write the poses along the keys, smooth in between, with tremor."""
    table = np.array([[time, *pose] for time, _, pose in keys])
    table[:, 1:4] += [PLACES.get(near, (0.0, 0.0, 0.0)) for _, near, _ in keys]
    slack = np.array([SLACK[near == "air"] for _, near, _ in keys])
    table[:, 1:4] += rng.uniform(-1, 1, (len(table), 3)) * slack[:, None]
    table = np.vstack([table, [PERIOD, *table[0, 1:]]])
    clock = np.mod(seconds + rng.uniform(-1, 1), PERIOD)
    leg = np.minimum(np.searchsorted(table[:, 0], clock, side="right"), len(table) - 1)
    start, end = table[leg - 1], table[leg]
    p = (clock - start[:, 0]) / (end[:, 0] - start[:, 0])
    blend = (p**3 * (10 - 15 * p + 6 * p * p))[:, None]
    way = start[:, 1:] + (end[:, 1:] - start[:, 1:]) * blend + tremor(seconds, rng)
    poses[:, :3, 3] = way[:, :3]
    poses[:, :3, :3] = Rotation.from_rotvec(way[:, 3:]).as_matrix()


def tremor(seconds, rng):
    """Shaking (T, 6) in metres and radians: four waves of 0.2 to 2.2 Hz an axis."""
    rate, phase = rng.uniform(0.2, 2.2, (6, 4)), rng.uniform(0, 2 * np.pi, (6, 4))
    return np.sin(2 * np.pi * rate * seconds[:, None, None] + phase).mean(axis=2) * np.repeat(TREMOR, 3)


def mesh_of(kind, faces):
    """Vertices and faces of a body of this kind."""
    if kind == "tray":
        steps = max(1, round(np.sqrt(faces / 2))) + 1
        x, y = np.meshgrid(*(np.linspace(-size / 2, size / 2, steps) for size in TRAY_SIZE), indexing="ij")
        points = np.stack([x, y, np.zeros_like(x)], axis=-1)
    elif kind == "ring":  # a wire of 4 mm bent to a ring of 4 cm, 30 cm above its place
        around = max(8, round(np.sqrt(1.5 * faces)))
        across = np.linspace(0, 2 * np.pi, max(4, faces // (2 * around)) + 1)
        circle = np.stack([0.04 + 0.004 * np.cos(across), 0.3 + 0.004 * np.sin(across)], axis=1)
        points = about_z(circle, around).transpose(1, 0, 2)
    elif kind == "hand":  # an egg of 4 by 5.5 cm with bumps for fingers
        angle = np.linspace(0.01, np.pi - 0.01, 60)
        points = revolved(np.stack([0.04 * np.sin(angle), -0.055 * np.cos(angle)], axis=1), faces, 1.2)
        around = np.arctan2(points[..., 1], points[..., 0])
        points[..., :2] *= (1 + 0.1 * np.sin(4 * around + 90 * points[..., 2]))[..., None]
    else:
        points = revolved(np.array(PROFILES[kind]["points"]), faces, PROFILES[kind]["aspect"])
    return grid(points)


def revolved(profile, faces, aspect):
    """Points (along, around, 3) of a profile (m, 2) turned about z; ``aspect`` is sides for each step along it."""
    along = max(4, round(np.sqrt(faces / (2 * aspect))))
    arc = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(profile, axis=0).T))])
    at = np.linspace(0, arc[-1], along + 1)
    points = np.stack([np.interp(at, arc, column) for column in profile.T], axis=1)
    return about_z(points, max(6, round(faces / (2 * along))))


def about_z(profile, around):
    """Points (m, around + 1, 3) of (radius, height) rows, once round."""
    radius, height = profile.T
    angle = np.linspace(0, 2 * np.pi, around + 1)
    x, y = (np.outer(radius, circle(angle)) for circle in (np.cos, np.sin))
    return np.stack([x, y, np.tile(height[:, None], (1, around + 1))], axis=-1)


def grid(points):
    """Two triangles a cell of a grid of points (rows, columns, 3)."""
    rows, columns = points.shape[:2]
    number = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    faces = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3).astype(np.int32)
    return points.reshape(-1, 3).astype(np.float32).astype(np.float64), faces
