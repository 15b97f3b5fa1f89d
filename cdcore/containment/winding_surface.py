"""A surface that ray parity refuses, made ready for its winding number: parts, holes, and caps that close the holes.

Parity has no answer for a mesh with holes, with faces drawn twice, or with parts that cross or lie in each other. Here
faces that are drawn twice count once, walls between two cells of a solid not at all, every connected part is wound one
way, and a fan of triangles from the middle of its rim closes every hole. Each part with its caps then goes round any
point a whole number of times.

A hole stands for missing faces, and its cap for those, where it is small or its cap continues the surface. Else it is
an opening, as the mouth of a beaker of one wall: whether such a part is filled, nobody can tell from its surface.
"""

from __future__ import annotations

from collections.abc import Iterator
from enum import IntEnum
from typing import Final, NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from cdcore.containment.closed_parts import components_near_each_other, components_that_meet
from cdcore.containment.ray_parity import InsideGrid, build_inside_grid
from cdcore.containment.winding_number import winding_numbers
from cdcore.mesh import TriangleMesh, once_a_mesh, winding
from cdcore.numerics import BoolArray, FloatArray, IntArray

TINY_FRACTION: Final = 1e-3
"""Of a part's area: a hole this small is a crack or a lost face, whatever its rim. The mouth of a narrow volumetric
flask of one wall takes 5e-3."""

LARGEST_FRACTION: Final = 0.1
"""Of a part's area: larger holes are openings. One triangle of a box of twelve takes up to 0.09."""

MOST_RIM_EDGES: Final = 6
"""Edges around lost faces: of one face three, of two four, of all faces at a corner six. Round mouths have eight or
more."""

SMOOTH_COSINE: Final = 0.7
"""Of the angle between a cap and the face beside it: 45 degrees or less continue the surface. The cap of a mouth stands
upright on the wall around it; faces of an icosahedron are 42 degrees apart."""

WALL_POINTS: Final = np.array([[1, 1, 1], [2.94, 0.03, 0.03], [0.03, 2.94, 0.03], [0.03, 0.03, 2.94]]) / 3.0
"""Where in a face one looks whether all of it lies inside a solid: its middle, and near its corners."""

MOST_WALL_TESTS: Final = 25_000_000
"""Faces drawn from both sides times others: two seconds. Beyond, what has walls counts as having holes."""

FEWEST_SIDES: Final = 4
"""Flat sheets that can enclose something: the sides of a tetrahedron."""

FLAT_FRACTION: Final = 1e-7
"""Of a sheet's length: thinner ones are flat. Files in float32 keep seven digits."""

MOST_TRACED: Final = 20_000
"""Edges of rims that are followed: a mesh with more has no holes, it is loose triangles."""


class ComponentKind(IntEnum):
    """Kinds of connected parts of a surface."""

    CLOSED = 0
    """Every edge is passed as often one way as the other."""
    HOLED = 1
    """Faces are missing, and caps stand for them."""
    OPEN = 2
    """It has an opening: no one knows whether it is filled."""


CLOSED, HOLED, OPEN = (int(kind) for kind in ComponentKind)


class WindingSurface(NamedTuple):
    """K parts of a surface, with caps, in the body's frame.

    ``grid`` holds the faces and all caps, ``component`` (f,) the part of each of its triangles. ``boxes`` (K, 2, 3) of
    the parts; ``kinds`` (K,) values of ``ComponentKind``; ``signs`` (K,): 1 where normals point out, -1 where they
    point in, 0 of a flat part; ``opposed`` (K,): 1 where a part crosses one that is wound the other way. Of part k are
    ``caps`` (c, 3, 3) from ``first_cap[k]`` to ``first_cap[k + 1]``, and ``holes`` (h, 2, 3), boxes of rims, from
    ``first_hole[k]`` to ``first_hole[k + 1]``.
    """

    grid: InsideGrid
    component: IntArray
    boxes: FloatArray
    kinds: IntArray
    signs: IntArray
    opposed: IntArray
    caps: FloatArray
    first_cap: IntArray
    holes: FloatArray
    first_hole: IntArray


class Hole(NamedTuple):
    """The cap (c, 3, 3) of a hole, the box (2, 3) of its rim, and whether the cap continues the surface at an edge."""

    cap: FloatArray
    box: FloatArray
    smooth: bool

    @property
    def area(self) -> float:
        """Square metres of the cap."""
        return float(_areas(self.cap).sum())


