"""Closed surfaces of solids that are given as a signed distance: hands and controllers, whose shapes flow into each
other.

Marching tetrahedra cut a grid into a surface that is closed by construction; the vertices are then evened out and
laid back onto the solid. Distances are in metres, negative inside.
"""

from collections.abc import Callable
from functools import lru_cache
from itertools import permutations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sessions.mesh_data import MeshData
from sessions.meshes.mesh_files import simplified

Points = NDArray[np.float64]
Distance = NDArray[np.float64]
Solid = Callable[[Points], Distance]
Corner = tuple[float, float, float]

SMOOTHING_STEPS = 6
# A crossing is kept this share of an edge away from its ends, so that no triangle collapses at a grid point.
LEAST_SHARE = 0.08
GRADIENT_STEP = 1e-6
# Below this a mesh of this many faces is simplified: flat parts give up their faces, straps and fingers keep theirs.
DENSE_FACES = 14_000
COUNT_TOLERANCE = 0.05
FIRST_TOLERANCE, LAST_TOLERANCE, TOLERANCE_GROWTH = 1e-4, 0.02, 1.15


def surface_of(solid: Solid, low: Corner, high: Corner, faces: int) -> MeshData:
    """Return the closed surface of ``solid`` within the box ``low`` to ``high`` with about ``faces`` faces."""
    mesh = _dense_surface(solid, low, high, max(faces, DENSE_FACES))
    return mesh if faces >= DENSE_FACES else _thinned(mesh, faces)


@lru_cache(maxsize=8)
def _dense_surface(solid: Solid, low: Corner, high: Corner, faces: int) -> MeshData:
    """Made once for meshes of any size: most of a second, and a folder of recordings asks for it again and again."""
    corners = np.array(low), np.array(high)
    spacing = float(np.cbrt((corners[1] - corners[0]).prod())) / 30.0
    surface = _marched(solid, *corners, spacing)
    for _ in range(5):
        ratio = len(surface[1]) / faces
        if abs(ratio - 1.0) < COUNT_TOLERANCE:
            break
        spacing *= float(np.sqrt(ratio))
        surface = _marched(solid, *corners, spacing)
    return _finished(solid, *surface, spacing)


def capsule(points: Points, start: ArrayLike, end: ArrayLike, start_radius: float, end_radius: float) -> Distance:
    """Return the distance to a ball that moves from ``start`` to ``end`` while its radius changes."""
    a = np.asarray(start, dtype=np.float64)
    along = np.asarray(end, dtype=np.float64) - a
    share = np.clip((points - a) @ along / (along @ along), 0.0, 1.0)
    distance: Distance = np.linalg.norm(points - a - share[:, None] * along, axis=1)
    return distance - (start_radius + share * (end_radius - start_radius))


def rounded_box(points: Points, centre: ArrayLike, half: ArrayLike, radius: float) -> Distance:
    """Return the distance to a box of half extents ``half`` whose edges are rounded by ``radius``."""
    beyond = np.abs(points - np.asarray(centre)) - (np.asarray(half, dtype=np.float64) - radius)
    outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=1)
    return outside + np.minimum(beyond.max(axis=1), 0.0) - radius


def ellipsoid(points: Points, centre: ArrayLike, half: ArrayLike) -> Distance:
    """Return nearly the distance to an ellipsoid: exact on its surface, right in sign."""
    axes = np.asarray(half, dtype=np.float64)
    local = points - np.asarray(centre)
    level = np.linalg.norm(local / axes, axis=1)
    slope = np.linalg.norm(local / axes**2, axis=1)
    # At the very middle, where the direction to the surface is undefined, the least half axis is right.
    scale = np.where(slope > 1e-9, level / np.maximum(slope, 1e-9), axes.min())
    return (level - 1.0) * scale


def hoop(
    points: Points, centre: ArrayLike, axis: ArrayLike, radius: float, half_width: float, half_height: float
) -> Distance:
    """Return nearly the distance to a ring about ``axis`` whose cross-section is an ellipse."""
    normal = np.asarray(axis, dtype=np.float64) / np.linalg.norm(axis)
    local = points - np.asarray(centre)
    height = local @ normal
    out = np.linalg.norm(local - height[:, None] * normal, axis=1) - radius
    section = np.column_stack([out, height, np.zeros_like(out)])
    return ellipsoid(section, (0.0, 0.0, 0.0), (half_width, half_height, 1.0))


def blended(a: Distance, b: Distance, width: float) -> Distance:
    """Return the union of two solids with the crease between them filled over about ``width``."""
    share = np.clip(0.5 + 0.5 * (b - a) / width, 0.0, 1.0)
    return b + (a - b) * share - width * share * (1.0 - share)


def carved(a: Distance, b: Distance, width: float) -> Distance:
    """Return the solid ``a`` without ``b``, the edge between them rounded over about ``width``."""
    return -blended(-a, b, width)


def _finished(solid: Solid, vertices: Points, faces: NDArray[np.int64], spacing: float) -> MeshData:
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    degree = np.bincount(start, minlength=len(vertices))[:, None]
    for _ in range(SMOOTHING_STEPS):
        sums = np.column_stack([np.bincount(start, vertices[end, k], len(vertices)) for k in range(3)])
        vertices = _evened(solid, vertices, sums / degree, 0.5 * spacing)
    return MeshData(_evened(solid, vertices, vertices, 0.5 * spacing), faces)


