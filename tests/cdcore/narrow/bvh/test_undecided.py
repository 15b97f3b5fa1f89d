"""Face pairs in common planes are decided at any scale, by sums and by integers alike, and are listed once."""

import numpy as np
import pytest
from support.shapes import sliding_grids

from cdcore import Body, Motion, TriangleMesh, create_detector
from cdcore.narrow.brute_force import meeting_faces_placed

BEYOND_SUMS = 2.0**-210
"""Products of coordinates of this size leave the range of exact sums."""


def sliding_grids_at(scale):
    """Two grids that slide over each other in one plane, at a scale that is a power of two."""
    bodies, motion, _meets = sliding_grids(cells=6, frames=12)
    scaled = [Body(body.name, TriangleMesh(body.mesh.vertices * scale, body.mesh.faces)) for body in bodies]
    return scaled, Motion(motion.times, motion.translations * scale, motion.rotations)


@pytest.mark.parametrize("faces", [False, True])
def test_integers_decide_as_sums_do_at_another_scale(faces):
    """At 2^-210 products leave the range of exact sums, and integers decide; a power of two changes no answer."""
    summed, by_integers = (
        create_detector("exact", bodies).detect(motion, faces=faces)
        for bodies, motion in (sliding_grids_at(scale=1.0), sliding_grids_at(BEYOND_SUMS))
    )
    assert summed.work["exact_tests"] > 0 == summed.work["integer_tests"]
    assert by_integers.work["integer_tests"] > 0
    assert summed.digest == by_integers.digest
    if faces:
        assert summed.faces_digest == by_integers.faces_digest


def test_sums_and_integers_decide_each_face_pair_once():
    """One row of corners is raised by 2^-210 m, too small for exact sums: those faces are decided in integers."""
    bodies, motion, _meets = sliding_grids(cells=6, frames=12)
    motion = Motion(motion.times, -motion.translations, motion.rotations)
    corners = bodies[0].mesh.vertices.copy()
    corners[corners[:, 1] == 0.0, 1] = BEYOND_SUMS
    bodies[0] = Body("first", TriangleMesh(corners, bodies[0].mesh.faces))
    detection = create_detector("exact", bodies).detect(motion, faces=True)
    assert detection.work["exact_tests"] > 0 < detection.work["integer_tests"]
    first, second = (body.mesh.triangles for body in bodies)
    for frame in range(len(motion)):
        poses = [(motion.rotations[frame, body], motion.translations[frame, body]) for body in range(2)]
        expected = meeting_faces_placed(first, poses[0], second, poses[1])
        assert np.array_equal(detection.faces(frame, 0), expected)