@once_a_mesh
def winding_surface(mesh: TriangleMesh) -> WindingSurface:
    """The parts of a mesh with their caps. Cost: a millisecond a thousand faces, once a mesh."""
    # Scaled by a power of two, which rounds nothing: areas of a mesh of 1e90 m overflow, of 1e-97 m they vanish.
    exponent = int(np.frexp(np.abs(mesh.triangles).max())[1])
    components = _joined_components(_components(mesh, -exponent))
    caps = [_stacked_arrays([hole.cap for hole in component.holes], (0, 3, 3)) for component in components]
    return WindingSurface(
        grid=build_inside_grid(
            np.ldexp(_stacked_arrays([component.triangles for component in components] + caps, (0, 3, 3)), exponent)
        ),
        component=np.concatenate(
            [
                np.repeat(np.arange(len(components)), [len(component.triangles) for component in components]),
                np.repeat(np.arange(len(components)), [len(cap) for cap in caps]),
            ]
        ).astype(np.int64),
        boxes=np.ldexp(np.array([component.box for component in components]).reshape(-1, 2, 3), exponent),
        kinds=np.array([component.kind for component in components], dtype=np.int64),
        signs=np.array([component.sign for component in components], dtype=np.int64),
        opposed=_opposed_components(components),
        caps=np.ldexp(_stacked_arrays(caps, (0, 3, 3)), exponent),
        first_cap=_starts([len(cap) for cap in caps]),
        holes=np.ldexp(
            _stacked_arrays([hole.box[None] for component in components for hole in component.holes], (0, 2, 3)),
            exponent,
        ),
        first_hole=_starts([len(component.holes) for component in components]),
    )


class _SurfaceComponent(NamedTuple):
    """A connected part: triangles (f, 3, 3), its holes, what it is, and which way its normals point."""

    triangles: FloatArray
    holes: list[Hole]
    kind: ComponentKind
    sign: int

    @property
    def box(self) -> FloatArray:
        """Least and largest coordinates, (2, 3)."""
        return np.array([self.triangles.min(axis=(0, 1)), self.triangles.max(axis=(0, 1))])


def _components(mesh: TriangleMesh, exponent: int) -> list[_SurfaceComponent]:
    """The connected parts of a mesh, every face once, neighbours wound alike; lengths times 2 to the exponent."""
    faces, corners, labels = _single_faces(mesh, exponent)
    flipped = _flips(faces)
    faces[flipped] = faces[flipped, ::-1]
    corners[flipped] = corners[flipped, ::-1]
    holes: list[list[Hole]] = [[] for _ in range(int(labels.max(initial=-1)) + 1)]
    for first_edge, rim in _rims(faces):
        holes[labels[first_edge // 3]].append(_hole(rim, corners))
    order = np.argsort(labels, kind="stable")
    triangles = np.split(corners[order], np.flatnonzero(np.diff(labels[order])) + 1) if holes else []
    return [
        _SurfaceComponent(
            component, own, _kind(component, own), winding(np.concatenate([component, *(hole.cap for hole in own)]))
        )
        for component, own in zip(triangles, holes, strict=True)
    ]


def _joined_components(components: list[_SurfaceComponent]) -> list[_SurfaceComponent]:
    """Closed parts and parts that lost faces as they are; all others as one, for together they may enclose something.

    Fewer flat sheets than ``FEWEST_SIDES`` enclose nothing and are left out.
    """
    closed = [component for component in components if component.kind != ComponentKind.OPEN]
    flat = [
        component for component in components if component.kind == ComponentKind.OPEN and _is_flat(component.triangles)
    ]
    curved = [
        component
        for component in components
        if component.kind == ComponentKind.OPEN and not _is_flat(component.triangles)
    ]
    others = curved + (flat if len(flat) >= FEWEST_SIDES else [])
    if len(others) <= 1:
        return closed + others
    signs = {component.sign for component in others}
    triangles = np.concatenate([component.triangles for component in others])
    together = _SurfaceComponent(
        triangles,
        [hole for component in others for hole in component.holes],
        ComponentKind.OPEN,
        signs.pop() if len(signs) == 1 else 0,
    )
    return [*closed, together]


def _is_flat(triangles: FloatArray) -> bool:
    """Whether all corners (f, 3, 3) lie in one plane, up to rounding."""
    points = triangles.reshape(-1, 3)
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False) if len(points) < 10_000 else _extents(points)
    return bool(spread[-1] <= FLAT_FRACTION * spread[0])


def _extents(points: FloatArray) -> FloatArray:
    """Lengths along the principal axes of many points (n, 3), the largest first, to half of the digits."""
    away = points - points.mean(axis=0)
    return np.sqrt(np.maximum(np.linalg.eigvalsh(away.T @ away)[::-1], 0.0))


def _single_faces(mesh: TriangleMesh, exponent: int) -> tuple[IntArray, FloatArray, IntArray]:
    """Merged faces (n, 3) with three different corners, each once; their corners (n, 3, 3), times 2 to the exponent,
    and number of part (n,).

    Without walls between the cells of a solid, as blocks have that are stacked side to side.
    """
    a, b, c = mesh.merged_faces.T
    proper = np.flatnonzero((a != b) & (b != c) & (c != a))
    faces = mesh.merged_faces[proper]
    _, first, face = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_inverse=True)
    first_corner, second, third = faces.T
    # Whether the corners are an odd permutation of their numbers: so is one of the two sides of a face.
    odd = (first_corner < second) ^ (second < third) ^ (third < first_corner)
    sides = np.bincount(face.reshape(-1), weights=np.where(odd, -1.0, 1.0))
    chosen = np.sort(first)
    from_both_sides = sides[face.reshape(-1)[chosen]] == 0.0
    kept = proper[chosen]
    corners = np.ldexp(mesh.triangles[kept], exponent)
    if from_both_sides.any() and not from_both_sides.all():
        outer = ~_are_walls(mesh.merged_faces[kept], corners, mesh.components[kept], from_both_sides)
        kept, corners = kept[outer], corners[outer]
    _, labels = np.unique(mesh.components[kept], return_inverse=True)
    return mesh.merged_faces[kept].copy(), corners, labels.reshape(-1).astype(np.int64)


