"""Surfaces that share planes and points, where only exact arithmetic decides, with their truth in closed form."""

import numpy as np

from cdcore import Body, Motion, TriangleMesh

STEP = 2.0**-10
"""Places are multiples of this, metres, so that every placed corner is a double without rounding."""


def grid_mesh(cells):
    """A flat square in z = 0 with a side of ``cells`` times STEP * 16: 2 cells^2 faces."""
    x, y = (part.ravel() for part in np.meshgrid(*[np.arange(cells + 1) * 16 * STEP] * 2, indexing="ij"))
    first = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    lower = np.stack([first, first + cells + 1, first + cells + 2], axis=1)
    upper = np.stack([first, first + cells + 2, first + 1], axis=1)
    return TriangleMesh(np.stack([x, y, np.zeros_like(x)], axis=1), np.concatenate([lower, upper]))


def fan_mesh(faces, height):
    """A cone without a floor: its hub at the origin, its rim at this height."""
    turn, around = 2 * np.pi * np.arange(faces) / faces, np.arange(faces)
    corners = np.stack([np.cos(turn), np.sin(turn), np.full(faces, height)], axis=1)
    ring = np.stack([0 * around, 1 + around, 1 + (around + 1) % faces], axis=1)
    return TriangleMesh(np.concatenate([np.zeros((1, 3)), corners]), ring)


def two_bodies(first, second, places, turns=None):
    """Two bodies on a motion of 90 frames a second."""
    turns = np.tile(np.eye(3), (len(places), 2, 1, 1)) if turns is None else turns
    return [Body("first", first), Body("second", second)], Motion(np.arange(len(places)) / 90.0, places, turns)


def sliding_grids(cells, frames):
    """Two grids in one plane, one of which slides to and fro and past the other's edge; and whether they meet, (T,)."""
    side, time = cells * 16, np.arange(frames)
    x = np.rint(side * (0.6 + 0.5 * np.sin(time / 20.0)))
    places = np.zeros((frames, 2, 3))
    places[:, 1, 0], places[:, 1, 1] = x * STEP, np.rint(side * 0.3 * np.cos(time / 13.0)) * STEP
    return *two_bodies(grid_mesh(cells), grid_mesh(cells), places), x <= side


def fans_at_their_hubs(faces, frames):
    """Two cones, hub on hub or apart by 1e-12 m, one of which turns; and whether they meet, (T,)."""
    time = np.arange(frames)
    apart = time % 3 == 0
    places, turns = np.zeros((frames, 2, 3)), np.tile(np.eye(3), (frames, 2, 1, 1))
    places[:, :, 0] = np.rint(64 * np.sin(time / 20.0))[:, None] * STEP
    places[apart, 1, 2] = -1e-12
    cos, sin = np.cos(0.01 * time), np.sin(0.01 * time)
    turns[:, 1, 0, 0], turns[:, 1, 1, 1], turns[:, 1, 0, 1], turns[:, 1, 1, 0] = cos, cos, -sin, sin
    return *two_bodies(fan_mesh(faces, 0.5), fan_mesh(faces, -0.5), places, turns), ~apart
