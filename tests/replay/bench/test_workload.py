"""The bench is the same for the same arguments, rigid, and as large as asked for."""

import numpy as np
import pytest

from replay.bench.workload import make_workload


def test_the_same_seed_gives_the_same_bench_and_another_does_not():
    one, same, other = (make_workload(200, 90, seed=seed) for seed in (3, 3, 4))
    assert np.array_equal(one.poses, same.poses)
    assert not np.array_equal(one.poses, other.poses)


@pytest.mark.parametrize("faces", [500, 5_000])
def test_bodies_have_nearly_the_faces_asked_for_and_poses_are_rigid(faces):
    load = make_workload(faces, 90, bodies=9)
    assert all(abs(len(mesh[1]) / faces - 1) < 0.1 for mesh in load.meshes)
    turn = load.poses[..., :3, :3]
    assert np.allclose(turn @ turn.swapaxes(-1, -2), np.eye(3), atol=1e-14)
    assert len(load.names) == 9


def test_two_bodies_are_no_bench():
    with pytest.raises(ValueError, match="3 bodies or more, not 2"):
        make_workload(10, 10, bodies=2)
