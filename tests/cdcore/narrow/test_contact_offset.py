import fcl
import numpy as np
import pytest
from support.shapes import beaker_mesh, random_rotations, rod_mesh

from cdcore import Motion
from cdcore.narrow.contact_offset import ContactOffset
from cdcore.narrow.fcl_meshes import _tree
from cdcore.narrow.spacetime.box_tree import build_box_tree

FRAMES = 200


@pytest.mark.parametrize("reach", [0.002, 0.02])
def test_it_says_near_where_fcl_measures_less_than_the_reach_also_of_poses_that_repeat(reach):
    rng = np.random.default_rng(1)
    meshes = [beaker_mesh(), rod_mesh()]
    places, turns = rng.normal(size=(FRAMES, 2, 3)) * 0.04, random_rotations(rng, FRAMES, 2)
    places[1::3], turns[1::3] = places[0::3], turns[0::3]
    motion = Motion(np.arange(FRAMES) / 90, places, turns)
    things, apart = [fcl.CollisionObject(_tree(mesh)) for mesh in meshes], np.zeros(FRAMES)
    for frame in range(FRAMES):
        for body, thing in enumerate(things):
            thing.setRotation(turns[frame, body])
            thing.setTranslation(places[frame, body])
        if not fcl.collide(*things, fcl.CollisionRequest(), fcl.CollisionResult()):
            apart[frame] = fcl.distance(*things, fcl.DistanceRequest(), fcl.DistanceResult())
    frames = np.flatnonzero(apart > 0)
    trees, columns = [build_box_tree(mesh.triangles) for mesh in meshes], np.zeros(len(frames), dtype=np.int64)
    for pairs in ([[0, 1]], [[1, 0]]):
        near = ContactOffset(trees, np.array(pairs), reach).near(motion, frames, columns)
        assert near.tolist() == (apart[frames] <= reach).tolist()
    assert 2 < near.sum() < len(frames) > 30
