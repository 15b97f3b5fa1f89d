"""The eye finds the side from which nothing hides a contact."""

from dataclasses import replace

import numpy as np
import pytest

from cdcore import Body, Motion, TriangleMesh
from replay.outputs import camera
from replay.prepare.assembly import Assembly
from sessions import Scene


def wall(at, size=0.2):
    """A square across the x axis."""
    corners = [[at, y, z] for y in (-size, size) for z in (-size, size)]
    return TriangleMesh(corners, [[0, 1, 2], [1, 3, 2]])


def still(*bodies):
    count = len(bodies)
    motion = Motion([0.0], np.zeros((1, count, 3)), np.tile(np.eye(3), (1, count, 1, 1)))
    none = np.zeros((0, 2), dtype=np.int64)
    return Assembly(bodies, motion, none, np.zeros(0, bool), np.zeros(1, np.int64), np.ones((1, count), np.uint8))


@pytest.mark.parametrize(("at", "sign"), [(0.03, -1), (-0.03, 1)])
def test_the_eye_stands_on_the_free_side_of_a_wall(at, sign):
    obstacles = camera.Obstacles(still(Body("board", wall(at))), Scene())
    eye = obstacles.close_up(0, (0.0, 0.0, 0.0), np.array([-sign * 1.0, 0.0, 0.0]))
    assert np.sign(eye.position[0]) == sign or eye.position[0] * np.sign(at) < 0.03
    assert np.linalg.norm(eye.position) == pytest.approx(camera.CLOSE_UP)


def test_what_stands_before_the_eye_is_what_its_line_of_sight_crosses(demo):
    assembly = demo.assembly
    obstacles = camera.Obstacles(assembly, demo.session.scene)
    rod = assembly.motion.translations[0, assembly.names.index("rod")]
    names = {assembly.names[body] for body in obstacles.hiding(0, eye_beside(rod, 0.05))}
    assert "beaker" in names and "bench" not in names
    assert obstacles.hiding(0, eye_beside(rod, 0.5)) == set()


def eye_beside(place, up):
    """An eye that looks level at a point above a place."""
    x, y, z = place.tolist()
    return camera.Eye((x + 0.2, y + up, z), (x, y + up, z))


def test_a_body_without_a_pose_hides_nothing(demo):
    hidden = still(Body("board", wall(0.03)))
    gone = Motion([0.0], hidden.motion.translations, hidden.motion.rotations, np.zeros((1, 1), dtype=bool))
    user = np.array([1.0, 0.0, 0.0])
    eye = camera.Obstacles(replace(hidden, motion=gone), Scene()).close_up(0, (0.0, 0.0, 0.0), user)
    assert eye.position[0] > 0.09


def test_the_overview_holds_every_point_and_wastes_no_room(demo):
    random = np.random.default_rng(1)
    points = random.uniform([-0.5, 0.9, -0.1], [0.5, 1.1, 0.1], (50, 3))
    eye = camera.overview(demo.assembly, demo.session.scene, points, 0)
    local = (points - eye.position) @ camera.look_rotation(eye)
    slope = np.tan(camera.FIELD_OF_VIEW / 2)
    reach = np.maximum(np.abs(local[:, 0]) / (slope * camera.ASPECT), np.abs(local[:, 1]) / slope) / -local[:, 2]
    assert 0.7 < reach.max() < 1.0
