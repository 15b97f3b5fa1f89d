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


@pytest.mark.parametrize("faces", [False, True], ids=["verdicts", "verdicts and faces"])
def test_integers_decide_as_sums_do_at_another_scale(faces):
    """Two grids slide over each other in one plane, at 1 m and at 2^-210 m, a power of two, which rounds nothing.

    Exact sums take sizes from 2^-200 to 2^200, so that integers decide there; verdicts, and faces, stay the same.
    """
    by_sums, by_integers = (
        create_detector("exact", bodies).detect(motion, faces=faces)
        for bodies, motion in (sliding_grids_at(scale=1.0), sliding_grids_at(BEYOND_SUMS))
    )
    assert by_sums.work["exact_tests"] > 0
    assert by_sums.work["integer_tests"] == 0
    assert by_integers.work["integer_tests"] > 0
    assert by_sums.digest == by_integers.digest
    if faces:
        assert by_sums.faces_digest == by_integers.faces_digest


def test_sums_and_integers_decide_each_face_pair_once():
    """Two grids slide in one plane; one row of corners is raised by 2^-210 m, too small for exact sums.

    Its faces are decided in integers, all others by sums; an exhaustive test gives the faces that meet.
    """
    bodies, motion, _meets = sliding_grids(cells=6, frames=12)
    motion = Motion(motion.times, -motion.translations, motion.rotations)
    corners = bodies[0].mesh.vertices.copy()
    corners[corners[:, 1] == 0.0, 1] = BEYOND_SUMS
    bodies[0] = Body("first", TriangleMesh(corners, bodies[0].mesh.faces))
    detection = create_detector("exact", bodies).detect(motion, faces=True)
    assert detection.work["exact_tests"] > 0
    assert detection.work["integer_tests"] > 0
    first, second = (body.mesh.triangles for body in bodies)
    for frame in range(len(motion)):
        first_pose, second_pose = ((motion.rotations[frame, k], motion.translations[frame, k]) for k in range(2))
        expected = meeting_faces_placed(first, first_pose, second, second_pose)
        assert np.array_equal(detection.faces(frame, pair=0), expected), frame
