"""Each compiled search counts and finds what a plain recursive one does, complete, at the first hit, or cut short."""

import numpy as np
import pytest
from support.motions import KINDS, grid_plate
from support.shapes import rod_mesh
from support.slow_trees import (
    SCENES,
    SlowBoxes,
    assert_as_slow,
    box_corners,
    complete_first_hit_or_cut_short,
    corners_apart_along,
    each_scene,
    searched,
)  # fmt: skip

from cdcore.narrow.published_trees.box_trees import TREE_KINDS
from cdcore.narrow.tree_builder import build_tree
from cdcore.narrow.tree_stage import UNLIMITED

MESHES = {name: make(np.random.default_rng(5)) for name, make in KINDS.items()} | {"rod": rod_mesh().triangles}


def tree_of(corners, kind):
    return build_tree(corners, TREE_KINDS[kind].rule, TREE_KINDS[kind].leaf_faces)


each_kind = pytest.mark.parametrize("kind", TREE_KINDS)
each_mesh = pytest.mark.parametrize("name", MESHES)


class SlowAabb(SlowBoxes):
    def corners(self, a, b):
        ends = zip(self.trees, self.poses, (a, b), strict=True)
        return [box_corners(tree.centre[node], tree.axes[node], tree.half[node], *pose) for tree, pose, node in ends]

    def apart(self, a, b):
        return any(corners_apart_along(axis, *self.corners(a, b)) for axis in np.eye(3))

    def splits_first(self, a, b):
        first, second = (np.ptp(corners, axis=0).max() for corners in self.corners(a, b))
        return first >= second


class SlowObb(SlowBoxes):
    def children(self, side, node):
        first = self.trees[side].child[node]
        return [node] if first < 0 else [first, first + 1]

    def descend(self, a, b):
        if not self.ask_nodes(a, b):
            return
        if self.children(0, a) == [a] and self.children(1, b) == [b]:
            for i in range(self.trees[0].start[a], self.trees[0].stop[a]):
                for j in range(self.trees[1].start[b], self.trees[1].stop[b]):
                    self.ask_faces(i, j)
            return
        for first in reversed(self.children(0, a)):
            for second in reversed(self.children(1, b)):
                self.descend(first, second)


class SlowRapid(SlowBoxes):
    def splits_first(self, a, b):
        return self.trees[0].half[a].max() > self.trees[1].half[b].max()


class SlowSolid(SlowBoxes):
    edges = False

    def splits_first(self, a, b):
        return self.trees[0].half[a].max() >= self.trees[1].half[b].max()


SLOW = {"aabb": SlowAabb, "obb": SlowObb, "rapid-style": SlowRapid, "solid-style": SlowSolid}


@each_kind
@each_scene
@complete_first_hit_or_cut_short
def test_counts_and_faces_are_those_of_a_recursive_search(kind, scene, every, budget):
    assert_as_slow(scene, kind, SLOW[kind], every, budget)


def test_the_kept_axis_of_solid_ends_most_leaf_tests_and_what_gjk_leaves_open_is_asked_exactly():
    corners, poses = SCENES["ball and beaker"]()
    found, counts, _ = searched("solid-style", corners).search(0, 1, poses, every=True, budget=UNLIMITED)
    _, leaf, hits, steps, exact = counts.sum(axis=0).tolist()
    assert hits > 0.3 * leaf > 0
    assert 0 < len(found) <= exact <= 1.01 * len(found) + 2
    assert 0 < leaf - hits - exact <= steps


def faces_below(tree, node):
    """Rows of ``tree.corners`` in the leaves below a node."""
    return list(range(tree.start[node], tree.stop[node]))


@each_kind
@each_mesh
@pytest.mark.parametrize("scale", [1.0, 1e-200, 1e70])
def test_every_face_stands_in_one_leaf_and_every_box_holds_the_faces_below_it(kind, name, scale):
    corners = MESHES[name] * scale
    tree, depth = tree_of(corners, kind)
    leaves = [faces_below(tree, node) for node in np.flatnonzero(tree.child < 0)]
    most = TREE_KINDS[kind].leaf_faces
    assert sorted(np.concatenate(leaves)) == list(range(len(corners))) and max(map(len, leaves)) <= most
    assert most * 2 ** (depth - 1) >= len(corners) >= depth
    assert np.array_equal(tree.corners, corners[tree.number])
    size = np.abs(corners).max()
    for node in range(len(tree.child)) if kind != "aabb" else ():
        along = (tree.corners[faces_below(tree, node)].reshape(-1, 3) - tree.centre[node]) @ tree.axes[node].T
        assert (np.abs(along) <= tree.half[node] + 1e-14 * size).all()
        assert np.allclose(np.abs(along).max(axis=0), tree.half[node], rtol=1e-9, atol=1e-14 * size)
        assert tree.size[node] == tree.half[node].max()


def test_the_axes_of_rapid_do_not_depend_on_how_finely_a_surface_is_cut():
    """The covariance is of the surface: a plate of 2 faces, and the same plate cut into many, give one box."""
    coarse = np.array([[[0.0, 0, 0], [6, 0, 0], [6, 6, 0]], [[0, 0, 0], [6, 6, 0], [0, 6, 0]]])
    stretched = np.array([3.0, 1.0, 1.0])
    first, second = (tree_of(plate * stretched, "rapid-style")[0] for plate in (coarse, grid_plate(6)))
    assert np.allclose(np.abs(first.axes[0]), np.abs(second.axes[0]), atol=1e-9)
    assert np.allclose(first.half[0], [9.0, 3.0, 0.0], atol=1e-9)
    assert np.allclose(second.half[0], [9.0, 3.0, 0.0], atol=1e-9)


SMALL_FACE = np.array([[0.0, 0, 0], [0.01, 0, 0], [0, 0.01, 0]])


@pytest.mark.parametrize(
    ("kind", "places", "first_child"),
    [
        # in the middle of the longest side, at the median face, and in the middle where no cut separates the faces
        ("solid-style", [0.0, 0.1, 0.2, 0.3, 10.0], [0, 1, 2, 3]),
        ("aabb", [10.0, 0.3, 0.2, 0.1, 0.0], [3, 4]),
        ("solid-style", [0.0] * 4, [0, 1]),
        ("rapid-style", [0.0] * 4, [0, 1]),
        ("rapid-style", [0.0, 0.1, 0.2, 0.3, 10.0], [0, 1, 2, 3]),
    ],
)
def test_a_node_is_cut_where_its_row_says(kind, places, first_child):
    faces = SMALL_FACE + np.array(places)[:, None, None] * np.array([1.0, 0, 0])
    tree, _ = tree_of(faces, kind)
    assert sorted(tree.number[faces_below(tree, tree.child[0])]) == first_child
