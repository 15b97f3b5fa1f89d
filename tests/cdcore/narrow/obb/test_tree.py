"""Every box holds its faces, whatever their shape, and leaves hold up to four."""

import numpy as np
import pytest
from motions import KINDS
from shapes import rod_mesh

from cdcore.narrow.obb.tree import LEAF_FACES, build_obb_tree

MESHES = {name: make(np.random.default_rng(5)) for name, make in KINDS.items()} | {"rod": rod_mesh().triangles}


@pytest.mark.parametrize("name", MESHES)
@pytest.mark.parametrize("scale", [1.0, 1e-200, 1e70])
def test_every_box_holds_the_faces_of_its_node(name, scale):
    tree, _ = build_obb_tree(MESHES[name] * scale)
    size = np.abs(tree.corners).max()
    for node in range(len(tree.child)):
        points = tree.corners[tree.start[node] : tree.stop[node]].reshape(-1, 3)
        along = (points - tree.centre[node]) @ tree.axes[node].T
        assert (np.abs(along) <= tree.half[node] + 1e-14 * size).all()


@pytest.mark.parametrize("name", MESHES)
def test_leaves_hold_every_face_once_and_few_each(name):
    tree, depth = build_obb_tree(MESHES[name])
    leaves = np.flatnonzero(tree.child < 0)
    sizes = (tree.stop - tree.start)[leaves]
    assert sizes.sum() == len(MESHES[name]) and sizes.min() >= 1 and sizes.max() <= LEAF_FACES
    assert sorted(tree.number.tolist()) == list(range(len(MESHES[name])))
    assert np.array_equal(tree.corners, MESHES[name][tree.number])
    assert LEAF_FACES * 2 ** (depth - 1) >= len(MESHES[name])


def test_a_slanted_rod_gets_a_slanted_box():
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    tree, _ = build_obb_tree(rod_mesh(0.003, 0.1).triangles @ turn.T)
    assert sorted(tree.half[0].tolist())[2] < 0.06
    assert sorted(tree.half[0].tolist())[1] < 0.004
