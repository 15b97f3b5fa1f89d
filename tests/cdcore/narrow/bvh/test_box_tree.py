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


@by_mesh
def test_leaves_hold_every_face_once(name):
    """A node without children (``child`` < 0) is a leaf; below the root, node 0, are all faces."""
    tree = build_box_trees([MESHES[name]])[0]
    assert sorted(tree.faces.tolist()) == list(range(len(MESHES[name])))
    sizes = (tree.stop - tree.start)[tree.child < 0]
    assert sizes.sum() == len(MESHES[name])
    assert sizes.min() >= 1
    assert sizes.max() <= TREE_KINDS["exact"].leaf_faces
    assert faces_below(tree, node=0).tolist() == list(range(len(MESHES[name])))


@by_mesh
def test_boxes_cover_their_corners_to_a_few_roundings(name):
    """A box is a row of its centre (3), axes (9), half edges (3) and half diagonal.

    Corners may stand out by 40 roundings of the farthest corner's distance; 1e-300 is for points near zero.
    """
    triangles = MESHES[name]
    tree = build_box_trees([triangles])[0]
    half_ulp = 2**-53
    for node, box in enumerate(tree.boxes):
        centre, axes, half_edges, half_diagonal = box[:3], box[3:12].reshape(3, 3).T, box[12:15], box[15]
        assert np.abs(axes @ axes.T - np.eye(3)).max() < 4e-15, "axes of length 1, perpendicular"
        offset = (triangles[faces_below(tree, node)].reshape(-1, 3) - centre) @ axes.T
        assert (np.abs(offset) - half_edges).max() <= 40 * half_ulp * tree.reach + 1e-300
        assert half_diagonal == pytest.approx(np.linalg.norm(half_edges), rel=1e-15, abs=1e-300)


@by_mesh
def test_leaf_data_repeat_the_faces_in_their_frames(name):
    """Faces in the body's axes, about the middle of their box, and in the axes of the box."""
    triangles = MESHES[name]
    tree = build_box_trees([triangles])[0]
    leaf_nodes = np.flatnonzero(tree.child < 0)
    assert leaf_nodes.size
    for node in leaf_nodes:
        axes = tree.boxes[node, 3:12].reshape(3, 3).T
        for row in range(tree.start[node], tree.stop[node]):
            face = triangles[tree.faces[row]]
            assert np.array_equal(tree.placed[row].reshape(3, 4).T, face[[0, 1, 2, 0]])
            local, boxed = tree.corners[row].reshape(3, 3), tree.boxed[row].reshape(3, 3)
            assert np.array_equal(local, face - tree.boxes[node, :3])
            assert np.allclose(boxed, local @ axes.T, atol=1e-14 * (1 + np.abs(local).max()))
            assert np.array_equal(tree.spans[row].reshape(3, 2), np.stack([boxed.min(0), boxed.max(0)], axis=1))


def test_box_trees_built_together_equal_trees_built_singly():
    """All arrays are compared, but the last field, which is their addresses."""
    for triangles, tree in zip(MESHES.values(), build_box_trees([*MESHES.values()]), strict=True):
        alone = build_box_trees([triangles])[0]
        assert all(np.array_equal(*both) for both in zip(tree[:-1], alone[:-1], strict=True))


def fitted_box_of(triangles):
    """Axes (3, 3) of the root's box, and its extent (3, 2) along each of them."""
    box = build_box_trees([triangles])[0].boxes[0]
    axes, middle, half = box[3:12].reshape(3, 3).T, box[:3], box[12:15]
    return axes, np.stack([axes @ middle - half, axes @ middle + half], axis=1)


def surface_of(extent):
    """Half the surface of boxes (n, 2, 3)."""
    x, y, z = extent[:, 1] - extent[:, 0]
    return x * y + y * z + z * x


@pytest.mark.parametrize("seed", range(6))
def test_rotated_slab_is_fitted_along_its_own_axes(seed):
    """Extents of 6, 2 and 0.2 m before it was rotated: surface at most 1.3 times that of its own box."""
    rng = np.random.default_rng(seed)
    rotation = random_rotations(rng)
    triangles = (rng.uniform(-1, 1, (200, 3, 3)) * [3.0, 1.0, 0.1]) @ rotation.T
    axes, extent = fitted_box_of(triangles)
    assert np.abs(axes @ axes.T - np.eye(3)).max() < 2e-15
    along = triangles.reshape(-1, 3) @ axes.T
    assert np.allclose(along.min(0), extent[:, 0])
    assert np.allclose(along.max(0), extent[:, 1])
    assert surface_of(extent) < 1.3 * (6 * 2 + 6 * 0.2 + 2 * 0.2)


@pytest.mark.parametrize("seed", range(6))
def test_box_is_never_larger_than_the_axis_aligned_box(seed):
    """The surface is compared, of boxes about five random triangles."""
    triangles = np.random.default_rng(seed).normal(size=(5, 3, 3))
    lower, upper = triangles.min(axis=(0, 1)), triangles.max(axis=(0, 1))
    assert surface_of(fitted_box_of(triangles)[1]) <= surface_of(np.stack([lower, upper], axis=1)) * (1 + 1e-14)
