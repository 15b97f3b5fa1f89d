"""Make the meshes of hands, wand and headset that `sessions.glassware` ships: python .ci/device_meshes.py

A hand is palm, thumb and four fingers curled about a cylinder whose axis is +Y through the origin. Wand and headset
are in the manner of the VIVE, of our own geometry: real device models belong to their makers, and these have the
proportions that matter to contacts, a handle, a ring, a face.

The solids are given as signed distances, in metres, negative inside. Marching tetrahedra cut a grid into a surface
that is closed by construction; the vertices are then evened out and laid back onto the solid.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial, reduce
from itertools import permutations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sessions.glassware.devices import COARSE_STEPS, FOLDER, GRIPS, TOLERANCES
from sessions.glassware.instrument import in_single_precision
from sessions.mesh_data import MeshData
from sessions.meshes.glb import mesh_to_glb
from sessions.meshes.mesh_files import simplified_mesh

Points = NDArray[np.float64]
Distance = NDArray[np.float64]
Solid = Callable[[Points], Distance]
Corner = tuple[float, float, float]

SMOOTHING_STEPS = 6
# A crossing is kept this share of an edge away from its ends, so that no triangle collapses at a grid point.
LEAST_SHARE = 0.08
GRADIENT_STEP = 1e-6
DENSE_FACES = 14_000
COUNT_TOLERANCE = 0.05


def surface_of(solid: Solid, low: Corner, high: Corner, faces: int) -> MeshData:
    """Return the closed surface of ``solid`` within the box ``low`` to ``high`` with about ``faces`` faces."""
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
    fraction = np.clip((points - a) @ along / (along @ along), 0.0, 1.0)
    distance: Distance = np.linalg.norm(points - a - fraction[:, None] * along, axis=1)
    return distance - (start_radius + fraction * (end_radius - start_radius))


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
    fraction = np.clip(0.5 + 0.5 * (b - a) / width, 0.0, 1.0)
    return b + (a - b) * fraction - width * fraction * (1.0 - fraction)


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
    grid = np.stack([piece.ravel() for piece in np.meshgrid(*axes, indexing="ij")]).T  # see _evened
    value = np.concatenate([solid(piece) for piece in np.array_split(grid, max(1, len(grid) // 200_000))])
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
    fraction = np.clip(value[a] / (value[a] - value[b]), LEAST_SHARE, 1.0 - LEAST_SHARE)[:, None]
    return grid[a] + fraction * (grid[b] - grid[a]), faces.reshape(-1, 3).astype(np.int64)


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
        rotated = _is_odd([a, b, c, d])
    else:
        apex, rest = (within[0], without) if len(within) == 1 else (without[0], within)
        faces = [[(apex, k) for k in rest]]
        rotated = _is_odd([apex, *rest]) ^ (len(within) == 3)
    return [face[::-1] for face in faces] if rotated else faces


def _is_odd(order: list[int]) -> bool:
    return sum(a > b for i, a in enumerate(order) for b in order[i + 1 :]) % 2 == 1


CLEARANCE = 2.0e-3  # between skin and the held cylinder; blending takes up to half of it
MOST_BEND = np.radians(105.0)
WRIST = 0.135  # how far behind the grip the arm is cut off


@dataclass(frozen=True)
class Finger:
    """Height of a finger above the grip, how far in front its knuckle lies, the lengths of its bones and its radius."""

    height: float
    forward: float
    lengths: tuple[float, float, float]
    radius: float
    droop: float


FINGERS = (
    Finger(0.031, 0.011, (0.043, 0.025, 0.020), 0.0088, -0.002),
    Finger(0.011, 0.015, (0.047, 0.029, 0.021), 0.0092, -0.001),
    Finger(-0.009, 0.012, (0.044, 0.027, 0.021), 0.0088, 0.001),
    Finger(-0.027, 0.006, (0.035, 0.020, 0.018), 0.0076, 0.003),
)
THUMB = Finger(0.036, 0.030, (0.036, 0.030, 0.024), 0.0104, 0.0015)


def _distance(points: Points, grip: float) -> Distance:
    palm = grip + CLEARANCE + 0.0125
    back = rounded_box(points, (palm, 0.002, 0.026), (0.0125, 0.043, 0.042), 0.0122)
    heel = ellipsoid(points, (palm + 0.001, -0.012, 0.062), (0.015, 0.031, 0.030))
    ball = capsule(points, (palm - 0.003, 0.026, 0.060), (palm - 0.006, 0.037, 0.034), 0.0155, 0.0125)
    flat = points * np.array([1.4, 1.0, 1.0])
    wrist = capsule(flat, (1.4 * palm + 0.004, -0.003, 0.070), (1.4 * palm + 0.010, -0.003, 0.180), 0.026, 0.029) / 1.2
    hand = blended(blended(blended(back, heel, 0.012), ball, 0.014), wrist, 0.016)
    hand = carved(hand, WRIST - points[:, 2], 0.004)
    for finger in FINGERS:
        hand = blended(hand, _curled(points, _joints(finger, grip, 1.0), finger.radius), 0.0055)
    return blended(hand, _curled(points, _joints(THUMB, grip, -1.0), THUMB.radius), 0.008)


def _curled(points: Points, joints: NDArray[np.float64], radius: float) -> Distance:
    """Return the distance to a finger along four joints, thicker at its knuckles than between them."""
    sizes = radius * np.array([1.10, 1.0, 0.93, 0.82])
    bones = [capsule(points, joints[i], joints[i + 1], sizes[i], sizes[i + 1]) for i in range(3)]
    knuckles = [np.linalg.norm(points - joints[i], axis=1) - 1.06 * sizes[i] for i in (1, 2)]
    distance: Distance = np.minimum(bones[0], knuckles[0])
    for other in (bones[1], knuckles[1], bones[2]):
        distance = blended(distance, other, 0.0015)
    return distance


def _joints(finger: Finger, grip: float, side: float) -> NDArray[np.float64]:
    """Return the joints (4, 3) of a finger; ``side`` is 1 for fingers, which bend round the front, -1 for a thumb.

    Each bone points along the tangent to the held cylinder, widened by the finger's radius, as links wrap a post.
    """
    post = grip + CLEARANCE + 1.1 * finger.radius
    position = np.array([grip + CLEARANCE + 0.0115, finger.forward])
    heading = np.pi / 2.0
    joints = [position]
    for length in finger.lengths:
        beyond = float(np.arccos(min(1.0, post / float(np.hypot(*position)))))
        expected = float(np.arctan2(position[1], position[0])) + beyond + np.pi / 2.0
        bend = np.mod(expected - heading + np.pi, 2.0 * np.pi) - np.pi
        heading += float(np.clip(bend, 0.0, MOST_BEND))
        position = position + length * np.array([np.cos(heading), np.sin(heading)])
        joints.append(position)
    heights = finger.height + finger.droop * np.arange(4)
    return np.array([[x, y, -side * forward] for (x, forward), y in zip(joints, heights, strict=True)])


def _wand(points: Points) -> Distance:
    flat = points * np.array([0.82, 1.0, 1.0])
    neck = capsule(flat, (0.0, -0.008, -0.015), (0.0, -0.012, 0.045), 0.0185, 0.0165)
    handle = capsule(flat, (0.0, -0.012, 0.045), (0.0, -0.030, 0.138), 0.0160, 0.0150)
    wand = blended(neck, handle, 0.004)
    ring = hoop(points, (0.0, -0.022, -0.045), (0.0, 0.80, -0.60), 0.044, 0.0115, 0.0085)
    wand = blended(wand, ring, 0.010)
    bridge = capsule(points, (0.0, -0.012, 0.0), (0.0, -0.004, -0.012), 0.020, 0.017)
    wand = blended(wand, bridge, 0.008)
    # The hole stays open where the neck and the bridge would fill it.
    hole = capsule(points, (0.0, 0.042, -0.093), (0.0, -0.086, 0.003), 0.031, 0.031)
    before_handle = 0.006 - points[:, 2] - 0.75 * (points[:, 1] + 0.022)
    wand = carved(wand, np.maximum(hole, -before_handle), 0.004)
    groove = hoop(points, (0.0, 0.0085, 0.030), (0.0, 1.0, 0.14), 0.0165, 0.0016, 0.0035)
    pad = ellipsoid(points, (0.0, 0.0045, 0.030), (0.0160, 0.0050, 0.0160))
    wand = carved(blended(wand, pad, 0.001), groove, 0.001)
    for z in (0.003, 0.056):
        button = np.linalg.norm(points - np.array([0.0, 0.0045 - 0.1 * (z - 0.003), z]), axis=1) - 0.0048
        wand = blended(wand, button, 0.001)
    trigger = capsule(points, (0.0, -0.030, 0.012), (0.0, -0.040, 0.030), 0.0085, 0.0050)
    return blended(wand, trigger, 0.003)


def _headset(points: Points) -> Distance:
    body = rounded_box(points, (0.0, 0.0, -0.050), (0.088, 0.050, 0.040), 0.030)
    brow = ellipsoid(points, (0.0, 0.006, -0.072), (0.080, 0.044, 0.030))
    shell = blended(body, brow, 0.015)
    cushion = rounded_box(points, (0.0, 0.0, -0.004), (0.074, 0.044, 0.022), 0.018)
    shell = blended(shell, cushion, 0.006)
    face = ellipsoid(points, (0.0, 0.002, 0.030), (0.062, 0.036, 0.062))
    nose = capsule(points, (0.0, -0.075, 0.01), (0.0, -0.020, -0.012), 0.030, 0.010)
    shell = carved(carved(shell, face, 0.006), nose, 0.006)
    camera = np.linalg.norm(points - np.array([0.0, -0.030, -0.099]), axis=1) - 0.007
    shell = blended(shell, camera, 0.003)
    # Hollows of the sensors: two rows on the front, and the temples.
    dimples = [(x, y, -0.1065 + 4.5 * x * x) for y in (0.030, -0.008) for x in (-0.055, -0.028, 0.0, 0.028, 0.055)]
    dimples += [(sign * 0.094, y, -0.052) for sign in (-1.0, 1.0) for y in (0.022, -0.022)]
    for x, y, z in dimples:
        shell = carved(shell, np.linalg.norm(points - np.array([x, y, z]), axis=1) - 0.0095, 0.002)
    straps = np.minimum(_band(points), _crown(points))
    return blended(shell, straps, 0.008)


def _band(points: Points) -> Distance:
    """Return the strap that runs level round the head, an oval ribbon behind the face."""
    local = points - np.array([0.0, 0.012, 0.075])
    behind = np.maximum(local[:, 2], 0.0) * 0.078 / 0.105
    oval = np.column_stack([local[:, 0], behind])
    out = np.linalg.norm(oval, axis=1) - 0.080
    section = np.column_stack([out, local[:, 1] + 0.06 * local[:, 2], np.zeros_like(out)])
    ribbon = rounded_box(section, (0.0, 0.0, 0.0), (0.0060, 0.0150, 0.01), 0.0058)
    return np.maximum(ribbon, -0.100 - local[:, 2])


def _crown(points: Points) -> Distance:
    """Return the strap that runs over the head from the brow to the back."""
    local = points - np.array([0.0, 0.005, 0.075])
    oval = local[:, 1:]
    out = np.linalg.norm(oval, axis=1) - 0.107
    section = np.column_stack([local[:, 0], out, np.zeros_like(out)])
    ribbon = rounded_box(section, (0.0, 0.0, 0.0), (0.0140, 0.0060, 0.01), 0.0058)
    return np.maximum(ribbon, -local[:, 1] + 0.005)


def main() -> None:
    """Write every mesh."""
    meshes = {
        "wand": surface_of(_wand, (-0.065, -0.085, -0.11), (0.065, 0.05, 0.165), DENSE_FACES),
        "headset": surface_of(_headset, (-0.12, -0.10, -0.11), (0.12, 0.13, 0.20), DENSE_FACES),
    }
    for grip in GRIPS:
        reach = grip + 0.06
        corners = (-reach, -0.07, -reach), (reach + 0.03, 0.075, 0.15)
        meshes[f"hand_{1e3 * grip:.0f}"] = surface_of(partial(_distance, grip=grip), *corners, DENSE_FACES)
    for name, mesh in meshes.items():
        fine = in_single_precision(mesh)
        coarse = reduce(simplified_mesh, TOLERANCES[: COARSE_STEPS[name.partition("_")[0]]], fine)
        for file, level in ((name, fine), (f"{name}_coarse", coarse)):
            (FOLDER / f"{file}.glb").write_bytes(mesh_to_glb(level, name))
            print(f"{file:14} {len(level.faces):6,} faces")


if __name__ == "__main__":
    main()
