"""A tree loses no face, and its fitted boxes cover what lies below."""

import numpy as np
import pytest
from support.random_worlds import KINDS, grid_plate
from support.second_opinions import faces_below
from support.shapes import random_rotations

from cdcore.narrow.bvh.box_tree import build_box_trees
from cdcore.narrow.tree_kinds import TREE_KINDS

MESHES = {name: make(np.random.default_rng(2)) for name, make in KINDS.items()}
MESHES["plate"] = grid_plate(size=8)
MESHES["one face"] = grid_plate(size=1)[:1]
MESHES["one point"] = np.zeros((20, 3, 3))
MESHES["far"] = grid_plate(size=4) + 1e6
MESHES["tiny point"] = np.full((1, 3, 3), 1e-200)
MESHES["large point"] = np.full((2, 3, 3), 1e70)
by_mesh = pytest.mark.parametrize("name", MESHES)


def box_of_node(tree, node):
    """Centre (3,), axes (3, 3) in rows, half edges (3,) and half diagonal of a node's box."""
    box = tree.boxes[node]
    return box[:3], box[3:12].reshape(3, 3).T, box[12:15], box[15]


@by_mesh
def test_leaves_hold_every_face_once(name):
    """A node without children (``child`` < 0) is a leaf, of one face or a few; below the root, node 0,
    are all faces.
    """
    all_faces = list(range(len(MESHES[name])))
    (tree,) = build_box_trees([MESHES[name]])
    is_leaf = tree.child < 0
    faces_in_leaves = (tree.stop - tree.start)[is_leaf]
    assert sorted(tree.faces.tolist()) == all_faces
    assert faces_in_leaves.sum() == len(all_faces)
    assert faces_in_leaves.min() >= 1
    assert faces_in_leaves.max() <= TREE_KINDS["exact"].leaf_faces
    assert faces_below(tree, node=0).tolist() == all_faces


@by_mesh
def test_boxes_cover_their_corners_to_a_few_roundings(name):
    """A box has perpendicular axes of length 1, and half the diagonal of its half edges.

    Corners below its node may stand out by 40 roundings of the farthest corner's distance; 1e-300 m is for points near
    zero.
    """
    triangles = MESHES[name]
    (tree,) = build_box_trees([triangles])
    rounding = 2**-53 * tree.reach
    for node in range(len(tree.boxes)):
        centre, axes, half_edges, half_diagonal = box_of_node(tree, node)
        assert np.abs(axes @ axes.T - np.eye(3)).max() < 4e-15, node
        corners = triangles[faces_below(tree, node)].reshape(-1, 3)
        offsets = np.abs((corners - centre) @ axes.T)
        assert (offsets - half_edges).max() <= 40 * rounding + 1e-300, node
        assert half_diagonal == pytest.approx(np.linalg.norm(half_edges), rel=1e-15, abs=1e-300), node


@by_mesh
def test_leaf_data_repeat_the_faces_in_their_frames(name):
    """A leaf has each of its faces in the body's axes (``placed``, the first corner once more at the end).

    Then about the middle of its box (``corners``), and in the axes of the box (``boxed``) with their extents there.
    """
    triangles = MESHES[name]
    (tree,) = build_box_trees([triangles])
    leaf_nodes = np.flatnonzero(tree.child < 0)
    assert leaf_nodes.size
    for node in leaf_nodes:
        centre, axes, _half_edges, _half_diagonal = box_of_node(tree, node)
        for row in range(tree.start[node], tree.stop[node]):
            a, b, c = face = triangles[tree.faces[row]]
            about_centre, in_box_axes = tree.corners[row].reshape(3, 3), tree.boxed[row].reshape(3, 3)
            assert np.array_equal(tree.placed[row].reshape(3, 4).T, [a, b, c, a]), (node, row)
            assert np.array_equal(about_centre, face - centre), (node, row)
            assert np.allclose(in_box_axes, about_centre @ axes.T, atol=1e-14 * (1 + np.abs(about_centre).max()))
            extents = np.stack([in_box_axes.min(axis=0), in_box_axes.max(axis=0)], axis=1)
            assert np.array_equal(tree.spans[row].reshape(3, 2), extents), (node, row)


def test_box_trees_built_together_equal_trees_built_singly():
    """Trees of soups, fans, plates and points (MESHES), built in one call and in a call each: all arrays are equal.

    The last field of a tree is left out: its addresses in memory.
    """
    together = build_box_trees([*MESHES.values()])
    for triangles, tree in zip(MESHES.values(), together, strict=True):
        (alone,) = build_box_trees([triangles])
        assert all(np.array_equal(array, other) for array, other in zip(tree[:-1], alone[:-1], strict=True))


def fitted_box_of(triangles):
    """Axes (3, 3) of the root's box, and its lower and upper ends (3,) along each of them."""
    (tree,) = build_box_trees([triangles])
    centre, axes, half_edges, _half_diagonal = box_of_node(tree, node=0)
    return axes, axes @ centre - half_edges, axes @ centre + half_edges


def surface_of(lower, upper):
    """Half the surface of a box between two corners."""
    x, y, z = upper - lower
    return x * y + y * z + z * x


@pytest.mark.parametrize("seed", range(6))
def test_rotated_slab_is_fitted_along_its_own_axes(seed):
    """200 triangles in a slab of 6 x 2 x 0.2 m, rotated at random: the box holds them tightly.

    Its surface is at most 1.3 times that of the slab.
    """
    rng = np.random.default_rng(seed)
    slab = np.array([6.0, 2.0, 0.2])
    triangles = (rng.uniform(-0.5, 0.5, (200, 3, 3)) * slab) @ random_rotations(rng).T
    axes, lower, upper = fitted_box_of(triangles)
    assert np.abs(axes @ axes.T - np.eye(3)).max() < 2e-15
    along_axes = triangles.reshape(-1, 3) @ axes.T
    assert np.allclose(along_axes.min(axis=0), lower)
    assert np.allclose(along_axes.max(axis=0), upper)
    assert surface_of(lower, upper) < 1.3 * surface_of(np.zeros(3), slab)


@pytest.mark.parametrize("seed", range(6))
def test_box_is_never_larger_than_the_axis_aligned_box(seed):
    """Surfaces of the boxes about five random triangles, within rounding."""
    triangles = np.random.default_rng(seed).normal(size=(5, 3, 3))
    _axes, lower, upper = fitted_box_of(triangles)
    aligned = surface_of(triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1)))
    assert surface_of(lower, upper) <= aligned * (1 + 1e-14)
