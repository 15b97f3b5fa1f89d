from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist
from scipy.spatial.transform import Rotation
from support.small_worlds import cube, cubes

from cdcore import Body, Motion, TriangleMesh
from replay.metrics.near import CLOSE_M, SPACING_M, _close, close_stretches, spread_points, without_contact
from replay.prepare.assemble import assemble

FRAMES = 400


def approach(least, centre=2.0, width=0.1):
    """A unit cube comes to within ``least`` metres of another about a time, 0.2 m away otherwise; 100 Hz."""
    t = np.arange(FRAMES) * 0.01
    return 1.0 + np.where(np.abs(t - centre) <= width, least, 0.2)


def near(gap):
    assembly = assemble(cubes({"a": np.zeros(FRAMES), "b": gap}))
    return close_stretches(assembly, np.arange(len(assembly.pairs)))


def test_a_cube_that_comes_within_four_millimetres_is_seen_with_its_time():
    (one,) = near(approach(0.004))
    assert 1.89 <= one.start <= one.end <= 2.11


def test_what_stays_farther_away_is_no_near_miss():
    assert near(approach(0.012)) == ()


def test_two_approaches_are_two_and_a_flicker_is_one():
    assert len(near(np.minimum(approach(0.004, 1.0), approach(0.004, 3.0)))) == 2
    assert len(near(np.minimum(approach(0.004, 2.0), approach(0.004, 2.3)))) == 1


def test_with_a_contact_within_half_a_second_it_is_no_miss():
    found = near(approach(0.004))
    assert without_contact(found, np.array([[0, 2.5, 2.6]])) == ()
    assert without_contact(found, np.array([[0, 2.7, 2.8]])) == found
    assert without_contact(found, np.array([[1, 2.0, 2.1]])) == found
    assert without_contact(found, np.zeros((0, 3))) == found


@pytest.mark.parametrize("turns", [0.2, 0.002, 0.0])
def test_close_is_what_all_points_to_all_points_say_however_slowly_things_move(turns):
    rng, frames, shape = np.random.default_rng(1), 40, cube(0.02)
    assembly = assemble(cubes({"a": np.zeros(frames), "b": 0.0302 + 0.006 * np.sin(np.arange(frames) / 6.0)}))
    assembly = replace(assembly, bodies=[Body(name, TriangleMesh(shape.vertices, shape.faces)) for name in "ab"])
    poses = assembly.motion.rotations.copy()
    poses[:, 1] = Rotation.from_rotvec(rng.uniform(-turns, turns, (frames, 3))).as_matrix()
    motion = Motion(assembly.motion.times, assembly.motion.translations, poses)
    clouds = [spread_points(body) for body in assembly.bodies]
    placed = [[clouds[n] @ poses[k, n].T + motion.translations[k, n] for n in (0, 1)] for k in range(frames)]
    truth = [cdist(*both).min() < CLOSE_M for both in placed]
    assert _close(replace(assembly, motion=motion), 0, 1, np.arange(frames), {}).tolist() == truth
    assert 5 < sum(truth) < frames - 5


def test_points_leave_no_gap_wider_than_the_spacing():
    shape = cube(0.1)
    points = spread_points(Body("c", TriangleMesh(shape.vertices, shape.faces)))
    rng = np.random.default_rng(0)
    surface = rng.uniform(-0.05, 0.05, (500, 3))
    surface[:, 0] = 0.05
    assert cKDTree(points).query(surface)[0].max() <= SPACING_M
    assert np.abs(np.abs(points).max(axis=1) - 0.05).max() < 1e-12


def test_points_of_a_large_body_are_bounded_in_number():
    shape = cube(50.0)
    assert len(spread_points(Body("c", TriangleMesh(shape.vertices, shape.faces)))) <= 40_000


def test_a_lost_pose_is_not_close_to_anything():
    session = cubes({"a": np.zeros(FRAMES), "b": approach(0.004)})
    assembly = assemble(session)
    valid = assembly.motion.valid.copy()
    valid[150:250, 1] = False
    whole = assembly.motion
    world = np.tile(np.eye(4), (*valid.shape, 1, 1))
    world[..., :3, :3], world[..., :3, 3] = whole.rotations, whole.translations
    motion = Motion.from_matrices(whole.times, world, valid)
    assert close_stretches(replace(assembly, motion=motion), np.array([0])) == ()
