"""Every box is the least one along the body's axes around the faces below it; a leaf is one face."""

import numpy as np
import pytest
from motions import KINDS
from shapes import rod_mesh

from cdcore.narrow.solid_style.tree import build_solid_tree

MESHES = {name: make(np.random.default_rng(5)) for name, make in KINDS.items()} | {"rod": rod_mesh().triangles}


def faces_below(tree, node):
    first = tree.child[node]
    return [int(tree.leaf[node])] if first < 0 else faces_below(tree, first) + faces_below(tree, first + 1)


@pytest.mark.parametrize("name", MESHES)
def test_every_box_is_the_box_of_the_faces_below_it(name):
    tree, depth = build_solid_tree(MESHES[name])
    assert sorted(faces_below(tree, 0)) == list(range(len(MESHES[name])))
    for node in range(len(tree.child)):
        points = tree.corners[faces_below(tree, node)].reshape(-1, 3)
        assert np.allclose(tree.centre[node] - tree.half[node], points.min(axis=0), atol=1e-15)
        assert np.allclose(tree.centre[node] + tree.half[node], points.max(axis=0), atol=1e-15)
    assert depth <= len(MESHES[name])


def test_a_node_is_cut_at_the_middle_of_its_longest_side_not_at_its_median_face():
    along = np.array([0.0, 0.1, 0.2, 0.3, 10.0])[:, None, None]
    faces = np.array([[[0.0, 0, 0], [0.01, 0, 0], [0, 0.01, 0]]]) + along * np.array([1.0, 0, 0])
    tree, _ = build_solid_tree(faces)
    assert sorted(faces_below(tree, tree.child[0])) == [0, 1, 2, 3]
