"""Every box holds its faces and lies along the axes of their surface; a leaf is one face."""

import numpy as np
import pytest
from motions import KINDS, grid_plate
from shapes import rod_mesh

from cdcore.narrow.rapid_style.tree import build_rapid_tree

MESHES = {name: make(np.random.default_rng(5)) for name, make in KINDS.items()} | {"rod": rod_mesh().triangles}


def faces_below(tree, node):
    first = tree.child[node]
    return [int(tree.leaf[node])] if first < 0 else faces_below(tree, first) + faces_below(tree, first + 1)


@pytest.mark.parametrize("name", MESHES)
@pytest.mark.parametrize("scale", [1.0, 1e-200, 1e70])
def test_every_box_holds_the_faces_below_it_and_every_face_is_one_leaf(name, scale):
    tree, depth = build_rapid_tree(MESHES[name] * scale)
    size = np.abs(tree.corners).max()
    assert sorted(faces_below(tree, 0)) == list(range(len(MESHES[name])))
    for node in range(len(tree.child)):
        points = tree.corners[faces_below(tree, node)].reshape(-1, 3)
        along = (points - tree.centre[node]) @ tree.axes[node].T
        assert (np.abs(along) <= tree.half[node] + 1e-14 * size).all()
        assert tree.size[node] == tree.half[node].max()
    assert depth <= len(MESHES[name])


def test_the_axes_do_not_depend_on_how_finely_a_surface_is_cut():
    """The covariance is of the surface: a plate of 1 face and 2, and the same plate cut into many, give one box."""
    coarse = np.array([[[0.0, 0, 0], [6, 0, 0], [6, 6, 0]], [[0, 0, 0], [6, 6, 0], [0, 6, 0]]])
    stretched = np.array([3.0, 1.0, 1.0])
    first, _ = build_rapid_tree(coarse * stretched)
    second, _ = build_rapid_tree(grid_plate(6) * stretched)
    assert np.allclose(np.abs(first.axes[0]), np.abs(second.axes[0]), atol=1e-9)
    assert np.allclose(first.half[0], [9.0, 3.0, 0.0], atol=1e-9)
    assert np.allclose(second.half[0], [9.0, 3.0, 0.0], atol=1e-9)
