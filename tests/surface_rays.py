"""Rays against triangles, by brute force and apart from the product's own geometry, to measure meshes with."""

from __future__ import annotations

import numpy as np


def distances_along_rays(triangles, origins, directions, merge=1e-7):
    """Return, for each ray, the sorted distances at which it meets a triangle; hits within ``merge`` count once."""
    a = triangles[:, 0]
    edge1, edge2 = triangles[:, 1] - a, triangles[:, 2] - a
    found = []
    for origin, direction in zip(origins, directions, strict=True):
        across = np.cross(direction, edge2)
        determinant = np.einsum("ij,ij->i", edge1, across)
        with np.errstate(divide="ignore", invalid="ignore"):
            from_a = origin - a
            u = np.einsum("ij,ij->i", from_a, across) / determinant
            turned = np.cross(from_a, edge1)
            v = turned @ direction / determinant
            t = np.einsum("ij,ij->i", edge2, turned) / determinant
            hit = (u >= -1e-12) & (v >= -1e-12) & (u + v <= 1 + 1e-12) & (t > 0) & (determinant != 0)
        ahead = np.sort(t[hit])
        found.append(ahead[np.diff(ahead, prepend=-1.0) > merge])
    return found


def points_on_faces(mesh, count, seed):
    """Return points (n, 3) spread over the faces by area, each with the outward unit normal of its face."""
    rng = np.random.default_rng(seed)
    triangles = mesh.triangles
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    chosen = rng.choice(len(areas), count, p=areas / areas.sum())
    weights = rng.dirichlet([2.0, 2.0, 2.0], count)  # away from the edges, where two faces would be hit
    return np.einsum("nk,nki->ni", weights, triangles[chosen]), normals[chosen] / areas[chosen, None]
