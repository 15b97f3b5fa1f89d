"""The geometry behind misses: faces, curve, point and normal, computed only in frames with a miss."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
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


def longest_cuts(
    assembly: Assembly, faces: Detection | Callable[[Motion], Detection], places: Sequence[Place], *,
    between: bool = False,
) -> dict[Place, Cut]:  # fmt: skip
    """Of every stretch the frame in which the surfaces of its two bodies intersect in the longest curve.

    Of equals it is the one with most faces, then the earliest. Every frame is asked for once; memory holds the faces of
    one group of frames.

    Parameters
    ----------
    assembly : bodies, motion, pairs.
    faces : a detection of the whole assembly that holds face pairs, or what asks a detector for them on a motion.
    places : (pair, first, last) of every stretch.
    between : whether row t of the oracle covers the path from t-1 to t, so that no frame need show a contact.
    """
    most = min(LOOKS_PER_MISS, max(1, LOOKS_IN_ALL // len(places)))
    frames = {place: looks(place[1], place[2], most) for place in places}
    middles = [body.mesh.referenced_vertices for body in assembly.bodies]
    middles = [(vertices.min(axis=0) + vertices.max(axis=0)) / 2 for vertices in middles]
    touches = TOUCHES_IN_ALL if between else 0
    cuts: dict[Place, Cut] = {}
    for group in grouped(frames, lambda place: len(frames[place]), LOOKS_AT_ONCE):
        if isinstance(faces, Detection):
            asked, detection = np.arange(len(assembly.motion)), faces
        else:
            asked = np.unique(np.concatenate([frames[place] for place in group]))
            detection = faces(assembly.motion.take(asked))
        for place in group:
            pair, first, _ = place
            rows = zip(np.searchsorted(asked, frames[place]).tolist(), frames[place].tolist(), strict=True)
            looked = [_cut(assembly, detection, row, middles, pair, frame) for row, frame in rows]
            cut = max(looked, key=lambda cut: (cut.length, cut.face_pairs, -cut.frame))
            if touches and not cut.face_pairs:
                touches -= 1
                cut = _before(assembly, pair, first) or cut
            cuts[place] = replace(cut, faces=None) if isinstance(faces, Detection) and cut.touch is None else cut
    return cuts


def _before(assembly: Assembly, pair: int, first: int) -> Cut | None:
    """Where a pair first touches on the way to a frame, if that is known."""
    touch = first_touch(assembly, pair, first - 1)
    if touch is None:
        return None
    return Cut(first, touch.point, touch.normal, 1, 0.0, touch, np.array([touch.faces], dtype=np.int64))


def _cut(
    assembly: Assembly, detection: Detection, row: int, middles: Sequence[FloatArray], pair: int, frame: int
) -> Cut:
    """How the surfaces of a pair meet in a frame, which is a ``row`` of the detection; ``middles`` of all bodies."""
    motion, faces = assembly.motion, detection.faces(row, pair)
    segments = detection.section(row, pair) if len(faces) else np.zeros((0, 2, 3))
    way = segments[:, 1] - segments[:, 0]
    length = np.sqrt((way * way).sum(axis=-1))
    a, b = (
        motion.rotations[frame, body] @ middles[body] + motion.translations[frame, body]
        for body in assembly.pairs[pair].tolist()
    )
    toward = direction(b - a)
    point, normal = (a + b) / 2, toward
    if len(segments):
        point, normal = _point(segments, length), _normal(segments, toward)
    return Cut(
        frame, vector_of(point), vector_of(normal), len(faces), float(length.sum()), faces=np.array(faces, np.int64)
    )


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
        normal = np.cross(axes[0], axes[1])
    else:
        normal = toward - (toward @ axes[0]) * axes[0] if size[0] > 0.0 else toward
        length = float(np.sqrt((normal * normal).sum()))
        # The direction runs along the line: what is left across it is rounding.
        normal = normal / length if length > 1e-9 else toward
    return normal if normal @ toward >= 0 else -normal
