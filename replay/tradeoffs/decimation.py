"""Coarser and finer meshes: vertices in a cell of a grid become one, or faces are cut in four."""

from dataclasses import replace

import numpy as np

from cdcore import TriangleMesh
from replay.errors import TradeoffError
from replay.prepare.assembly import Assembly

FEWEST_FACES = 4
"""A mesh that a grid would leave with less keeps its own: fewer triangles enclose nothing."""


def clustered(mesh: TriangleMesh, cell: float) -> TriangleMesh:
    """A coarser mesh: one vertex per occupied cell, the mean of those in it; triangles that lose a corner are dropped.

    No vertex moves by more than the cell's diagonal. Choose it where any mesh must become coarser, open ones and ones
    that are no manifold too; edge collapse keeps the shape better and needs a manifold.
    ``cell`` is the edge of a cell in metres.

    Source: J. Rossignac, P. Borrel, Multi-resolution 3D approximations for rendering complex scenes, in Modeling in
    Computer Graphics, Springer 1993.

    Raises ``TradeoffError``: a cell that is not positive and finite.
    """
    if not 0.0 < cell < float("inf"):
        raise TradeoffError(f"cell={cell!r} is no length; give metres above 0")
    used, corners = np.unique(mesh.faces, return_inverse=True)
    points = mesh.vertices[used]
    group = np.unique(np.floor(points / cell).astype(np.int64), axis=0, return_inverse=True)[1].reshape(-1)
    count = np.bincount(group)[:, None]
    middle = np.stack([np.bincount(group, weights=points[:, k]) for k in range(3)], axis=1)
    faces = group[corners.reshape(-1, 3)]
    a, b, c = faces.T
    faces = faces[(a != b) & (b != c) & (a != c)]
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    return mesh if len(first) < FEWEST_FACES else TriangleMesh(middle / count, faces[np.sort(first)])


def decimated(assembly: Assembly, cell: float) -> Assembly:
    """The assembly with every mesh clustered in cells of this edge (metres); poses and pairs stay."""
    bodies = tuple(replace(body, mesh=clustered(body.mesh, cell)) for body in assembly.bodies)
    return replace(assembly, bodies=bodies)


def quartered(mesh: TriangleMesh) -> TriangleMesh:
    """Every face cut at the middles of its edges; a shared edge has one middle, so that a closed mesh stays closed."""
    faces = mesh.faces.astype(np.int64)
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    unique, number = np.unique(edges, axis=0, return_inverse=True)
    a, b, c = faces.T
    ab, bc, ca = number.reshape(3, -1) + len(mesh.vertices)
    parts = [np.stack(part, axis=1) for part in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
    return TriangleMesh(np.vstack([mesh.vertices, mesh.vertices[unique].mean(axis=1)]), np.concatenate(parts))
