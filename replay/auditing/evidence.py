"""Geometry of a miss: faces, curve, point and normal at the frame in which the surfaces intersect most."""

from collections.abc import Iterable
from dataclasses import replace
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray
from replay.auditing.causes import ExactAnswer
from replay.auditing.fault import Evidence
from replay.auditing.first_touch import direction, first_touch
from replay.effects.output import Vector, vector_of
from replay.prepare.assembly import Assembly

MOST_LOCATED_TOUCHES: Final = 500
"""Misses between frames whose moment is located, 25 ms each with meshes of 3,000 faces; those beyond, later in the
recording, get no faces."""


CurveMeasurement = tuple[int, Vector, float, Evidence]
"""The frame to look at, a point on the curve, the length of the curve in metres, and the geometry there."""


class EvidenceFinder:
    """Finds the geometry of misses; the first touch of the first ``MOST_LOCATED_TOUCHES`` whose frames show none."""

    def __init__(self, assembly: Assembly, *, reference_is_of_intervals: bool) -> None:
        """``reference_is_of_intervals``: the oracle speaks of intervals, so that no frame need show a contact."""
        vertices = [body.mesh.referenced_vertices for body in assembly.bodies]
        self._assembly = assembly
        self._box_centres = [(corners.min(axis=0) + corners.max(axis=0)) / 2 for corners in vertices]
        self._touches_left = MOST_LOCATED_TOUCHES if reference_is_of_intervals else 0

    def measure(self, pair: int, first: int, frames: Iterable[int], exact_answer: ExactAnswer) -> CurveMeasurement:
        """Measure a pair in that of these frames in which the surfaces intersect in the longest curve.

        Of equals it is the one with most faces, then the earliest. Faces that an answer about every frame lists are not
        kept twice.

        Parameters
        ----------
        pair : column of the pair.
        first : first frame of the miss: on the way to it the bodies touch where no frame shows the contact.
        frames : those that are compared, at least one.
        exact_answer : holds them.
        """
        longest = self._longest_curve(pair, frames, exact_answer)
        frame, point, metres, evidence = longest
        if self._touches_left and not evidence.face_pairs:
            self._touches_left -= 1
            return _first_touch_before(self._assembly, pair, first) or longest
        if exact_answer.frames is None:
            return frame, point, metres, replace(evidence, faces=None)
        return longest

    def _longest_curve(self, pair: int, frames: Iterable[int], exact_answer: ExactAnswer) -> CurveMeasurement:
        longest, best_measurement = (-1.0, 0), None
        for frame in frames:
            faces = exact_answer.faces(frame, pair)
            segments = exact_answer.section(frame, pair) if len(faces) else np.zeros((0, 2, 3))
            edges = segments[:, 1] - segments[:, 0]
            lengths = np.sqrt((edges * edges).sum(axis=-1))
            frame_size = (float(lengths.sum()), len(faces))
            # Of equals the first frame.
            if frame_size <= longest:
                continue
            longest = frame_size
            a, b = self._middles_at(pair, frame)
            toward = direction(b - a)
            point, normal = (a + b) / 2, toward
            if len(segments):
                point, normal = _curve_point(segments, lengths), _curve_normal(segments, toward)
            evidence = Evidence(normal=vector_of(normal), face_pairs=len(faces), faces=np.array(faces, np.int64))
            best_measurement = frame, vector_of(point), longest[0], evidence
        assert best_measurement is not None
        return best_measurement

    def _middles_at(self, pair: int, frame: int) -> list[FloatArray]:
        """Return the middles (3,) of the two bodies of a pair in a frame, world metres."""
        motion = self._assembly.motion
        return [
            motion.rotations[frame, body] @ self._box_centres[body] + motion.translations[frame, body]
            for body in self._assembly.pairs[pair].tolist()
        ]


def _first_touch_before(assembly: Assembly, pair: int, first: int) -> CurveMeasurement | None:
    """Measure the first touch on the way to a frame; ``None``: it is not known."""
    touch = first_touch(assembly, pair, first - 1)
    if touch is None:
        return None
    faces = np.array([touch.faces], dtype=np.int64)
    return first, touch.point, 0.0, Evidence(normal=touch.normal, face_pairs=1, touch=touch, faces=faces)


def _curve_point(segments: FloatArray, length: FloatArray) -> FloatArray:
    """The midpoint of a segment nearest to the middle of the curve: on the surfaces even where the curve is a ring."""
    segment_midpoints = segments.mean(axis=1)
    weight = length if length.sum() > 0.0 else np.ones(len(length))
    curve_centroid = (segment_midpoints * weight[:, None]).sum(axis=0) / weight.sum()
    from_centroid = segment_midpoints - curve_centroid
    return segment_midpoints[int((from_centroid * from_centroid).sum(axis=-1).argmin())]


def _curve_normal(segments: FloatArray, toward: FloatArray) -> FloatArray:
    """Unit normal of the plane that fits the curve best, on the side of the second body.

    A bump cuts a small flat loop, and its plane is the plane of contact. A curve that is a line or a point has no
    plane: then the normal is the direction between the bodies, made perpendicular to the line.
    """
    points = segments.reshape(-1, 3)
    _, singular_values, principal_axes = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)
    # A curve narrower than a millionth of its length counts as a line.
    if singular_values[1] > 1e-6 * max(singular_values[0], 1e-12):
        normal = np.cross(principal_axes[0], principal_axes[1])
    else:
        normal = toward - (toward @ principal_axes[0]) * principal_axes[0] if singular_values[0] > 0.0 else toward
        length = float(np.sqrt((normal * normal).sum()))
        # The direction runs along the line: what is left across it is rounding.
        normal = normal / length if length > 1e-9 else toward
    return normal if normal @ toward >= 0 else -normal
