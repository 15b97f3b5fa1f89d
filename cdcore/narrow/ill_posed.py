"""Finds pair-frames that are within tau of the other answer.

Floats with error bounds dismiss what is clearly deeper or clearly further; the rest is measured exactly. A contact
needs a witness too: cubes that stand in each other with faces in common planes are deep in contact, though each of
their face pairs only touches.
"""

from collections.abc import Iterable
from functools import cache

import numpy as np
from numpy.typing import NDArray

from cdcore.narrow.brute_force import near_faces
from cdcore.narrow.bvh.box_tree import box_trees_of
from cdcore.narrow.continuous.clearance import ClearanceSearch
from cdcore.narrow.margins import can_be_separated, overlap_bounds, shell_vectors, triangle_margins
from cdcore.numerics import BoolArray, FloatArray
from cdcore.poses import place_points
from cdcore.protocol import Body
from cdcore.tolerances import EPS
from cdcore.triangles.decide import triangles_intersect

SAMPLE = 8
"""Face pairs of a contact to test first: one deeper than tau decides, and most contacts are deeper everywhere."""
POSE_ULPS = 256.0
"""Rounding of a relative pose beside the reference vertices, in eps of the bodies' coordinates in the world."""


class MarginStage:
    """Says whether surfaces in contact meet by at most ``tau`` metres, and surfaces apart are no further apart."""

    def __init__(self, bodies: Iterable[Body], tau: float) -> None:
        meshes = [body.mesh for body in bodies]
        self._triangles = [mesh.triangles for mesh in meshes]
        self._faces = [mesh.faces for mesh in meshes]
        self._shell = cache(lambda body: shell_vectors(self._triangles[body], self._faces[body]))
        self._tree = cache(lambda body: box_trees_of([meshes[body]])[0])
        self._tau = tau

    def shallow(
        self, pair: tuple[int, int], faces: NDArray[np.integer], rotations: FloatArray, translations: FloatArray
    ) -> bool:
        """Whether the deepest of all face pairs that meet, ``faces`` (k, 2), k > 0, is no deeper than tau.

        ``rotations`` (2, 3, 3) and ``translations`` (2, 3) are the poses of the two bodies of the pair.
        """
        chosen = np.unique(np.linspace(0, len(faces) - 1, SAMPLE).astype(np.int64))
        for rows in (chosen, np.arange(len(faces))) if len(chosen) < len(faces) else (chosen,):
            corners = [self._triangles[body][faces[rows, side]] for side, body in enumerate(pair)]
            placed = np.stack(
                [place_points(*pose) for pose in zip(corners, rotations, translations, strict=True)], axis=1
            )
            lower, upper, _ = overlap_bounds(placed)
            if (lower > self._tau).any():
                return False
        return all(triangle_margins(placed[[row]])[1][0] <= self._tau for row in np.flatnonzero(upper > self._tau))

    def loose(
        self, pair: tuple[int, int], faces: NDArray[np.integer], rotations: FloatArray, translations: FloatArray
    ) -> bool:
        """Whether some move of the surfaces by tau ends the contact; parameters as for ``shallow``."""
        placed = [self._placed_triangles(body, rotations[side], translations[side]) for side, body in enumerate(pair)]
        shells = [self._shell(body) @ rotations[side].T for side, body in enumerate(pair)]
        return can_be_separated(placed[0], placed[1], shells[0], shells[1], faces, self._tau)

    def near(self, pair: tuple[int, int], rotations: FloatArray, translations: FloatArray) -> BoolArray:
        """Whether two surfaces that do not meet are at most tau apart, at each of K poses (K, 2, 3, 3), (K, 2, 3)."""
        poses = np.concatenate([rotations.reshape(-1, 18), translations.reshape(-1, 6)], axis=1)
        _, same, which = np.unique(poses, axis=0, return_index=True, return_inverse=True)
        rotations, translations = rotations[same], translations[same]
        trees = [self._tree(body) for body in pair]
        size = np.abs(translations).sum(axis=(1, 2)) + trees[0].reach + trees[1].reach
        pose_a, pose_b = ((rotations[:, side], translations[:, side]) for side in (0, 1))
        answer = ~ClearanceSearch(*trees).separated(pose_a, pose_b, self._tau + POSE_ULPS * EPS * size)
        for row in np.flatnonzero(answer):
            first, second = (
                self._placed_triangles(body, rotations[row, side], translations[row, side])
                for side, body in enumerate(pair)
            )
            answer[row] = self._clear_by_tau_at_most(first, second)
        return answer[which]

    def _clear_by_tau_at_most(self, first: FloatArray, second: FloatArray) -> bool:
        close = near_faces(first, second, self._tau)
        pairs = np.stack([first[close[:, 0]], second[close[:, 1]]], axis=1)
        if triangles_intersect(pairs).any():
            return False
        gaps = overlap_bounds(pairs)[2]
        nearest = np.argsort(gaps, kind="stable")[: int((gaps <= self._tau).sum())]
        return any(triangle_margins(pairs[[row]])[1][0] <= self._tau for row in nearest)

    def _placed_triangles(self, body: int, rotation: FloatArray, translation: FloatArray) -> FloatArray:
        return place_points(self._triangles[body], rotation, translation)
