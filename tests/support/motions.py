"""Random motions of small hard meshes."""

import numpy as np
from scipy.spatial.transform import Rotation
from support.random_worlds import degenerate, fan, lattice, plate
from support.shapes import random_rotations

from cdcore.numerics import place_points


def turned_by(rng, frames, step):
    """A rotation that drifts by about ``step`` radians a frame, (frames, 3, 3)."""
    turns = [Rotation.from_matrix(random_rotations(rng))]
    for _ in range(frames):
        axis = rng.normal(size=3)
        turns.append(turns[-1] * Rotation.from_rotvec(step * rng.random() * axis / np.linalg.norm(axis)))
    return Rotation.concatenate(turns[1:]).as_matrix()


def soup(rng, count=30, size=0.3):
    return rng.normal(size=(count, 1, 3)) + rng.normal(size=(count, 3, 3)) * size


def grid_plate(size=6):
    """A flat plate of 2 size^2 faces in z = 0, integer corners."""
    return plate(None, size) + np.array([size / 2, size / 2, 0])


KINDS = {"soup": soup, "lattice": lattice, "degenerate": degenerate, "non-manifold": fan}


def motion_of(kind, rng, frames, bodies):
    """Rotations (T, N, 3, 3) and translations (T, N, 3): drifting, with pauses; on a grid for the lattice kinds."""
    turn = np.stack([turned_by(rng, frames, 0.05) for _ in range(bodies)], axis=1)
    move = np.cumsum(rng.normal(size=(frames, bodies, 3)) * 0.03, axis=0) + rng.normal(size=(1, bodies, 3)) * 0.5
    if kind != "soup":
        move = np.round(move * 4) / 4
        turn[: frames // 2] = np.eye(3)
    pause = slice(frames // 3, frames // 2)
    turn[pause], move[pause] = turn[frames // 3], move[frames // 3]
    return turn, move


def placed(triangles, turn, move):
    return place_points(triangles.reshape(-1, 3), turn, move).reshape(-1, 3, 3)
