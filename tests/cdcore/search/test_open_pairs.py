"""Pairs left open are decided at the points that count, whatever their size."""

import numpy as np
import pytest
from shapes import box_mesh

from cdcore import intersecting_faces
from cdcore.numerics import place_points
from cdcore.search.features import features_of
from cdcore.search.open_pairs import meeting_pairs, placed_pairs
from cdcore.search.state import POSES, WORLD_A, WORLD_B


@pytest.mark.parametrize("scale", [1.0, 2.0**-600, 2.0**500])
def test_boxes_that_share_a_side_meet_in_exactly_the_exact_pairs(scale):
    mesh = box_mesh((scale, scale, scale))
    features = features_of(mesh)
    pose = np.zeros(POSES)
    for at, x in ((WORLD_A, scale), (WORLD_B, 0.0)):
        pose[at : at + 9] = np.eye(3).ravel()
        pose[at + 9] = x
    every = np.stack(np.divmod(np.arange(144), 12), axis=1)
    found = meeting_pairs(features, features, pose, every)
    away = np.eye(4)
    away[0, 3] = scale
    faces = {(int(features.face[i]), int(features.face[j])) for i, j in found}
    assert faces == {tuple(row) for row in intersecting_faces(mesh, mesh, away).tolist()}
    assert 0 < len(found) < 144


def test_corners_are_placed_as_the_points_that_count():
    features = features_of(box_mesh())
    rng = np.random.default_rng(0)
    pose = rng.normal(size=POSES)
    pairs = np.array([[3, 5]])
    corners = features.rows[5, 4:].reshape(3, 3)
    expected = place_points(corners, pose[WORLD_B : WORLD_B + 9].reshape(3, 3), pose[WORLD_B + 9 : WORLD_B + 12])
    assert np.array_equal(placed_pairs(features, features, pose, pairs)[0, 1], expected)