def _are_walls(faces: IntArray, corners: FloatArray, components: IntArray, from_both_sides: BoolArray) -> BoolArray:
    """Marks faces (n, 3), with corners (n, 3, 3), inside the solid that one-sided faces of their component enclose,
    (n,).

    Only faces drawn from both sides (n,) do. They bound no solid; counted once, each would leave edges of three faces
    around it, which look like the rim of a hole.
    """
    walls = np.zeros(len(faces), dtype=np.bool_)
    for component in np.unique(components[from_both_sides]).tolist():
        inside = components == component
        skin, doubled = np.flatnonzero(inside & ~from_both_sides), np.flatnonzero(inside & from_both_sides)
        if not len(skin) or len(skin) * len(doubled) > MOST_WALL_TESTS:
            continue
        skin_faces, skin_corners = faces[skin], corners[skin]
        flipped = _flips(skin_faces)
        skin_faces[flipped] = skin_faces[flipped, ::-1]
        skin_corners[flipped] = skin_corners[flipped, ::-1]
        if _excess(skin_faces).any():
            continue
        points = np.einsum("kc,fcx->fkx", WALL_POINTS, corners[doubled]).reshape(-1, 3)
        numbers = winding_numbers(points, skin_corners).reshape(-1, len(WALL_POINTS))
        walls[doubled] = (np.abs(numbers) > 0.5).all(axis=1)
    return walls


def _excess(faces: IntArray) -> IntArray:
    """Counts how much oftener each edge is passed in its own direction than in the other, along the faces, (3n,)."""
    start, end, edge, _ = _edges(faces)
    net = np.bincount(edge, weights=np.where(start < end, 1.0, -1.0)).astype(np.int64)
    return np.where(start < end, net[edge], -net[edge])


def _edges(faces: IntArray) -> tuple[IntArray, IntArray, IntArray, IntArray]:
    """Start and end of every edge along the faces (3n,), its number in either direction, and uses of each number."""
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    keys = np.minimum(start, end) * (int(faces.max(initial=0)) + 1) + np.maximum(start, end)
    _, edge, uses = np.unique(keys, return_inverse=True, return_counts=True)
    return start, end, edge.reshape(-1), uses


