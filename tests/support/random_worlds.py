"""Small hard bodies and random motions of them, from a seed.

A random world is the same bits on every machine: no sine, no logarithm, no linear algebra of a library takes part.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation
from support.shapes import random_rotations

from cdcore import Body, Motion, TriangleMesh
from cdcore.poses import place_points

FRAMES = 13
BODIES = 3
SCALES = (1.0, 1e-6, 1e6, 2.0**40, 2.0**-60, 2.0**300, 2.0**-320)
CUBE = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
CUBE_FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4],
     [1, 5, 7], [1, 7, 3]]
)  # fmt: skip


def spread(rng, shape):
    """Numbers between -1 and 1, most of them near 0."""
    return rng.random(shape) + rng.random(shape) - 1.0


def soup(rng, count=30):
    """Triangles of ordinary size at random places."""
    return 1.5 * spread(rng, (count, 1, 3)) + 0.6 * spread(rng, (count, 3, 3))


def lattice(rng, count=20):
    """Triangles of small whole coordinates, many of which touch."""
    return rng.integers(0, 4, (count, 3, 3)).astype(float)


def degenerate(rng, count=24):
    """On a grid, some of the faces segments and points."""
    triangles = lattice(rng, count)
    triangles[:6, 2] = triangles[:6, 0]
    triangles[6:9, 1:] = triangles[6:9, :1]
    return triangles


def fan(rng, count=16):
    """Non-manifold: every face on one edge, some twice."""
    faces = np.empty((count, 3, 3))
    faces[:, 0], faces[:, 1], faces[:, 2] = (0, 0, 0), (0, 0, 2), rng.integers(-2, 3, (count, 3))
    return faces


def needles(rng, count=12):
    """Faces a billionth as wide as long, some of them without any width."""
    start, along = rng.integers(-2, 3, (2, count, 3)).astype(float)
    tip = start + along / 2 + spread(rng, (count, 3)) * 1e-9 * rng.integers(0, 2, (count, 1))
    return np.stack([start, start + along, tip], axis=1)


def cube(_rng=None):
    """Triangles of a unit cube."""
    return CUBE[CUBE_FACES]


def open_cube(rng):
    """A cube without some of its faces."""
    return cube()[np.sort(rng.permutation(len(CUBE_FACES))[: rng.integers(3, len(CUBE_FACES))])]


def points_and_segments(rng, count=10):
    """Triangles that are points or segments, and small ones."""
    corners = rng.integers(-1, 2, (count, 3, 3)).astype(float)
    corners[: count // 2, 1] = corners[: count // 2, 0]
    corners[: count // 4, 2] = corners[: count // 4, 0]
    return corners


def plate(_rng, size=3):
    """A flat square of ``2 size^2`` faces around the origin."""
    corner = np.stack(np.meshgrid(np.arange(size), np.arange(size), [0], indexing="ij"), axis=-1).reshape(-1, 1, 3)
    halves = np.array([[[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 0, 0], [1, 1, 0], [0, 1, 0]]])
    return (corner[:, None] + halves).reshape(-1, 3, 3) - [size / 2, size / 2, 0]


def ball(_rng, times=2):
    """An octahedron whose faces are cut in four, twice, and pushed out to a sphere."""
    faces = np.array([np.diag(signs) for signs in np.sign(CUBE)], dtype=float)
    for _ in range(times):
        a, b, c = faces[:, 0], faces[:, 1], faces[:, 2]
        middle = [(a + b) / 2, (b + c) / 2, (c + a) / 2]
        cut = ((a, middle[0], middle[2]), (middle[0], b, middle[1]), (middle[2], middle[1], c), middle)
        faces = np.concatenate([np.stack(corners, axis=1) for corners in cut])
        faces /= np.sqrt((faces * faces).sum(axis=2, keepdims=True))
    return faces / 2


SHAPES = {
    "soup": soup, "lattice": lattice, "degenerate": degenerate, "non-manifold": fan, "needles": needles,
    "open cube": open_cube, "points and segments": points_and_segments, "plate": plate, "cube": cube, "ball": ball,
}  # fmt: skip


def rotation(quaternion):
    """Rotations (..., 3, 3) of quaternions xyzw (..., 4) of any length but 0."""
    q = np.asarray(quaternion, dtype=float)
    x, y, z, w = np.moveaxis(q, -1, 0)
    rows = [
        [w * w + x * x - y * y - z * z, 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), w * w - x * x + y * y - z * z, 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), w * w - x * x - y * y + z * z],
    ]
    rotations = np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
    return rotations / (x * x + y * y + z * z + w * w)[..., None, None]


def random_quaternion(rng, *shape):
    """Quaternions of whole numbers, none of them zero."""
    q = rng.integers(-9, 10, (*shape, 4)).astype(float)
    q[..., 3] += (q == 0).all(axis=-1)
    return q


def resting(rng, frames):
    """Bodies that stand still, bit for bit, in one world that is turned as a whole or not at all; faces flush."""
    rotations = rotation(random_quaternion(rng)) if rng.random() < 0.5 else np.eye(3)
    translations = np.cumsum(rng.integers(-1, 2, (BODIES, 3)), axis=0) * rng.choice([0.5, 1.0])
    placed = (rotations[None] * translations[:, None]).sum(axis=-1)
    return np.tile(rotations, (frames, BODIES, 1, 1)), np.tile(placed, (frames, 1, 1))


def sliding(rng, frames):
    """Moves along the axes of a grid in exact steps: faces stay in common planes while they slide."""
    step = np.zeros((BODIES, 3))
    step[np.arange(BODIES), rng.integers(0, 3, BODIES)] = rng.choice([0.0, 0.125, -0.25], BODIES)
    translations = rng.integers(-1, 2, (BODIES, 3)) * 0.5
    return np.tile(np.eye(3), (frames, BODIES, 1, 1)), translations + np.arange(frames)[:, None, None] * step


def drifting(rng, frames):
    """Turns and moves a little every frame, with a pause; now and then a jump."""
    rotations = random_quaternion(rng, 1, BODIES) + np.cumsum(0.3 * spread(rng, (frames, BODIES, 4)), axis=0)
    translations = 0.8 * spread(rng, (1, BODIES, 3)) + np.cumsum(0.08 * spread(rng, (frames, BODIES, 3)), axis=0)
    pause = slice(frames // 3, frames // 2)
    rotations[pause], translations[pause] = rotations[frames // 3], translations[frames // 3]
    if rng.random() < 0.2:
        translations[frames // 2, 0] += 1e3
    return rotation(rotations), translations


MOTIONS = {"resting": resting, "sliding": sliding, "drifting": drifting}


@dataclass(frozen=True, eq=False)
class World:
    """Bodies, which pairs of them are asked about (``None``: all), and where they are."""

    bodies: tuple
    motion: Motion
    pairs: object = None


def bodies_of(meshes):
    """Bodies of triangles (f, 3, 3), no corner shared."""
    return tuple(
        Body(f"body {k}", TriangleMesh(faces.reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3)))
        for k, faces in enumerate(meshes)
    )


def random_world(seed, shape=None, frames=FRAMES):
    """Three bodies, the first of a named shape, on a motion with or without lost poses; scale and motion go round."""
    names = list(SHAPES)
    rng = np.random.default_rng([seed, 20 if shape is None else names.index(shape)])
    chosen = [names[k] for k in rng.integers(len(names), size=BODIES)]
    chosen[0] = shape or chosen[0]
    scale = SCALES[seed % len(SCALES)]
    rotations, translations = list(MOTIONS.values())[seed % len(MOTIONS)](rng, frames)
    valid = rng.random((frames, BODIES)) > (0.15 if rng.random() < 0.5 else 0.0)
    meshes = [SHAPES[name](rng) * scale for name in chosen]
    return World(bodies_of(meshes), Motion(np.arange(frames) / 90, translations * scale, rotations, valid))


def short_world(number):
    """World ``number`` of three frames, so short that interpreted kernels end: shapes, scales and motions go round.

    Every fourth is moved away from the origin, by a million times its scale.
    """
    names = list(SHAPES)
    world = random_world(number // len(names), names[number % len(names)], frames=3)
    if number % 4:
        return world
    motion, scale = world.motion, SCALES[number // len(names) % len(SCALES)]
    translations = motion.translations + 2.0**20 * scale
    return World(world.bodies, Motion(motion.times, translations, motion.rotations, motion.valid))


def random_walk_of_rotations(rng, frames, step):
    """A rotation that drifts by about ``step`` radians a frame, (frames, 3, 3)."""
    rotations = [Rotation.from_matrix(random_rotations(rng))]
    for _ in range(frames):
        axis = rng.normal(size=3)
        rotations.append(rotations[-1] * Rotation.from_rotvec(step * rng.random() * axis / np.linalg.norm(axis)))
    return Rotation.concatenate(rotations[1:]).as_matrix()


def face_soup(rng, count=30, size=0.3):
    """Small triangles scattered about the origin."""
    return rng.normal(size=(count, 1, 3)) + rng.normal(size=(count, 3, 3)) * size


def grid_plate(size=6):
    """A flat plate of 2 size^2 faces in z = 0, integer corners."""
    return plate(None, size) + np.array([size / 2, size / 2, 0])


KINDS = {"soup": face_soup, "lattice": lattice, "degenerate": degenerate, "non-manifold": fan}


def motion_of(kind, rng, frames, bodies):
    """Rotations (T, N, 3, 3) and translations (T, N, 3): drifting, with pauses; on a grid for the lattice kinds."""
    rotations = np.stack([random_walk_of_rotations(rng, frames, 0.05) for _ in range(bodies)], axis=1)
    move = np.cumsum(rng.normal(size=(frames, bodies, 3)) * 0.03, axis=0) + rng.normal(size=(1, bodies, 3)) * 0.5
    if kind != "soup":
        move = np.round(move * 4) / 4
        rotations[: frames // 2] = np.eye(3)
    pause = slice(frames // 3, frames // 2)
    rotations[pause], move[pause] = rotations[frames // 3], move[frames // 3]
    return rotations, move


def placed(triangles, rotations, move):
    """Triangles (F, 3, 3) in a pose."""
    return place_points(triangles.reshape(-1, 3), rotations, move).reshape(-1, 3, 3)
