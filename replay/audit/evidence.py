"""The geometry behind misses: faces, curve, point and normal, asked for only in the frames that missed something."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cdcore import Detection, Motion
from replay.assembly import Assembly

FloatArray = NDArray[np.float64]
Vector = tuple[float, float, float]

LOOKS_PER_MISS: Final = 128
"""A longer miss is looked at in this many frames, evenly spread with both ends: at 90 Hz all frames of 1.4 s."""

LOOKS_IN_ALL: Final = 20_000
"""Pair-frames looked at in all, some seconds of work; with more misses each is looked at once, in its middle."""


@dataclass(frozen=True)
class Cut:
    """How two surfaces meet in one frame.

    Parameters
    ----------
    frame : the frame.
    point : the place on the curve of intersection nearest to its middle, world metres.
    normal : unit vector from the first body to the second, across the curve.
    face_pairs : how many pairs of faces meet.
    length : length of the curve, metres.
    """

    frame: int
    point: Vector
    normal: Vector
    face_pairs: int
    length: float


class Evidence:
    """Answers where in a stretch of frames two bodies cut each other longest.

    Parameters
    ----------
    assembly : bodies, motion, pairs.
    faces : a detection of the whole assembly that holds face pairs, or what asks a detector for them on a motion.
    places : (pair, first, last) of every stretch that will be asked for.
    """

    def __init__(
        self,
        assembly: Assembly,
        faces: Detection | Callable[[Motion], Detection],
        places: Sequence[tuple[int, int, int]],
    ) -> None:
        self._assembly = assembly
        self._middles = [_middle(body.mesh.referenced_vertices) for body in assembly.bodies]
        most = min(LOOKS_PER_MISS, max(1, LOOKS_IN_ALL // max(1, len(places))))
        self._frames = {place: _looks(place[1], place[2], most) for place in places}
        asked = np.unique(np.concatenate([[], *self._frames.values()]).astype(np.int64))
        self._row = {frame: row for row, frame in enumerate(asked.tolist())}
        self._detection: Detection | None = None
        if isinstance(faces, Detection):
            self._detection, self._row = faces, {frame: frame for frame in self._row}
        elif len(asked):
            self._detection = faces(assembly.motion.take(asked))

    def deepest(self, pair: int, first: int, last: int) -> Cut:
        """The look with the longest curve; of equals the one with most faces, then the earliest."""
        cuts = [self._cut(pair, frame) for frame in self._frames[pair, first, last].tolist()]
        return max(cuts, key=lambda cut: (cut.length, cut.face_pairs, -cut.frame))

    def _cut(self, pair: int, frame: int) -> Cut:
        assert self._detection is not None
        row = self._row[frame]
        faces = self._detection.faces(row, pair)
        segments = self._detection.section(row, pair) if len(faces) else np.zeros((0, 2, 3))
        way = segments[:, 1] - segments[:, 0]
        length = np.sqrt((way * way).sum(axis=-1))
        toward = self._toward(pair, frame)
        if not len(segments):
            return Cut(frame, _vector(self._between(pair, frame)), _vector(toward), len(faces), 0.0)
        return Cut(
            frame,
            _vector(_point(segments, length)),
            _vector(_normal(segments, toward)),
            len(faces),
            float(length.sum()),
        )

    def _centres(self, pair: int, frame: int) -> tuple[FloatArray, FloatArray]:
        motion = self._assembly.motion
        a, b = (
            motion.rotations[frame, body] @ self._middles[body] + motion.translations[frame, body]
            for body in self._assembly.pairs[pair].tolist()
        )
        return a, b

    def _toward(self, pair: int, frame: int) -> FloatArray:
        """Unit vector from the middle of the first body to that of the second; up where they coincide."""
        a, b = self._centres(pair, frame)
        way = b - a
        length = float(np.sqrt((way * way).sum()))
        return way / length if length > 0.0 else np.array([0.0, 1.0, 0.0])

    def _between(self, pair: int, frame: int) -> FloatArray:
        a, b = self._centres(pair, frame)
        return (a + b) / 2


def _middle(vertices: FloatArray) -> FloatArray:
    middle: FloatArray = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    return middle


def _looks(first: int, last: int, most: int) -> NDArray[np.int64]:
    if last - first < most:
        return np.arange(first, last + 1)
    if most == 1:
        return np.array([(first + last) // 2])
    return np.unique(np.round(np.linspace(first, last, most)).astype(np.int64))


def _point(segments: FloatArray, length: FloatArray) -> FloatArray:
    """The midpoint of a segment nearest to the middle of the curve: on the surfaces even where the curve is a ring."""
    middles = segments.mean(axis=1)
    weight = length if length.sum() > 0.0 else np.ones(len(length))
    middle = (middles * weight[:, None]).sum(axis=0) / weight.sum()
    away = middles - middle
    nearest: FloatArray = middles[int((away * away).sum(axis=-1).argmin())]
    return nearest


def _normal(segments: FloatArray, toward: FloatArray) -> FloatArray:
    """Unit normal of the plane that fits the curve best, on the side of the second body.

    A bump cuts a small flat loop, and its plane is the plane of contact. A curve that is a line or a point has no
    plane: then the normal is the direction between the bodies, made perpendicular to the line.
    """
    points = segments.reshape(-1, 3)
    _, size, axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    if size[1] > 1e-6 * max(size[0], 1e-12):
        normal = axes[2] if len(axes) > 2 else np.cross(axes[0], axes[1])
    else:
        normal = toward - (toward @ axes[0]) * axes[0] if size[0] > 0.0 else toward
        length = float(np.sqrt((normal * normal).sum()))
        normal = normal / length if length > 1e-9 else toward
    return normal if normal @ toward >= 0 else -normal


def _vector(array: FloatArray) -> Vector:
    x, y, z = (float(value) for value in array)
    return x, y, z
