"""Intersection segments of a detection, computed on first use of a frame."""

from collections.abc import Sequence

import numpy as np

from cdcore.numerics import FloatArray, IntArray
from cdcore.poses import place_points
from cdcore.protocol import Body, Motion

Pose = tuple[FloatArray, FloatArray]
"""Rotation (3, 3) and translation (3,)."""


def section_of_faces(a: Body, pose_a: Pose, b: Body, pose_b: Pose, faces: IntArray) -> FloatArray:
    """Segments (m, 2, 3) in which the face pairs (k, 2) of two placed bodies meet, world metres.

    m is below k where an engine that rounds listed pairs that do not meet, and of needles whose plane doubles miss.
    """
    from cdcore.narrow.sections.triangle_sections import triangle_pair_sections

    triangles = np.empty((len(faces), 2, 3, 3))
    for side, (body, pose) in enumerate(((a, pose_a), (b, pose_b))):
        corners = body.mesh.triangles[faces[:, side]]
        triangles[:, side] = place_points(corners.reshape(-1, 3), *pose).reshape(-1, 3, 3)
    segments: FloatArray = triangle_pair_sections(triangles)
    return segments[np.isfinite(segments).all(axis=(1, 2))]


def section_of_frame(
    bodies: Sequence[Body], pairs: IntArray, motion: Motion, frame: int, pair: int, faces: IntArray
) -> FloatArray:
    """Segments (m, 2, 3) in which the face pairs (k, 2) of a pair, a row of ``pairs`` (P, 2), meet in a frame."""
    i, j = pairs[pair].tolist()
    pose_i, pose_j = ((motion.rotations[frame, k], motion.translations[frame, k]) for k in (i, j))
    return section_of_faces(bodies[i], pose_i, bodies[j], pose_j, faces)
