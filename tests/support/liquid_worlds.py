"""Glasses that are tilted as told: the smallest sessions in which liquid is poured."""

import numpy as np
from support.small_worlds import STEP_NS, cube

from replay.engine import compute
from sessions import Session
from sessions.model.scene import Scene, SceneBody, SceneEffect
from sessions.model.track import Track

RADIUS, HEIGHT = 0.02, 0.06
"""Of the glass, which holds 75.4 mL."""


LOW = 0.2
"""The receiving glass stands this far below the pouring one."""


def glass(name, volume_ml=0.0, *, cavity=None, properties=None, **liquid) -> SceneBody:
    """A cylindrical glass, its lip towards +X, with so much liquid and other properties."""
    sizes = {
        "capacity_ml": 50.0, "floor": 0.0, "mark": 50e-6 / (np.pi * RADIUS**2), "radius": RADIUS, "height": HEIGHT,
        "opening": [0.0, HEIGHT, 0.0], "opening_radius": RADIUS, "lip": [RADIUS, HEIGHT, 0.0],
    }  # fmt: skip
    told = {"liquid": {"volume_ml": volume_ml, **liquid}, **(properties or {})}
    return SceneBody(name, extra={"cavity": sizes | (cavity or {}), "properties": told})


def tilted(degrees, lip=(0.0, LOW, 0.0)):
    """Poses of a glass tilted towards +X about its lip, which stays where it is.

    A tilt by some 50 degrees in one frame is a jump to the doctor: what it pours counts from the frame after.
    """
    half = -0.5 * np.radians(np.asarray(degrees, dtype=np.float64))
    turns = np.zeros((len(half), 4))
    turns[:, 2], turns[:, 3] = np.sin(half), np.cos(half)
    c, s = np.cos(2 * half), np.sin(2 * half)
    reach = np.stack([c * RADIUS - s * HEIGHT, s * RADIUS + c * HEIGHT, np.zeros_like(c)], axis=1)
    return np.asarray(lip) - reach, turns


def still(count, place=(0.0, 0.0, 0.0)):
    """Poses of a glass that stands."""
    return np.tile(np.asarray(place, dtype=np.float64), (count, 1)), np.tile((0.0, 0.0, 0.0, 1.0), (count, 1))


def world(poses, bodies, *effects, valid=None, step_ns=STEP_NS) -> Session:
    """A session of these bodies; every mesh is a small cube, for nobody looks at it."""
    count = len(next(iter(poses.values()))[0])
    scene = Scene(bodies=tuple(bodies), effects=tuple(SceneEffect(kind, told) for kind, told in effects))
    meshes = {name: cube(0.01) for name in poses}
    stamps = np.arange(count) * step_ns
    tracks = {name: Track(stamps, *pose, (valid or {}).get(name)) for name, pose in poses.items()}
    return Session.from_tracks(tracks, meshes, scene)


def poured(degrees, bodies=None, *more, place=(0.0, 0.0, 0.0), valid=None):
    """Effects of a run in which glass ``a`` is tilted over glass ``b``."""
    poses = {"a": tilted(degrees), "b": still(len(degrees), place)}
    effects = (("pour", {"from": ["a"], "into": ["b"]}), *more)
    return compute(world(poses, bodies or (glass("a", 60.0), glass("b", 10.0)), *effects, valid=valid)).effects


TAP = {
    "body": "burette", "joint": "tap", "into": ["flask"], "full_area_m2": 6e-7, "full_angle_deg": 90.0,
    "discharge": 0.6,
}  # fmt: skip
COLUMN = {"capacity_ml": 50.0, "floor": 0.15, "mark": 0.65}


def turned(degrees):
    """Poses of a tap turned about Z."""
    half = 0.5 * np.radians(np.asarray(degrees, dtype=np.float64))
    turns = np.zeros((len(half), 4))
    turns[:, 2], turns[:, 3] = np.sin(half), np.cos(half)
    return np.tile((0.0, 0.25, 0.0), (len(half), 1)), turns


def run_in(degrees, *more, base=None, acid=None, settings=None, valid=None, step_ns=STEP_NS):
    """Effects of a run in which a burette of base is opened over a flask of acid by so many degrees."""
    base = base or glass("burette", 50.0, solute="NaOH", molar=0.1, cavity=COLUMN)
    acid = acid or glass("flask", 0.5, solute="HCl", molar=0.1)
    count = len(degrees)
    poses = {"burette": still(count, (0.0, 0.15, 0.0)), "tap": turned(degrees), "flask": still(count)}
    effects = (("burette", {**TAP, **(settings or {})}), *more)
    return compute(world(poses, (base, acid, SceneBody("tap")), *effects, valid=valid, step_ns=step_ns)).effects


MIX = ("mixing", {"in": ["flask"]})
NEUTRAL = ("reaction", {"equation": "HCl + NaOH -> NaCl + H2O"})
