"""Random motions of small hard meshes, and the exhaustive answer to compare with."""

import numpy as np
from support.random_worlds import degenerate, fan, lattice
from support.shapes import random_rotations

from cdcore import Verdict
from cdcore.narrow.brute_force import meeting_faces_exhaustive
from cdcore.numerics import place_points


def rotations(rng, shape):
    return random_rotations(rng, *shape)


def turned_by(rng, frames, step):
    """A rotation that drifts by about ``step`` radians a frame, (frames, 3, 3)."""
    result = np.empty((frames, 3, 3))
    current = rotations(rng, ())
    for frame in range(frames):
        axis = rng.normal(size=3)
        angle = step * rng.random()
        x, y, z = axis / np.linalg.norm(axis)
        k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        current = current @ (np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k)
        u, _, vt = np.linalg.svd(current)
        current = u @ vt
        result[frame] = current
    return result


def soup(rng, count=30, size=0.3):
    return rng.normal(size=(count, 1, 3)) + rng.normal(size=(count, 3, 3)) * size


def grid_plate(size=6):
    """A flat plate of 2 size^2 faces in z = 0, integer corners."""
    faces = []
    for i in range(size):
        for j in range(size):
            a, b, c, d = (i, j, 0), (i + 1, j, 0), (i + 1, j + 1, 0), (i, j + 1, 0)
            faces += [(a, b, c), (a, c, d)]
    return np.array(faces, dtype=float)


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


def exhaustive(detection, meshes, motion, step):
    """Every so many frames, verdicts and faces are held against all face pairs; (frame, column, faces of the truth)."""
    for frame in range(0, len(motion), step):
        world = [
            placed(mesh, motion.rotations[frame, k], motion.translations[frame, k]) for k, mesh in enumerate(meshes)
        ]
        for column, (i, j) in enumerate(detection.pairs.tolist()):
            want = meeting_faces_exhaustive(world[i], world[j])
            assert np.array_equal(detection.faces(frame, column), want)
            assert (detection.verdict[frame, column] == Verdict.CONTACT) == (len(want) > 0)
            yield frame, column, want
