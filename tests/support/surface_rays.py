"""Rays against triangles, by brute force and apart from the product's own geometry, to measure meshes with."""

import numpy as np

AT_ONCE = 100_000
"""Rays times triangles that are in memory together."""


def distances_along_rays(triangles, origins, directions, merge=1e-7):
    """Return, for each ray, the sorted distances at which it meets a triangle; hits within ``merge`` count once."""
    origins, directions = np.asarray(origins, dtype=float), np.asarray(directions, dtype=float)
    step = max(1, AT_ONCE // max(1, len(triangles)))
    found = []
    for k in range(0, len(origins), step):
        for row in np.sort(_distances(triangles, origins[k : k + step], directions[k : k + step]), axis=1):
            ahead = row[np.isfinite(row)]
            found.append(ahead[np.diff(ahead, prepend=-1.0) > merge])
    return found


def _distances(triangles, origins, directions):
    """Return (rays, triangles) distances, infinity where a ray meets no triangle."""
    a = triangles[:, 0]
    edge1, edge2 = triangles[:, 1] - a, triangles[:, 2] - a
    across = np.cross(directions[:, None], edge2)
    determinant = np.einsum("tj,rtj->rt", edge1, across)
    with np.errstate(divide="ignore", invalid="ignore"):
        from_a = origins[:, None] - a
        u = np.einsum("rtj,rtj->rt", from_a, across) / determinant
        turned = np.cross(from_a, edge1)
        v = np.einsum("rtj,rj->rt", turned, directions) / determinant
        t = np.einsum("tj,rtj->rt", edge2, turned) / determinant
        hit = (u >= -1e-12) & (v >= -1e-12) & (u + v <= 1 + 1e-12) & (t > 0) & (determinant != 0)
    return np.where(hit, t, np.inf)


def points_on_faces(mesh, count, seed):
    """Return points (n, 3) spread over the faces by area, each with the outward unit normal of its face."""
    rng = np.random.default_rng(seed)
    triangles = mesh.triangles
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    areas = np.linalg.norm(normals, axis=1)
    chosen = rng.choice(len(areas), count, p=areas / areas.sum())
    weights = rng.dirichlet([2.0, 2.0, 2.0], count)  # away from the edges, where two faces would be hit
    return np.einsum("nk,nki->ni", weights, triangles[chosen]), normals[chosen] / areas[chosen, None]
