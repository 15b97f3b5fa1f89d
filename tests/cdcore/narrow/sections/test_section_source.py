"""Segments lie on both surfaces, in the world, at the frame that was asked for."""

from __future__ import annotations

import numpy as np
from support.shapes import ball_mesh, box_mesh

from cdcore import Body, Motion, create_detector
from cdcore.narrow.sections.section_source import section_of_faces, sections_of

BODIES = [Body("ball", ball_mesh(0.5, 10, 16)), Body("slab", box_mesh((4, 4, 0.2)))]


def motion():
    places = np.zeros((3, 2, 3))
    places[:, 0, 2] = [0.31, 0.452, 5.0]
    places[:, 0, :2] = [0.007, 0.013]
    places += [10.0, 0, 0]
    return Motion(np.arange(3), places, np.tile(np.eye(3), (3, 2, 1, 1)))


def test_segments_lie_on_the_slabs_faces_and_in_the_balls_shell():
    detection = create_detector("hybrid", BODIES).detect(motion(), faces=True)
    for frame, height in ((0, 0.31), (1, 0.452)):
        segments = detection.section(frame, 0)
        assert segments.shape == (len(detection.faces(frame, 0)), 2, 3)
        points = segments.reshape(-1, 3) - [10.0, 0, 0]
        assert (np.abs(np.abs(points[:, 2]) - 0.1) < 1e-12).all()
        radius = np.linalg.norm(points - [0.007, 0.013, height], axis=1)
        assert ((radius <= 0.5 + 1e-12) & (radius >= 0.45)).all()


def test_a_pair_that_does_not_meet_has_no_segment():
    pose = np.eye(3), np.array([10.007, 0.013, 0.31])
    other = np.eye(3), np.array([10.0, 0, 0])
    listed = create_detector("hybrid", BODIES).detect(motion(), faces=True).faces(0, 0)
    top = int(np.argmax(BODIES[0].mesh.triangles[:, :, 2].min(axis=1)))
    with_stray = np.vstack([listed, [top, 0]])
    segments = section_of_faces(BODIES[0], pose, BODIES[1], other, with_stray)
    assert np.array_equal(segments, section_of_faces(BODIES[0], pose, BODIES[1], other, listed))


def test_no_contact_has_no_segments():
    detection = create_detector("hybrid", BODIES).detect(motion(), faces=True)
    assert detection.section(2, 0).shape == (0, 2, 3)


def test_the_pair_decides_which_face_belongs_to_which_body():
    faces = create_detector("hybrid", BODIES).detect(motion(), faces=True).faces(0, 0)
    still = motion()
    forward = sections_of(BODIES, np.array([[0, 1]]), still)(0, 0, faces)
    backward = sections_of(BODIES, np.array([[1, 0]]), still)(0, 0, faces[:, ::-1])
    ends = [np.sort(each.reshape(len(each), 6), axis=1) for each in (forward, backward)]
    assert np.allclose(ends[0], ends[1], atol=1e-12)
    pose = (np.eye(3), np.array([10.007, 0.013, 0.31])), (np.eye(3), np.array([10.0, 0, 0]))
    assert np.array_equal(section_of_faces(BODIES[0], pose[0], BODIES[1], pose[1], faces), forward)
