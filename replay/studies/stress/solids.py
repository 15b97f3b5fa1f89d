"""Meshes with known geometry for the hard cases of whole bodies: boxes, things turned on a lathe, icospheres."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike

from cdcore import TriangleMesh
from cdcore.bounding.hull import hull_of
from sessions.geometry.solids import box


def box_mesh(size: ArrayLike = (1.0, 1.0, 1.0), centre: ArrayLike = (0.0, 0.0, 0.0)) -> TriangleMesh:
    """A closed box of 12 faces."""
    box_shape = box(size, centre)
    return TriangleMesh(box_shape.vertices, box_shape.faces)


def revolved_mesh(profile: Sequence[tuple[float, float]], sides: int = 16) -> TriangleMesh:
    """A profile of (radius, height) turned about z; closed where it starts and ends on the axis."""
    radius, height = np.array(profile, dtype=float).T[:, :, None]
    angle = 2 * np.pi * np.arange(sides) / sides
    ring_points = np.broadcast_arrays(radius * np.cos(angle), radius * np.sin(angle), height)
    # A ring on the axis is one point.
    ring_sizes = np.where(radius[:, 0] > 0, sides, 1)
    points = [ring[:count] for ring, count in zip(np.stack(ring_points, axis=-1), ring_sizes, strict=True)]
    ring = (np.cumsum(ring_sizes) - ring_sizes)[:, None] + np.arange(sides) * (radius > 0)
    lower, upper = ring[:-1], ring[1:]
    lower_next, upper_next = (np.roll(ring_edge, -1, axis=1) for ring_edge in (lower, upper))
    faces = np.stack([lower, lower_next, upper_next, lower, upper_next, upper], axis=-1).reshape(-1, 3)
    has_area = (np.diff(np.sort(faces), axis=1) > 0).all(axis=1)
    return TriangleMesh(np.concatenate(points), faces[has_area])


def ball_mesh(radius: float = 1.0, rings: int = 8, sides: int = 16) -> TriangleMesh:
    """A closed ball of flat facets; its vertices lie on the sphere."""
    angle = np.linspace(0, np.pi, rings + 1)
    profile = [(radius * float(np.sin(a)), -radius * float(np.cos(a))) for a in angle]
    profile[0], profile[-1] = (0.0, -radius), (0.0, radius)
    return revolved_mesh(profile, sides)


def beaker_mesh(radius: float = 0.04, height: float = 0.1, wall: float = 0.002, sides: int = 24) -> TriangleMesh:
    """A thin-walled beaker as a closed solid of glass, open at the top: its cavity is outside the solid."""
    inner = radius - wall
    return revolved_mesh([(0, 0), (radius, 0), (radius, height), (inner, height), (inner, wall), (0, wall)], sides)


def rod_mesh(radius: float = 0.003, length: float = 0.1, sides: int = 8) -> TriangleMesh:
    """A closed rod along z from 0 to ``length``."""
    return revolved_mesh([(0, 0), (radius, 0), (radius, length), (0, length)], sides)


def icosphere_mesh() -> TriangleMesh:
    """An icosahedron whose faces are split in four, on a sphere of radius 1; a vertex of six faces lies exactly on each
    half axis.
    """
    golden_ratio = (1 + np.sqrt(5)) / 2
    corners = [np.roll([0.0, a, b * golden_ratio], shift) for shift in range(3) for a in (-1, 1) for b in (-1, 1)]
    edge_midpoints = [(a + b) / 2 for a, b in combinations(corners, 2) if np.linalg.norm(a - b) < 2.1]
    points = np.array(corners + edge_midpoints)
    sphere = hull_of(points / np.linalg.norm(points, axis=1, keepdims=True))
    assert sphere is not None
    return sphere


def merge_meshes(*meshes: TriangleMesh) -> TriangleMesh:
    """Several meshes as one of several components."""
    offsets = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
    faces = [mesh.faces + offset for mesh, offset in zip(meshes, offsets, strict=False)]
    return TriangleMesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces))


def shift_mesh(mesh: TriangleMesh, offset: ArrayLike) -> TriangleMesh:
    """The mesh with its vertices shifted."""
    return TriangleMesh(mesh.vertices + np.asarray(offset, dtype=float), mesh.faces)
