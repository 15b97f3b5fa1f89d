"""Small meshes with known geometry, and random poses, for the tests of the collision core."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from cdcore import Body, Motion, TriangleMesh
from cdcore.transforms.rigid import rotation_from_quaternion

BOX_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
BOX_FACES = np.array(
    [
        [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
        [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
    ]
)  # fmt: skip


def box_mesh(size=(1.0, 1.0, 1.0), centre=(0.0, 0.0, 0.0)) -> TriangleMesh:
    """A closed box of 12 faces."""
    return TriangleMesh(BOX_CORNERS * np.asarray(size, dtype=float) / 2 + np.asarray(centre, dtype=float), BOX_FACES)


def revolved_mesh(profile, sides=16) -> TriangleMesh:
    """A profile of (radius, height) turned about z; closed where it starts and ends on the axis."""
    angle = 2 * np.pi * np.arange(sides) / sides
    points, rings = [], []
    for radius, height in profile:
        ring = [len(points) + k for k in range(sides)] if radius > 0 else [len(points)] * sides
        rings.append(ring)
        if radius > 0:
            points += [[radius * np.cos(a), radius * np.sin(a), height] for a in angle]
        else:
            points.append([0.0, 0.0, height])
    faces = []
    for low, high in pairwise(rings):
        for k in range(sides):
            n = (k + 1) % sides
            for face in ([low[k], low[n], high[n]], [low[k], high[n], high[k]]):
                if len(set(face)) == 3:
                    faces.append(face)
    return TriangleMesh(points, faces)


def ball_mesh(radius=1.0, rings=8, sides=16) -> TriangleMesh:
    """A closed ball of flat facets; its vertices lie on the sphere."""
    angle = np.linspace(0, np.pi, rings + 1)
    profile = [(radius * np.sin(a), -radius * np.cos(a)) for a in angle]
    profile[0], profile[-1] = (0.0, -radius), (0.0, radius)
    return revolved_mesh(profile, sides)


def beaker_mesh(radius=0.04, height=0.1, wall=0.002, sides=24) -> TriangleMesh:
    """A thin-walled beaker as a closed solid of glass, open at the top: its cavity is outside the solid."""
    inner = radius - wall
    return revolved_mesh([(0, 0), (radius, 0), (radius, height), (inner, height), (inner, wall), (0, wall)], sides)


def rod_mesh(radius=0.003, length=0.1, sides=8) -> TriangleMesh:
    """A closed rod along z from 0 to ``length``."""
    return revolved_mesh([(0, 0), (radius, 0), (radius, length), (0, length)], sides)


def without_faces(mesh: TriangleMesh, count: int) -> TriangleMesh:
    """The mesh without its last faces: an open surface."""
    return TriangleMesh(mesh.vertices, mesh.faces[:-count])


def merged(*meshes: TriangleMesh) -> TriangleMesh:
    """Several meshes as one of several components."""
    offsets = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
    faces = [mesh.faces + offset for mesh, offset in zip(meshes, offsets, strict=False)]
    return TriangleMesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces))


def moved(mesh: TriangleMesh, offset) -> TriangleMesh:
    """The mesh with its vertices shifted."""
    return TriangleMesh(mesh.vertices + np.asarray(offset, dtype=float), mesh.faces)


def random_rotations(rng: np.random.Generator, *shape: int) -> np.ndarray:
    """Uniform random rotations (..., 3, 3)."""
    return rotation_from_quaternion(rng.normal(size=(*shape, 4)))


def still(bodies, places, frames=1) -> Motion:
    """Bodies that stand unrotated at ``places`` (N, 3) for some frames of 1/90 s."""
    places = np.asarray(places, dtype=float)
    translations = np.broadcast_to(places, (frames, *places.shape))
    rotations = np.broadcast_to(np.eye(3), (frames, len(bodies), 3, 3))
    return Motion(np.arange(frames) / 90.0, translations, rotations, names=[body.name for body in bodies])


def lab(frames=240, seed=0, gaps=True) -> tuple[list[Body], Motion]:
    """Five bodies, three of them on smooth random paths through the others, with poses missing now and then."""
    rng = np.random.default_rng(seed)
    bodies = [
        Body("table", box_mesh((0.6, 0.6, 0.02))),
        Body("beaker", beaker_mesh()),
        Body("rod", rod_mesh()),
        Body("ball", ball_mesh(0.012)),
        Body("wand", without_faces(ball_mesh(0.05, 6, 10), 3)),
    ]
    time = np.arange(frames) / 90.0
    place = np.tile([[0, 0, -0.0101], [0, 0, 0], [0, 0, 0.03], [0.02, 0, 0.05], [0.1, 0, 0.05]], (frames, 1, 1))
    for body in (2, 3, 4):
        for axis in range(3):
            rate, phase = rng.uniform(0.3, 2.5, 3), rng.uniform(0, 6.28, 3)
            place[:, body, axis] += 0.03 * np.sin(time[:, None] * 6.28 * rate + phase).sum(axis=1)
    turn = np.tile(np.eye(3), (frames, 5, 1, 1))
    axis = rng.normal(size=(3, 3))
    for k, body in enumerate((2, 3, 4)):
        half = 0.3 * np.sin(time * 3 + k)
        direction = axis[k] / np.linalg.norm(axis[k])
        quaternion = np.column_stack([np.sin(half)[:, None] * direction, np.cos(half)])
        turn[:, body] = rotation_from_quaternion(quaternion)
    valid = np.ones((frames, 5), dtype=bool)
    if gaps:
        valid[frames // 3 : frames // 3 + 7, 2] = False
        valid[: frames // 40, 3] = False
    # A stretch in which everything stands still, as tracking loss or a put-down tool gives.
    place[frames // 2 : frames // 2 + 20], turn[frames // 2 : frames // 2 + 20] = place[frames // 2], turn[frames // 2]
    return bodies, Motion(time, place, turn, valid, names=[body.name for body in bodies])
