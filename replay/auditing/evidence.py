"""Geometry of misses: faces, curve, point and normal, computed only in frames with a miss."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Final, TypeVar

import numpy as np

from cdcore import Detection, Motion
from cdcore.numerics import FloatArray
from replay.auditing.fault import Evidence, Fault
from replay.auditing.first_touch import direction, first_touch
from replay.auditing.sample_budget import SampleBudget, grouped, spread_frames
from replay.effects.output import vector_of
from replay.prepare.assembly import Assembly

Segment = tuple[int, int, int]
Item = TypeVar("Item")

EVIDENCE_BUDGET: Final = SampleBudget(per_miss=128, total=20_000, at_once=1024)
"""At 90 Hz all frames of 1.4 s, and some seconds of work; 25 MB where each has a thousand face pairs in every pair."""

TOUCHES_IN_ALL: Final = 500
"""Misses between frames whose moment is located, 25 ms each with meshes of 3,000 faces; those beyond, later in the
recording, get no faces."""


def measure_misses(
    assembly: Assembly,
    faces: Detection | Callable[[Motion], Detection],
    misses: Sequence[Fault],
    *,
    between: bool = False,
) -> tuple[Fault, ...]:
    """Return the misses with evidence of the frame in which the surfaces intersect in the longest curve.

    Of equals it is the one with most faces, then the earliest. Every frame is asked for once; memory holds the faces of
    one group of frames. The same frames of a pair are measured once for all detectors.

    Parameters
    ----------
    assembly : bodies, motion, pairs.
    faces : a detection of the whole assembly that holds face pairs, or what asks a detector for them on a motion.
    misses : to be measured.
    between : whether row t of the oracle covers the path from t-1 to t, so that no frame need show a contact.
    """
    by_segment: dict[Segment, Fault] = {(miss.pair, miss.first, miss.last): miss for miss in misses}
    most = EVIDENCE_BUDGET.frames_per_miss(len(misses))
    frames = {segment: spread_frames(segment[1], segment[2], most) for segment in by_segment}
    middles = [body.mesh.referenced_vertices for body in assembly.bodies]
    middles = [(vertices.min(axis=0) + vertices.max(axis=0)) / 2 for vertices in middles]
    touches = TOUCHES_IN_ALL if between else 0
    for group in grouped(frames, lambda segment: len(frames[segment]), EVIDENCE_BUDGET.at_once):
        if isinstance(faces, Detection):
            queried, detection = np.arange(len(assembly.motion)), faces
        else:
            queried = np.unique(np.concatenate([frames[segment] for segment in group]))
            detection = faces(assembly.motion.take(queried))
        for segment in group:
            rows = np.searchsorted(queried, frames[segment])
            sampled = dict(zip(rows.tolist(), frames[segment].tolist(), strict=True))
            best = _longest_curve(assembly, detection, middles, by_segment[segment], sampled)
            if touches and not best.evidence.face_pairs:
                touches -= 1
                best = _before(assembly, best)
            elif isinstance(faces, Detection):
                best = replace(best, evidence=replace(best.evidence, faces=None))
            by_segment[segment] = best
    measured = (by_segment[miss.pair, miss.first, miss.last] for miss in misses)
    return tuple(
        replace(miss, frame=same.frame, point=same.point, metres=same.metres, evidence=same.evidence)
        for miss, same in zip(misses, measured, strict=True)
    )


def _before(assembly: Assembly, miss: Fault) -> Fault:
    """Return a miss with the first touch on the way to its first frame, if that is known."""
    touch = first_touch(assembly, miss.pair, miss.first - 1)
    if touch is None:
        return miss
    faces = np.array([touch.faces], dtype=np.int64)
    evidence = Evidence(normal=touch.normal, face_pairs=1, touch=touch, faces=faces)
    return replace(miss, frame=miss.first, point=touch.point, metres=0.0, evidence=evidence)


def _longest_curve(
    assembly: Assembly, detection: Detection, middles: Sequence[FloatArray], miss: Fault, sampled: Mapping[int, int]
) -> Fault:
    """Return a miss measured in the frame with the longest curve.

    ``middles`` (3,) of every body, in its own frame; ``sampled``: row of the detection -> frame of the motion.
    """
    best = miss
    longest = (-1.0, 0)
    for row, frame in sampled.items():
        faces = detection.faces(row, miss.pair)
        segments = detection.section(row, miss.pair) if len(faces) else np.zeros((0, 2, 3))
        edges = segments[:, 1] - segments[:, 0]
        lengths = np.sqrt((edges * edges).sum(axis=-1))
        size = (float(lengths.sum()), len(faces))
        # Of equals the first frame.
        if size <= longest:
            continue
        longest = size
        a, b = _middles_at(assembly, middles, miss.pair, frame)
        toward = direction(b - a)
        point, normal = (a + b) / 2, toward
        if len(segments):
            point, normal = _point(segments, lengths), _normal(segments, toward)
        evidence = Evidence(normal=vector_of(normal), face_pairs=len(faces), faces=np.array(faces, np.int64))
        best = replace(miss, frame=frame, point=vector_of(point), metres=size[0], evidence=evidence)
    return best


def _middles_at(assembly: Assembly, middles: Sequence[FloatArray], pair: int, frame: int) -> list[FloatArray]:
    """Return the middles (3,) of the two bodies of a pair in a frame, world metres."""
    motion = assembly.motion
    return [
        motion.rotations[frame, body] @ middles[body] + motion.translations[frame, body]
        for body in assembly.pairs[pair].tolist()
    ]


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
