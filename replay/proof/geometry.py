"""What the verifier decides by itself: bodies with their boxes, faces that meet, points inside; exactly where asked."""

from __future__ import annotations

from fractions import Fraction
from typing import Final

import numpy as np
from numpy.typing import NDArray

from replay.proof.claims import Flags, Floats, Rows, WrongRecord

SKEW: Final = 2.0**-44
LARGEST: Final = 1e70
"""Metres; squares and determinants stay finite."""
SURE: Final = 2.0**-46
"""A determinant of differences errs by less than 48 u of the product of its vectors' largest components, u = 2^-53."""
SMALLEST: Final = 1e-250
"""A determinant below this may have lost terms to underflow."""


def skew(matrices: Floats) -> Floats:
    """How far columns of matrices (n, 3, 3) are off orthonormal, (n,)."""
    return np.abs(np.swapaxes(matrices, 1, 2) @ matrices - np.eye(3)).max(axis=(1, 2), initial=0.0)


class CheckedBody:
    """One mesh with its claimed tree; ``WrongRecord`` where that does not hold every face once.

    Boxes of the n nodes: ``centre`` (n, 3), ``axes`` (n, 3, 3) by rows, ``half`` (n, 3), ``radius`` (n,). Of the
    surface: ``closed``, every edge has an even number of faces; ``doubled``, two faces have the same corners;
    ``parts``, outermost corners (e, 3) of each connected part.
    """

    def __init__(self, name: str, vertices: Floats, faces: Rows, order: Rows, nodes: Rows, axes: Floats) -> None:
        self.name, self.order, self.nodes = name, order.tolist(), nodes.tolist()
        vertices = np.asarray(vertices, dtype=np.float64)
        self.triangles: Floats = vertices[faces]
        self.reach = float(np.sqrt((self.triangles**2).sum(axis=2)).max())
        if not np.array_equal(np.sort(order), np.arange(len(faces))):
            raise WrongRecord(f"body {name}: the tree does not hold every face once")
        self._check_nodes(nodes.astype(np.int64))
        self._look_at_surface(vertices, faces)
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            self.axes = _orthonormal(axes.astype(np.float64))
            off = skew(np.swapaxes(self.axes, 1, 2)).max(initial=0.0)
        if len(axes) != len(nodes) or not off <= SKEW or not self.reach < LARGEST:
            raise WrongRecord(f"body {name}: a box has no axes")
        corners = self.triangles[order]
        self.centre, self.half = np.empty((len(nodes), 3)), np.empty((len(nodes), 3))
        for k, (first, count, _) in enumerate(self.nodes):
            along = corners[first : first + count].reshape(-1, 3) @ self.axes[k].T
            low, high = along.min(axis=0), along.max(axis=0)
            self.centre[k], self.half[k] = (0.5 * (low + high)) @ self.axes[k], 0.5 * (high - low)
        self.radius = np.sqrt((self.half**2).sum(axis=1))

    def _check_nodes(self, nodes: Rows) -> None:
        if not len(nodes) or nodes[0, :2].tolist() != [0, len(self.order)]:
            raise WrongRecord(f"body {self.name}: the root does not hold every face")
        inner = np.flatnonzero(nodes[:, 2] >= 0)
        if (nodes[inner, 2] + 1 >= len(nodes)).any() or (nodes[:, 1] < 1).any() or (nodes[:, 0] < 0).any():
            raise WrongRecord(f"body {self.name}: a node has no faces, or children that there are not")
        left, right = nodes[nodes[inner, 2]], nodes[nodes[inner, 2] + 1]
        parted = (left[:, 0] == nodes[inner, 0]) & (right[:, 0] == left[:, 0] + left[:, 1])
        parted &= left[:, 1] + right[:, 1] == nodes[inner, 1]
        if not parted.all() or (nodes[:, :2].sum(axis=1) > len(self.order)).any():
            raise WrongRecord(f"body {self.name}: children do not hold the faces of their node")

    def _look_at_surface(self, vertices: Floats, faces: Rows) -> None:
        """Find whether it is closed, whether faces are doubled, its parts; corners are one where bitwise equal."""
        _, same = np.unique(vertices + 0.0, axis=0, return_inverse=True)
        merged = same.reshape(-1)[faces].astype(np.int64)
        proper = np.sort(merged, axis=1)
        proper = proper[(proper[:, 0] != proper[:, 1]) & (proper[:, 1] != proper[:, 2])]
        edges = proper[:, [[0, 1], [1, 2], [0, 2]]].reshape(-1, 2)
        self.closed = len(edges) > 0 and not (np.unique(edges, axis=0, return_counts=True)[1] % 2).any()
        self.doubled = len(np.unique(proper, axis=0)) < len(proper)
        label, before = np.arange(len(vertices)), np.arange(0)
        while not np.array_equal(before, label):
            before = label.copy()
            np.minimum.at(label, merged.ravel(), np.repeat(label[merged].min(axis=1), 3))
            label = label[label]
        part = label[merged[:, 0]]
        corners = [self.triangles[part == one].reshape(-1, 3) for one in np.unique(part)]
        self.parts = [some[np.unique([some.argmin(axis=0), some.argmax(axis=0)])] for some in corners]


def _orthonormal(rows: Floats) -> Floats:
    """Three axes (n, 3, 3) from about the first two, (n, 6)."""
    first, second = rows[:, :3], rows[:, 3:]
    first = first / np.sqrt((first**2).sum(axis=1, keepdims=True))
    second = second - (second * first).sum(axis=1, keepdims=True) * first
    second = second / np.sqrt((second**2).sum(axis=1, keepdims=True))
    return np.stack([first, second, np.cross(first, second)], axis=1)


