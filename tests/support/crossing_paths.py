"""A scene in which contact comes and goes: four finely meshed bodies that swing through each other."""

import numpy as np
from support.search_scenes import ball_of, torus_mesh
from support.shapes import rod_mesh

from cdcore import Body, Motion
from cdcore.transforms.rigid import rotation_from_quaternion


def crossing_paths(seed, frames=300):
    """Two rings, a ball and a rod of some thousand faces on smooth random paths, 90 frames a second."""
    rng = np.random.default_rng(seed)
    bodies = [
        Body("ring", torus_mesh(1.0, 0.25, 40, 16)), Body("ball", ball_of(1300, 0.5)),
        Body("hoop", torus_mesh(0.7, 0.12, 50, 12)), Body("rod", rod_mesh(0.08, 2.0, 40)),
    ]  # fmt: skip
    time = np.arange(frames) / 90.0
    place, spin = np.zeros((frames, 4, 3)), np.zeros((frames, 4, 4))
    for body in range(4):
        for axis in range(3):
            rate, phase = rng.uniform(0.1, 0.9, 2), rng.uniform(0, 2 * np.pi, 2)
            place[:, body, axis] = 0.8 * np.sin(time[:, None] * 2 * np.pi * rate + phase).sum(axis=1)
        way, rate = rng.normal(size=3), rng.uniform(0.2, 1.5)
        half = time * rate
        spin[:, body] = np.column_stack([np.sin(half)[:, None] * way / np.linalg.norm(way), np.cos(half)])
    return bodies, Motion(time, place, rotation_from_quaternion(spin))