def _flips(faces: IntArray) -> BoolArray:
    """Marks the fewest faces (n, 3) to reverse so that neighbours over an edge of two faces are wound alike.

    A surface that cannot be wound alike, as a Moebius strip, stays as it is.
    """
    count = len(faces)
    start, end, edge, uses = _edges(faces)
    order = np.argsort(edge, kind="stable")
    order = order[uses[edge[order]] == 2].reshape(-1, 2)
    first, second = (order // 3).T
    unlike = (start < end)[order[:, 0]] == (start < end)[order[:, 1]]
    # Every face is there twice, as it is and reversed; two such nodes are joined where they fit together.
    rows = np.concatenate([first, first + count])
    columns = np.concatenate([second + count * unlike, second + count * ~unlike])
    graph = coo_array((np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(2 * count, 2 * count))
    label = connected_components(graph, directed=False)[1]
    as_given, reversed_ = label[:count], label[count:]
    kept = np.bincount(as_given, minlength=2 * count)
    fewer = kept[as_given] < kept[reversed_]
    flips: BoolArray = fewer | ((kept[as_given] == kept[reversed_]) & (as_given > reversed_))
    return flips


def _rims(faces: IntArray) -> Iterator[tuple[int, list[int]]]:
    """Edges of rims, as numbers 3 face + corner: of each rim its first edge and all, in order along the rim.

    An edge that is passed twice more in one direction than in the other belongs to two rims.
    """
    start, end, edge, _ = _edges(faces)
    excess = _excess(faces)
    order = np.argsort(edge, kind="stable")
    order = order[excess[order] > 0]
    # Of the edges in the direction that prevails, as many as it prevails by.
    rank = np.arange(len(order)) - np.searchsorted(edge[order], edge[order])
    chosen = order[rank < excess[order]]
    if not len(chosen):
        return
    if len(chosen) > MOST_TRACED:
        yield from _rim_of_each_component(chosen, faces)
        return
    onward: dict[int, list[int]] = {}
    for number in chosen.tolist():
        onward.setdefault(int(start[number]), []).append(number)
    while onward:
        path: list[int] = []
        visited = {next(iter(onward)): 0}
        corner = next(iter(onward))
        while corner in onward:
            number = onward[corner].pop()
            if not onward[corner]:
                del onward[corner]
            path.append(number)
            corner = int(end[number])
            if corner in visited:  # a rim that touches itself is cut into loops
                loop = path[visited[corner] :]
                yield loop[0], loop
                path = path[: visited[corner]]
                visited = {int(start[k]): at for at, k in enumerate(path)}
            visited[corner] = len(path)


def _rim_of_each_component(chosen: IntArray, faces: IntArray) -> Iterator[tuple[int, list[int]]]:
    """All edges of a part's rims as one, for a mesh of too many rims."""
    vertices = int(faces.max()) + 1
    nodes = faces.ravel()
    owner = np.repeat(np.arange(len(faces)), 3)
    size = vertices + len(faces)
    graph = coo_array((np.ones(len(nodes), dtype=np.int8), (nodes, vertices + owner)), shape=(size, size))
    label = connected_components(graph, directed=False)[1][vertices + chosen // 3]
    order = np.argsort(label, kind="stable")
    for rim in np.split(chosen[order], np.flatnonzero(np.diff(label[order])) + 1):
        yield int(rim[0]), rim.tolist()


def _hole(rim: list[int], corners: FloatArray) -> Hole:
    """The hole inside a rim, numbers of edges."""
    face, corner = np.divmod(np.array(rim), 3)
    begin, stop = corners[face, corner], corners[face, (corner + 1) % 3]
    middle = np.broadcast_to(begin.mean(axis=0), begin.shape)
    cap = np.stack([stop, begin, middle], axis=1)
    if len(rim) == 3:
        cap = stop[None, ::-1].copy()
    across, beside = _normals(cap).sum(axis=0), _normals(corners[face])
    lengths = np.linalg.norm(across) * np.linalg.norm(beside, axis=1)
    smooth = bool((beside @ across >= SMOOTH_COSINE * lengths).any() and lengths.any())
    return Hole(cap, np.array([begin.min(axis=0), begin.max(axis=0)]), smooth)


def _kind(component: FloatArray, holes: list[Hole]) -> ComponentKind:
    """Returns the kind of a part (f, 3, 3) with these holes."""
    if not holes:
        return ComponentKind.CLOSED
    caps = [hole.area for hole in holes]
    whole = float(_areas(component).sum()) + sum(caps)
    if sum(caps) > LARGEST_FRACTION * whole:
        return ComponentKind.OPEN
    for hole, area in zip(holes, caps, strict=True):
        few = len(hole.cap) <= MOST_RIM_EDGES and hole.smooth
        if area > TINY_FRACTION * whole and not few:
            return ComponentKind.OPEN
    return ComponentKind.HOLED


def _opposed_components(components: list[_SurfaceComponent]) -> IntArray:
    """1 for each part that crosses or touches another that is wound the other way."""
    opposed = np.zeros(len(components), dtype=np.int64)
    triangles = [component.triangles for component in components]
    near = [(k, j) for k, j in components_near_each_other(triangles) if components[k].sign * components[j].sign < 0]
    if near:
        for (k, j), meet in zip(near, components_that_meet(triangles, near).tolist(), strict=True):
            opposed[[k, j]] |= meet
    return opposed


def _normals(triangles: FloatArray) -> FloatArray:
    """Normals (f, 3), as long as twice the area."""
    normals: FloatArray = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    return normals


def _areas(triangles: FloatArray) -> FloatArray:
    """Square metres of each triangle (f, 3, 3)."""
    areas: FloatArray = np.linalg.norm(_normals(triangles), axis=1) / 2.0
    return areas


def _stacked_arrays(arrays: list[FloatArray], empty: tuple[int, ...]) -> FloatArray:
    """Arrays put after each other; of none an empty one."""
    return np.ascontiguousarray(np.concatenate([np.zeros(empty), *arrays]))


def _starts(counts: list[int]) -> IntArray:
    """Start of each group of entries, then the end of the last."""
    return np.concatenate([[0], np.cumsum(counts, dtype=np.int64)]).astype(np.int64)
