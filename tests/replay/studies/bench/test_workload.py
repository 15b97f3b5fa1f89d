"""The bench is the same for the same arguments, rigid, as large as asked for, and things touch on it."""

import numpy as np
import pytest

from replay.studies.bench.engines import OwnExact
from replay.studies.bench.workload import MAKERS, PERIOD, RATE_HZ, make_resting, make_workload

FRAMES = int(PERIOD * RATE_HZ)


def test_the_same_seed_gives_the_same_bench_and_another_does_not():
    one, same, other = (make_workload(200, 90, seed=seed) for seed in (3, 3, 4))
    assert np.array_equal(one.poses, same.poses)
    assert not np.array_equal(one.poses, other.poses)


@pytest.mark.parametrize("distant", [False, True])
def test_poses_are_rigid_smooth_and_go_on_where_the_script_begins_again(distant):
    load = make_workload(100, FRAMES + 200, bodies=9, distant=distant)
    turn, place = load.poses[..., :3, :3], load.poses[..., :3, 3]
    assert np.allclose(turn @ turn.swapaxes(-1, -2), np.eye(3), atol=1e-14)
    assert np.allclose(np.linalg.det(turn), 1)
    assert np.linalg.norm(np.diff(place, axis=0), axis=-1).max() < 0.03
    assert np.abs(np.diff(turn, axis=0)).max() < 0.1
    assert len(load.names) == 9 and load.names[8].startswith("rod")


def test_two_bodies_are_no_bench():
    with pytest.raises(ValueError, match="3 bodies or more, not 2"):
        make_workload(10, 10, bodies=2)


@pytest.mark.parametrize("seed", [0, 1])
def test_every_moving_thing_touches_something_and_a_twentieth_of_the_pair_frames_is_near(seed):
    load = make_workload(500, FRAMES, seed=seed)
    found = OwnExact(load).staged("bool")[1]
    touching = load.pairs[(found.verdict == 1).any(axis=0)]
    assert {load.names[k] for k in touching.ravel()} == set(load.names)
    assert 0.06 < (found.verdict == 1).any(axis=1).mean() < 0.15
    assert 0.85 < found.work["skipped"] / found.verdict.size < 0.96


def test_distant_bodies_are_metres_apart_and_move_as_they_do_on_the_bench():
    near, far = make_workload(100, 90), make_workload(100, 90, distant=True)
    x = far.poses[:, :, 0, 3]
    assert np.diff(x, axis=1).min() > 4
    assert np.array_equal(near.poses[..., 1:3, :], far.poses[..., 1:3, :])


def test_a_resting_cup_takes_exact_arithmetic_in_every_frame():
    found = OwnExact(make_resting(200, 20)).staged("faces")[1]
    assert (found.verdict == 1).all()
    assert found.work["exact_tests"] > 20


@pytest.mark.parametrize("faces", [500, 5_000])
@pytest.mark.parametrize("kind", MAKERS)
def test_a_mesh_has_nearly_the_faces_asked_for_and_each_has_an_area(kind, faces):
    vertices, triangles = MAKERS[kind](faces)
    assert abs(len(triangles) / faces - 1) < 0.1
    assert np.array_equal(vertices, vertices.astype(np.float32))
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).min() > 0
    assert np.array_equal(np.unique(triangles), np.arange(len(vertices)))


def test_a_rod_goes_into_a_cup_and_a_tube_into_a_ring():
    rod, cup, tube, ring = (np.hypot(*MAKERS[kind](500)[0][:, :2].T) for kind in ("rod", "cup", "tube", "ring"))
    assert rod.max() < 0.1 * cup.max()
    assert tube.max() < 0.5 * ring.min()