def placed(points: Floats, rotation: Floats, translation: Floats) -> Floats:
    """World points (..., 3): ``x' = ((r00 x + r01 y) + r02 z) + t0`` in float64, each step rounded once."""
    x, y, z = points[..., 0, None], points[..., 1, None], points[..., 2, None]
    column = [rotation[..., :, k] for k in range(3)]
    return ((column[0] * x + column[1] * y) + column[2] * z) + translation


def meeting(first: Floats, second: Floats) -> tuple[Flags, int]:
    """Whether n pairs of closed triangles, (n, 3, 3) each, meet (touching counts); and how many integers decided."""
    meet = ((first.min(1) <= second.max(1)) & (second.min(1) <= first.max(1))).all(axis=1)
    rows = np.flatnonzero(meet)
    answer = _filtered(first[rows], second[rows])
    unsure = rows[answer < 0]
    meet[rows] = answer == 1
    meet[unsure] = [triangles_meet(first[row], second[row]) for row in unsure]
    return meet, len(unsure)


def _filtered(a: Floats, b: Floats) -> NDArray[np.int64]:
    """1 or 0 where floats are certain, else -1."""
    edges_a, edges_b = np.roll(a, -1, axis=1) - a, np.roll(b, -1, axis=1) - b
    between = b[:, None] - a[:, :, None]
    of_a = _signs(-between[:, :, 0], edges_b[:, None, 0], edges_b[:, None, 1])
    of_b = _signs(between[:, 0], edges_a[:, None, 0], edges_a[:, None, 1])
    turns = _signs(between, edges_a[:, :, None], edges_b[:, None])
    crossing = ((of_a * np.roll(of_a, -1, axis=1) < 0) & (np.abs(turns.sum(axis=2)) == 3)).any(axis=1)
    crossing |= ((of_b * np.roll(of_b, -1, axis=1) < 0) & (np.abs(turns.sum(axis=1)) == 3)).any(axis=1)
    one_side = (np.abs(of_a.sum(axis=1)) == 3) | (np.abs(of_b.sum(axis=1)) == 3)
    known = (of_a != 0).all(axis=1) & (of_b != 0).all(axis=1) & (turns != 0).all(axis=(1, 2))
    return np.where(crossing, 1, np.where(known | one_side, 0, -1))


def _signs(w: Floats, e: Floats, f: Floats) -> NDArray[np.int64]:
    """Certain signs of ``w . (e x f)``, 0 where it is not certain; vectors (..., 3)."""
    with np.errstate(over="ignore", invalid="ignore"):
        value = (w * np.cross(e, f)).sum(axis=-1)
        w, e, f = (np.abs(one).max(axis=-1) for one in (w, e, f))
        sure = (np.abs(value) > SURE * w * e * f + SMALLEST) & (np.maximum(w, np.maximum(e, f)) < LARGEST)
    return np.where(sure, np.sign(value), 0.0).astype(np.int64)


def triangles_meet(first: Floats, second: Floats) -> bool:
    """Whether two closed triangles (3, 3), points and segments among them, meet; in integers.

    They do not exactly if some direction separates them strictly, and one of finitely many then does: normals of faces
    and edges of their Minkowski difference, which may be flat, a segment or a point.
    """
    numbers = [float(value).as_integer_ratio() for value in (*first.ravel(), *second.ravel())]
    common = max(below for _, below in numbers)
    # Of type object: Python's integers, which do not overflow.
    points = np.array([above * (common // below) for above, below in numbers], dtype=object).reshape(2, 3, 3)
    edges = (np.roll(points, -1, axis=1) - points).reshape(6, 3)
    between = points[1, 0] - points[0, 0]
    crossed = np.cross(edges[:3, None], edges[None, 3:]).reshape(-1, 3)
    normals = np.concatenate([np.cross(edges[[0, 3]], edges[[1, 4]]), crossed])
    beside = between * (edges**2).sum(axis=1)[:, None] - edges * (edges @ between)[:, None]
    within = np.cross(normals[:, None], edges[None]).reshape(-1, 3)
    ways = np.concatenate([normals, between[None], edges, beside, within])
    one, other = (ways @ corners.T for corners in points)
    return not ((one.max(axis=1) < other.min(axis=1)) | (other.max(axis=1) < one.min(axis=1))).any()


def inside(point: Floats, triangles: Floats) -> bool:
    """Whether a point (3,) off a closed surface (n, 3, 3) is inside: the parity of a ray along +y, in fractions.

    Seen along y, an edge counts that crosses the line z = p.z beyond p.x; an end on that line counts as below: so the
    ray is moved off every edge and corner, for all triangles alike.
    """
    low, high = triangles.min(axis=1), triangles.max(axis=1)
    beside = (low[:, [0, 2]] > point[[0, 2]]).any(axis=1) | (high < point).any(axis=1)
    exactly = np.vectorize(Fraction, otypes=[object])
    a, p = exactly(triangles[~beside]), exactly(point)
    edge, way, above = np.roll(a, -1, axis=1) - a, p - a, a[..., 2] > p[2]
    turn = edge[..., 2] * way[..., 0] - edge[..., 0] * way[..., 2]
    passes = (above != np.roll(above, -1, axis=1)) & np.where(above, turn > 0, turn < 0)
    met = passes.sum(axis=1) % 2 == 1
    normal = np.cross(edge[met, 0], -edge[met, 2])
    return bool(((way[met, 0] * normal).sum(axis=1) * normal[:, 1] < 0).sum() % 2)
