"""The geometry behind misses: faces, curve, point and normal, computed only in frames with a miss."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Final, TypeVar

import numpy as np

from cdcore import Detection, Motion
from cdcore.numerics import FloatArray, IntArray
from replay.comparison.first_touch import direction, first_touch
from replay.comparison.outcome import FirstTouch
from replay.effects.output import Vector, vector_of
from replay.prepare.assembly import Assembly

Place = tuple[int, int, int]
Item = TypeVar("Item")

LOOKS_PER_MISS: Final = 128
"""A longer miss is examined in this many frames, evenly spread with both ends: at 90 Hz all frames of 1.4 s."""

LOOKS_IN_ALL: Final = 20_000
"""Pair-frames examined in all, some seconds of work; with more misses each is examined once, in its middle."""

LOOKS_AT_ONCE: Final = 1024
"""Looks whose faces are held together: some 25 MB when every look has a thousand face pairs in every pair."""

TOUCHES_IN_ALL: Final = 500
"""Misses between frames whose moment is located, 25 ms each with meshes of 3,000 faces; those beyond, later in the
recording, get no faces."""


@dataclass(frozen=True, slots=True)
class Cut:
    """How two surfaces meet in one frame."""

    frame: int
    point: Vector  # on the curve of intersection, nearest to its middle; world metres
    normal: Vector  # unit, from the first body to the second, across the curve
    face_pairs: int  # how many meet
    length: float  # of the curve, metres
    touch: FirstTouch | None = None  # where no frame shows it; point and normal are then taken at that moment
    # (k, 2) face pairs that meet, where no detection of the whole assembly holds them
    faces: IntArray | None = field(default=None, compare=False, repr=False)


class Evidence:
    """Finds the frame of a stretch in which the surfaces of two bodies intersect in the longest curve.

    Parameters
    ----------
    assembly : bodies, motion, pairs.
    faces : a detection of the whole assembly that holds face pairs, or what asks a detector for them on a motion.
    places : (pair, first, last) of every stretch that will be asked for.
    between : whether row t of the oracle covers the path from t-1 to t, so that no frame need show a contact.
    """

    def __init__(
        self, assembly: Assembly, faces: Detection | Callable[[Motion], Detection], places: Sequence[Place], *,
        between: bool = False,
    ) -> None:  # fmt: skip
        self._assembly = assembly
        points = (body.mesh.referenced_vertices for body in assembly.bodies)
        self._middles = [(vertices.min(axis=0) + vertices.max(axis=0)) / 2 for vertices in points]
        most = min(LOOKS_PER_MISS, max(1, LOOKS_IN_ALL // max(1, len(places))))
        self._frames = {place: looks(place[1], place[2], most) for place in places}
        self._faces = faces
        self._groups = list(grouped(self._frames, lambda place: len(self._frames[place]), LOOKS_AT_ONCE))
        self._group_of = {place: number for number, group in enumerate(self._groups) for place in group}
        self._touches_left = TOUCHES_IN_ALL if between else 0
        self._asked = -1
        self._answer: tuple[Detection, dict[int, int]] | None = None

    def deepest(self, pair: int, first: int, last: int) -> Cut:
        """The look with the longest curve; of equals the one with most faces, then the earliest.

        Called in the order of ``places``, it examines every frame once, and memory holds one group of frames.
        """
        detection, row = self._detection((pair, first, last))
        frames = self._frames[pair, first, last].tolist()
        cuts = [self._cut(detection, row.get(frame, frame), pair, frame) for frame in frames]
        deepest = max(cuts, key=lambda cut: (cut.length, cut.face_pairs, -cut.frame))
        return deepest if deepest.face_pairs else self._between_frames(pair, first, deepest)

    def _between_frames(self, pair: int, first: int, nothing: Cut) -> Cut:
        """Where they first touch before the first frame; ``nothing`` where that is not known."""
        if self._touches_left <= 0:
            return nothing
        self._touches_left -= 1
        touch = first_touch(self._assembly, pair, first - 1)
        if touch is None:
            return nothing
        return Cut(first, touch.point, touch.normal, 1, 0.0, touch, np.array([touch.faces], dtype=np.int64))

    def _detection(self, place: Place) -> tuple[Detection, dict[int, int]]:
        """A detection that holds the faces of a stretch, and frame -> row where the two differ."""
        if isinstance(self._faces, Detection):
            return self._faces, {}
        number = self._group_of[place]
        if self._answer is None or number != self._asked:
            self._answer = None
            frames = np.unique(np.concatenate([self._frames[one] for one in self._groups[number]]))
            rows = {frame: row for row, frame in enumerate(frames.tolist())}
            self._answer, self._asked = (self._faces(self._assembly.motion.take(frames)), rows), number
        return self._answer

    def _cut(self, detection: Detection, row: int, pair: int, frame: int) -> Cut:
        faces = detection.faces(row, pair)
        segments = detection.section(row, pair) if len(faces) else np.zeros((0, 2, 3))
        way = segments[:, 1] - segments[:, 0]
        length = np.sqrt((way * way).sum(axis=-1))
        a, b = self._centres(pair, frame)
        toward = direction(b - a)
        point, normal = (a + b) / 2, toward
        if len(segments):
            point, normal = _point(segments, length), _normal(segments, toward)
        kept = None if isinstance(self._faces, Detection) else np.array(faces, dtype=np.int64)
        return Cut(frame, vector_of(point), vector_of(normal), len(faces), float(length.sum()), faces=kept)

    def _centres(self, pair: int, frame: int) -> tuple[FloatArray, FloatArray]:
        motion = self._assembly.motion
        a, b = (
            motion.rotations[frame, body] @ self._middles[body] + motion.translations[frame, body]
            for body in self._assembly.pairs[pair].tolist()
        )
        return a, b


def grouped(items: Iterable[Item], size: Callable[[Item], int], most: int) -> Iterator[list[Item]]:
    """Items in order, in groups of at most ``most`` in size; a larger item is a group by itself."""
    group: list[Item] = []
    used = 0
    for item in items:
        if group and used + size(item) > most:
            yield group
            group, used = [], 0
        group.append(item)
        used += size(item)
    if group:
        yield group


def looks(first: int, last: int, most: int) -> IntArray:
    """At most ``most`` frames of a stretch, evenly spread with both ends; a single one lies in the middle."""
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
    return middles[int((away * away).sum(axis=-1).argmin())]


def _normal(segments: FloatArray, toward: FloatArray) -> FloatArray:
    """Unit normal of the plane that fits the curve best, on the side of the second body.

    A bump cuts a small flat loop, and its plane is the plane of contact. A curve that is a line or a point has no
    plane: then the normal is the direction between the bodies, made perpendicular to the line.
    """
    points = segments.reshape(-1, 3)
    _, size, axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    # A curve narrower than a millionth of its length counts as a line.
    if size[1] > 1e-6 * max(size[0], 1e-12):
        normal = axes[2] if len(axes) > 2 else np.cross(axes[0], axes[1])
    else:
        normal = toward - (toward @ axes[0]) * axes[0] if size[0] > 0.0 else toward
        length = float(np.sqrt((normal * normal).sum()))
        # The direction runs along the line: what is left across it is rounding.
        normal = normal / length if length > 1e-9 else toward
    return normal if normal @ toward >= 0 else -normal