def _evened(solid: Solid, points: Points, middles: Points, most: float) -> Points:
    """Return the points moved half way to ``middles`` along the surface, and by a Newton step of at most ``most``
    onto it.

    Moving along the surface only keeps thin straps as thick as they are; moving freely ate notches into their edges.
    """
    steps = np.eye(3) * GRADIENT_STEP
    # Coordinates lie one after the other in memory: hands of points in rows of three took 1.6 times as long (2026-11).
    points, middles = np.asfortranarray(points), np.asfortranarray(middles)
    value = solid(points)
    gradient = np.column_stack([(solid(points + step) - value) / GRADIENT_STEP for step in steps])
    length = np.maximum(np.linalg.norm(gradient, axis=1, keepdims=True), 0.2)
    normal = gradient / length
    drift = 0.5 * (middles - points)
    drift -= normal * np.einsum("ij,ij->i", drift, normal)[:, None]
    return points + drift - normal * np.clip(value[:, None] / length, -most, most)


def _marched(solid: Solid, low: Points, high: Points, spacing: float) -> tuple[Points, NDArray[np.int64]]:
    """Return vertices and faces of the zero level over a grid whose cells are cut into six tetrahedra each."""
    counts = np.ceil((high - low) / spacing).astype(np.int64) + 1
    axes = [low[k] + spacing * np.arange(counts[k]) for k in range(3)]
    grid = np.stack([part.ravel() for part in np.meshgrid(*axes, indexing="ij")]).T  # see _evened
    value = np.concatenate([solid(part) for part in np.array_split(grid, max(1, len(grid) // 200_000))])
    on_border = ((grid <= grid[0]) | (grid >= grid[-1])).any(axis=1)
    value[on_border] = np.maximum(value[on_border], spacing)  # what reaches out of the box is cut off, and stays closed
    index = np.arange(len(grid)).reshape(counts)
    inside = (value < 0.0).reshape(counts)
    corner_inside = [inside[_slices(counts, c)] for c in np.ndindex(2, 2, 2)]
    mixed = np.any(corner_inside, axis=0) & ~np.all(corner_inside, axis=0)
    cells = index[_slices(counts, (0, 0, 0))][mixed]
    stride = np.array([counts[1] * counts[2], counts[2], 1])
    edges = np.concatenate([_cut_tetrahedra(cells, order, stride, value) for order in permutations(range(3))])
    keys, faces = np.unique(edges[..., 0] * len(grid) + edges[..., 1], return_inverse=True)
    a, b = keys // len(grid), keys % len(grid)
    share = np.clip(value[a] / (value[a] - value[b]), LEAST_SHARE, 1.0 - LEAST_SHARE)[:, None]
    return grid[a] + share * (grid[b] - grid[a]), faces.reshape(-1, 3).astype(np.int64)


def _slices(counts: NDArray[np.int64], corner: tuple[int, ...]) -> tuple[slice, ...]:
    return tuple(slice(c, int(n) - 1 + c) for c, n in zip(corner, counts, strict=True))


def _cut_tetrahedra(
    cells: NDArray[np.int64], order: tuple[int, ...], stride: NDArray[np.int64], value: Distance
) -> NDArray[np.int64]:
    """Return triangles (t, 3, 2) of grid edges, each edge's lower index first, wound outwards."""
    steps = np.cumsum([0, *stride[list(order)]])
    even = order in ((0, 1, 2), (1, 2, 0), (2, 0, 1))
    corners = cells[:, None] + (steps if even else steps[[1, 0, 2, 3]])  # all tetrahedra right-handed
    inside = value[corners] < 0.0
    triangles: list[NDArray[np.int64]] = []
    for code in range(1, 15):
        chosen = corners[(inside * np.array([1, 2, 4, 8])).sum(axis=1) == code]
        if not len(chosen):
            continue
        for face in _pattern([k for k in range(4) if code >> k & 1]):
            triangles.append(np.stack([np.sort(chosen[:, list(edge)], axis=1) for edge in face], axis=1))
    return np.concatenate([np.empty((0, 3, 2), dtype=np.int64), *triangles])


def _pattern(within: list[int]) -> list[list[tuple[int, int]]]:
    """Return the triangles, as edges of a right-handed tetrahedron, that part the corners ``within`` from the rest."""
    without = [k for k in range(4) if k not in within]
    if len(within) == 2:
        (a, b), (c, d) = within, without
        quad = [(a, c), (a, d), (b, d), (b, c)]
        faces = [[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]]
        turned = _is_odd([a, b, c, d])
    else:
        apex, rest = (within[0], without) if len(within) == 1 else (without[0], within)
        faces = [[(apex, k) for k in rest]]
        turned = _is_odd([apex, *rest]) ^ (len(within) == 3)
    return [face[::-1] for face in faces] if turned else faces


def _is_odd(order: list[int]) -> bool:
    return sum(a > b for i, a in enumerate(order) for b in order[i + 1 :]) % 2 == 1


def _thinned(mesh: MeshData, faces: int) -> MeshData:
    """Return the mesh with about ``faces`` faces, simplified in small steps: one large step stalls at 730."""
    tolerance, before, after = FIRST_TOLERANCE, mesh, mesh
    while len(after.faces) > faces and tolerance < LAST_TOLERANCE:
        before, after = after, simplified(after, tolerance)
        tolerance *= TOLERANCE_GROWTH
    return min(before, after, key=lambda trial: abs(np.log(len(trial.faces) / faces)))
