"""Which pair-frames are within tau of the other answer: asked of thousands of them, decided as the integers decide.

Floats with error bounds dismiss what is clearly deeper or clearly further; the rest is measured exactly. A contact
needs a witness too: the face pairs of cubes that stand in each other with faces in common planes only touch, and the
cubes are deep in contact all the same.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from cdcore.narrow.margin_kernels import POSE_ULPS, certainly_apart, overlap_bounds
from cdcore.narrow.margins import near_faces, pair_frame_margin, triangle_margins
from cdcore.narrow.predicates import triangles_intersect
from cdcore.narrow.spacetime.box_tree import BoxTree, build_box_tree
from cdcore.numerics import EPS, BoolArray, FloatArray, IntArray, place_points
from cdcore.protocol import Body

SAMPLE = 8
"""Face pairs of a contact looked at first: one that is deeper settles it, and most contacts are deeper everywhere."""


WITNESS = 2.0
"""Surfaces are moved by so many tau in search of a way out: a leaning facet needs more than the depth of its corner."""


class MarginStage:
    """Says whether surfaces in contact meet by at most tau, and whether surfaces apart are at most tau apart.

    Parameters
    ----------
    bodies : N bodies.
    tau : metres.
    """

    def __init__(self, bodies: Iterable[Body], tau: float) -> None:
        meshes = [body.mesh for body in bodies]
        self._triangles = [mesh.triangles for mesh in meshes]
        self._faces = [mesh.faces for mesh in meshes]
        self._normals: dict[int, FloatArray] = {}
        self._trees: dict[int, BoxTree] = {}
        self._tau = tau

    def shallow(
        self, pair: tuple[int, int], faces: NDArray[np.integer], rotations: FloatArray, translations: FloatArray
    ) -> bool:
        """Whether the deepest of the face pairs that meet is no deeper than tau.

        Parameters
        ----------
        pair : the two bodies.
        faces : (k, 2), all face pairs that meet, at least one.
        rotations, translations : (2, 3, 3) and (2, 3), the poses of the two.
        """
        chosen = np.unique(np.linspace(0, len(faces) - 1, SAMPLE).astype(np.int64))
        for rows in (chosen, np.arange(len(faces))) if len(chosen) < len(faces) else (chosen,):
            placed = np.stack(
                [
                    place_points(self._triangles[body][faces[rows, side]], rotations[side], translations[side])
                    for side, body in enumerate(pair)
                ],
                axis=1,
            )
            low, high, _ = _bounds(placed)
            if (low > self._tau).any():
                return False
        return all(triangle_margins(placed[[row]])[1][0] <= self._tau for row in np.flatnonzero(high > self._tau))

    def loose(
        self, pair: tuple[int, int], faces: NDArray[np.integer], rotations: FloatArray, translations: FloatArray
    ) -> bool:
        """Whether some move of the surfaces by 2 tau ends the contact: inward, outward, or along the normals there.

        Parameters as for ``shallow``.
        """
        first, second = (self._placed(body, rotations[side], translations[side]) for side, body in enumerate(pair))
        step = WITNESS * self._tau
        close = near_faces(first, second, 4 * step)
        a, b = first[close[:, 0]], second[close[:, 1]]
        n, m = (self._vertex_normals(body) @ rotations[side].T for side, body in enumerate(pair))
        along = (n[faces[:, 0]].mean(axis=(0, 1)), m[faces[:, 1]].mean(axis=(0, 1)))
        return any(
            not triangles_intersect(np.stack([a + step * x, b + step * y], axis=1)).any()
            for x, y in _moves(n[close[:, 0]], m[close[:, 1]], along)
        )

    def near(self, pair: tuple[int, int], rotations: FloatArray, translations: FloatArray) -> BoolArray:
        """Whether two surfaces that do not meet are at most tau apart, at each of K poses.

        Parameters
        ----------
        rotations, translations : (K, 2, 3, 3) and (K, 2, 3), the poses of the two.
        """
        same, which = _distinct(rotations, translations)
        rotations, translations = rotations[same], translations[same]
        answer = ~self._certainly_apart(pair, rotations, translations)
        for row in np.flatnonzero(answer):
            first, second = (
                self._placed(body, rotations[row, side], translations[row, side]) for side, body in enumerate(pair)
            )
            margin = pair_frame_margin(first, second, reach=self._tau)
            answer[row] = not margin.contact and margin.distance <= self._tau
        return answer[which]

    def _certainly_apart(self, pair: tuple[int, int], rotations: FloatArray, translations: FloatArray) -> BoolArray:
        a, b = (self._tree(body) for body in pair)
        back = rotations[:, 1].transpose(0, 2, 1)
        turns = np.ascontiguousarray(back @ rotations[:, 0])
        moves = (back @ (translations[:, 0] - translations[:, 1])[..., None])[..., 0]
        size = np.abs(translations).sum(axis=(1, 2)) + a.reach + b.reach
        apart = np.zeros(len(turns), dtype=np.bool_)
        certainly_apart(
            a.boxes, a.links, a.leaves, a.placed, b.boxes, b.links, b.leaves, b.placed,
            turns, np.ascontiguousarray(moves), self._tau + POSE_ULPS * EPS * size, apart,
        )  # fmt: skip
        return apart

    def _placed(self, body: int, rotation: FloatArray, translation: FloatArray) -> FloatArray:
        return place_points(self._triangles[body].reshape(-1, 3), rotation, translation).reshape(-1, 3, 3)

    def _vertex_normals(self, body: int) -> FloatArray:
        """Unit normals at the corners of each face, (f, 3, 3), body frame; zero where faces have none."""
        if body not in self._normals:
            triangles, faces = self._triangles[body], self._faces[body]
            of_face = _unit(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]))
            sums = np.zeros((int(faces.max()) + 1, 3))
            np.add.at(sums, faces.ravel(), np.repeat(of_face, 3, axis=0))
            self._normals[body] = _unit(sums)[faces]
        return self._normals[body]

    def _tree(self, body: int) -> BoxTree:
        if body not in self._trees:
            self._trees[body] = build_box_tree(self._triangles[body])
        return self._trees[body]


def _moves(
    n: FloatArray, m: FloatArray, along: tuple[FloatArray, FloatArray]
) -> Iterator[tuple[FloatArray | float, FloatArray | float]]:
    """How to move the one and the other, per unit: along their normals, or as a whole along the mean of those."""
    yield from ((-n, -m), (-n, 0.0), (0.0, -m), (n, 0.0), (0.0, m))
    for way in along:
        unit = _unit(way)
        yield from ((unit, 0.0), (-unit, 0.0))


def _unit(vectors: FloatArray) -> FloatArray:
    """Vectors (..., 3) of length 1; those without length stay zero."""
    length = np.sqrt((vectors * vectors).sum(axis=-1, keepdims=True))
    unit: FloatArray = vectors / np.where(length > 0, length, 1.0)
    return unit


def _bounds(pairs: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Bounds of the least overlap of triangle pairs (n, 2, 3, 3), and distances they certainly keep."""
    low, high, apart = np.empty(len(pairs)), np.empty(len(pairs)), np.empty(len(pairs))
    overlap_bounds(np.ascontiguousarray(pairs).reshape(-1, 6, 3), low, high, apart)
    return low, high, apart


def _distinct(rotations: FloatArray, translations: FloatArray) -> tuple[IntArray, IntArray]:
    """One row of each run of equal poses, and which of these a row is."""
    new = np.ones(len(rotations), dtype=np.bool_)
    new[1:] = (rotations[1:] != rotations[:-1]).any(axis=(1, 2, 3))
    new[1:] |= (translations[1:] != translations[:-1]).any(axis=(1, 2))
    return np.flatnonzero(new), np.cumsum(new) - 1
