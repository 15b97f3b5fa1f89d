"""One placement of two meshes: the exhaustive answer, sorted, for any rigid poses."""

import numpy as np
import pytest
from support.motions import placed, rotations, soup

from cdcore import TriangleMesh, intersecting_faces
from cdcore.errors import InvalidPoseError
from cdcore.narrow.brute_force import meeting_faces_exhaustive


def mesh_of(triangles):
    return TriangleMesh(triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3))


def test_it_equals_the_exhaustive_test():
    rng = np.random.default_rng(1)
    a, b = soup(rng, 60), soup(rng, 50)
    poses = np.tile(np.eye(4), (2, 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = rotations(rng, (2,)), rng.normal(size=(2, 3)) * 0.3
    found = intersecting_faces(mesh_of(a), mesh_of(b), *poses)
    want = meeting_faces_exhaustive(*(placed(t, p[:3, :3], p[:3, 3]) for t, p in zip((a, b), poses, strict=True)))
    assert found.dtype == np.int64
    assert len(want) > 5
    assert np.array_equal(found, want)


def test_a_pose_that_is_none_is_refused_by_its_body():
    mesh = mesh_of(np.zeros((1, 3, 3)))
    with pytest.raises(InvalidPoseError, match="body B"):
        intersecting_faces(mesh, mesh, np.eye(4), np.full((4, 4), np.nan))
