"""A body as the verifier sees it: its faces, the boxes of the tree that the proof claims, its connected parts."""

from __future__ import annotations

from functools import cached_property
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from replay.proof.claims import WrongRecord
from replay.proof.exact import Floats, placed

PAD: Final = 2.0**-38
"""What boxes must keep, as a share of both bodies' reach and distance from the origin together. Rounding of placed
corners, of boxes, of their axes and of the tests is below 2^-44 of that; rotations and axes of boxes that are off
orthonormal by ``SKEW`` add 24 times as much: together less than 2^-39."""
SKEW: Final = 2.0**-44
LARGEST: Final = 1e70
"""Metres; squares stay finite."""


class Poses(NamedTuple):
    """Of N bodies in T frames: ``valid`` (T, N), ``rotation`` (T, N, 3, 3), ``translation`` (T, N, 3)."""

    valid: NDArray[np.bool_]
    rotation: Floats
    translation: Floats

    def part(self, first: int, stop: int) -> Poses:
        """A copy of some frames."""
        rows = slice(first, stop)
        return Poses(self.valid[rows].copy(), self.rotation[rows].copy(), self.translation[rows].copy())

    def check(self) -> None:
        """Refuse what is no rotation: a box test would not hold there."""
        turn, place = self.rotation[self.valid], self.translation[self.valid]
        with np.errstate(invalid="ignore", over="ignore"):
            off = np.abs(np.swapaxes(turn, 1, 2) @ turn - np.eye(3)).max(axis=(1, 2), initial=0.0)
            wrong = ~((off <= SKEW) & (np.abs(place).max(axis=1, initial=0.0) <= LARGEST))
        if wrong.any():
            frame, body = (int(one[wrong][0]) for one in np.nonzero(self.valid))
            raise WrongRecord(f"frame {frame}, body {body}: the pose is no rotation and translation")


class CheckedBody:
    """One mesh with its claimed tree; ``WrongRecord`` where that does not hold every face once.

    Boxes of the n nodes: ``centre`` (n, 3), ``axes`` (n, 3, 3) by rows, ``half`` (n, 3), ``radius`` (n,).
    """

    def __init__(
        self, name: str, vertices: Floats, faces: NDArray[Any], order: NDArray[Any], nodes: NDArray[Any], axes: Floats
    ) -> None:
        self.name, self.order, self.nodes = name, order, nodes.astype(np.int64)
        self._vertices, self._faces = np.asarray(vertices, dtype=np.float64), np.asarray(faces)
        self.triangles: Floats = self._vertices[self._faces]
        self.reach = float(np.sqrt((self.triangles**2).sum(axis=2)).max())
        if not np.array_equal(np.sort(order), np.arange(len(faces))):
            raise WrongRecord(f"body {name}: the tree does not hold every face once")
        self._check_nodes()
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            self.axes = _orthonormal(axes.astype(np.float64))
            off = np.abs(self.axes @ np.swapaxes(self.axes, 1, 2) - np.eye(3)).max(initial=0.0)
        if len(axes) != len(nodes) or not off <= SKEW or not self.reach < LARGEST:
            raise WrongRecord(f"body {name}: a box has no axes")
        self._fit()

    def _check_nodes(self) -> None:
        nodes = self.nodes
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

    def _fit(self) -> None:
        corners = self.triangles[self.order]
        self.centre, self.half = np.empty((len(self.nodes), 3)), np.empty((len(self.nodes), 3))
        for k, (first, faces, _) in enumerate(self.nodes.tolist()):
            along = corners[first : first + faces].reshape(-1, 3) @ self.axes[k].T
            low, high = along.min(axis=0), along.max(axis=0)
            self.centre[k], self.half[k] = (0.5 * (low + high)) @ self.axes[k], 0.5 * (high - low)
        self.radius = np.sqrt((self.half**2).sum(axis=1))

    @cached_property
    def _merged(self) -> NDArray[np.int64]:
        """Faces over corners that are one where bitwise equal."""
        _, same = np.unique(self._vertices + 0.0, axis=0, return_inverse=True)
        return same.reshape(-1)[self._faces].astype(np.int64)

    @cached_property
    def _proper(self) -> NDArray[np.int64]:
        faces = np.sort(self._merged, axis=1)
        return faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2])]

    @cached_property
    def closed(self) -> bool:
        """Whether every edge has an even number of faces."""
        edges = self._proper[:, [[0, 1], [1, 2], [0, 2]]].reshape(-1, 2)
        _, counts = np.unique(edges, axis=0, return_counts=True)
        return bool(len(edges) > 0 and (counts % 2 == 0).all())

    @cached_property
    def doubled(self) -> bool:
        """Whether two faces have the same corners."""
        return len(np.unique(self._proper, axis=0)) < len(self._proper)

    @cached_property
    def parts(self) -> list[Floats]:
        """Outermost corners (e, 3) of each connected part."""
        label = np.arange(int(self._merged.max()) + 1)
        while True:
            before = label.copy()
            np.minimum.at(label, self._merged.ravel(), np.repeat(label[self._merged].min(axis=1), 3))
            label = label[label]
            if np.array_equal(before, label):
                break
        part = label[self._merged[:, 0]]
        found = [self.triangles[part == one].reshape(-1, 3) for one in np.unique(part)]
        return [some[np.unique([some.argmin(axis=0), some.argmax(axis=0)])] for some in found]

    def world(self, poses: Poses, column: int, frame: int) -> Floats:
        """All faces in one frame, (f, 3, 3)."""
        return placed(self.triangles, poses.rotation[frame, column], poses.translation[frame, column])


def _orthonormal(rows: Floats) -> Floats:
    """Three axes (n, 3, 3) from about the first two, (n, 6)."""
    first, second = rows[:, :3], rows[:, 3:]
    first = first / np.sqrt((first**2).sum(axis=1, keepdims=True))
    second = second - (second * first).sum(axis=1, keepdims=True) * first
    second = second / np.sqrt((second**2).sum(axis=1, keepdims=True))
    return np.stack([first, second, np.cross(first, second)], axis=1)


def matrices(quaternion: Floats) -> Floats:
    """Rotations (..., 3, 3) of quaternions (..., 4) xyzw, divided by their norm first, each step rounded once."""
    x, y, z, w = np.moveaxis(quaternion, -1, 0)
    norm = np.sqrt(((x * x + y * y) + z * z) + w * w)
    x, y, z, w = x / norm, y / norm, z / norm, w / norm
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
