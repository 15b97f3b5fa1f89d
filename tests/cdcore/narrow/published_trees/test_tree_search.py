"""Each compiled search counts and finds what a plain recursive one does, complete, at the first hit, or cut short."""

from typing import NamedTuple

import numpy as np
import pytest
from support.random_worlds import KINDS, bodies_of, grid_plate
from support.second_opinions import SlowSearch
from support.shapes import ball_mesh, beaker_mesh, random_rotations, rod_mesh

from cdcore.narrow.published_trees.tree_search import PairPoses
from cdcore.narrow.tree_builder import build_trees
from cdcore.narrow.tree_kinds import TREE_KINDS
from cdcore.narrow.tree_stage import UNLIMITED, TreeSettings, TreeStage

MESHES = {name: make(np.random.default_rng(5)) for name, make in KINDS.items()} | {"rod": rod_mesh().triangles}


def tree_of(corners, kind):
    """A published tree of this kind over triangles."""
    return build_trees([corners], TREE_KINDS[kind].rule, TREE_KINDS[kind].leaf_faces)[0]


each_kind = pytest.mark.parametrize("kind", [name for name, row in TREE_KINDS.items() if row.search])
each_mesh = pytest.mark.parametrize("name", MESHES)


@each_kind
def test_published_trees_built_together_equal_trees_built_singly(kind):
    """Soups of faces, a rod, 20 faces in a point and a single face of 1e70 m: all arrays of a tree, and its depth."""
    row, meshes = TREE_KINDS[kind], [*MESHES.values(), np.zeros((20, 3, 3)), grid_plate(size=1)[:1] * 1e70]
    together = build_trees(meshes, row.rule, row.leaf_faces)
    for corners, (tree, depth) in zip(meshes, together, strict=True):
        single_tree, single_depth = tree_of(corners, kind)
        assert depth == single_depth
        assert all(np.array_equal(array, other) for array, other in zip(tree, single_tree, strict=True))


SCENES = {
    "ball and beaker": (ball_mesh(0.03, rings=5, sides=6), beaker_mesh(sides=8), 0.02, 0),
    "rod and ball": (rod_mesh(), ball_mesh(0.02, rings=5, sides=7), 0.01, 1),
}
"""Two meshes, about how many metres from the origin they are, and a seed."""


class SearchOfThreePoses(NamedTuple):
    """Two trees, a search of them in three poses, and its answer.

    ``faces``: rows (pose, face, face) that meet; ``counts``: of tests by pose; ``stopped``: whether the budget ended
    it.
    """

    trees: list
    poses: list
    faces: np.ndarray
    counts: np.ndarray
    stopped: np.ndarray


def search_of_scene(kind, scene, *, every=True, budget=UNLIMITED):
    """The search of trees of a kind over two bodies, in three random poses of both about the origin."""
    first, second, spread, seed = SCENES[scene]
    rng = np.random.default_rng(seed)
    rotation, move = random_rotations(rng, 2, 3), rng.normal(size=(2, 3, 3)) * spread
    stage = TreeStage(bodies_of([first.triangles, second.triangles]), np.array([[0, 1]]), kind, TreeSettings())
    poses = PairPoses(rotation[0], move[0], rotation[1], move[1], np.full(3, 1e-13))
    poses_of_both = [[(rotation[body, k], move[body, k]) for body in (0, 1)] for k in range(3)]
    faces, counts, stopped = stage.search(0, 1, poses, every=every, budget=budget)
    return SearchOfThreePoses(stage.trees, poses_of_both, faces, counts, stopped)


@pytest.mark.sampled(6)
@each_kind
@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize(
    ("every", "budget"),
    [
        pytest.param(True, None, id="all pairs of faces"),
        pytest.param(False, None, id="the first pair"),
        pytest.param(True, 150, id="all pairs, at most 150 tests"),
        pytest.param(False, 40, id="the first pair, at most 40 tests"),
        pytest.param(True, 1, id="all pairs, at most one test"),
    ],
)
def test_tree_search_counts_and_faces_equal_a_recursive_search(kind, scene, every, budget):
    """Two bodies in three poses: the same tests of nodes and leaves, and the same faces in the same order.

    ``SlowSearch`` descends two trees by their kind's rule, recursively and in plain Python.
    """
    result = search_of_scene(kind, scene, every=every, budget=budget or UNLIMITED)
    poses_in_contact = 0
    for k, poses in enumerate(result.poses):
        slow = SlowSearch(kind, result.trees, poses, every=every, budget=budget)
        node_tests, leaf_tests, *_ = result.counts[k].tolist()
        assert (node_tests, leaf_tests) == (slow.node_tests, slow.leaf_tests), k
        assert bool(result.stopped[k]) == slow.truncated, k
        faces = result.faces[result.faces[:, 0] == k, 1:]
        assert [tuple(row) for row in faces.tolist()] == slow.result, k
        poses_in_contact += bool(slow.result)
    assert poses_in_contact > 0 or budget, "without a budget some pose is in contact"


def test_cached_axis_ends_many_leaf_tests_of_solid():
    """A leaf test of ``solid-style`` begins with the axis that separated two faces before: over 30 % end with that.

    Faces that meet, and at most 1 % more and two, need an exact test; GJK separates the others in a step or more each.
    The shares are bounds by trial, for a ball and a beaker in three poses.
    """
    result = search_of_scene("solid-style", "ball and beaker")
    _node_tests, leaf_tests, ended_by_cached_axis, gjk_steps, exact_tests = result.counts.sum(axis=0).tolist()
    assert ended_by_cached_axis > 0.3 * leaf_tests > 0
    assert 0 < len(result.faces) <= exact_tests <= 1.01 * len(result.faces) + 2
    assert 0 < leaf_tests - ended_by_cached_axis - exact_tests <= gjk_steps


def faces_below(tree, node):
    """Rows of ``tree.corners`` in the leaves below a node."""
    return list(range(tree.start[node], tree.stop[node]))


@pytest.mark.sampled(3)
@each_kind
@each_mesh
@pytest.mark.parametrize("scale", [1.0, 1e-200, 1e70])
def test_every_face_is_in_a_leaf(kind, name, scale):
    """Leaves have at most ``leaf_faces`` faces, also at scales at which products of coordinates overflow or underflow.

    ``number`` is which face of the mesh a row of corners is.
    """
    corners, most_faces = MESHES[name] * scale, TREE_KINDS[kind].leaf_faces
    tree, _depth = tree_of(corners, kind)
    leaves = [faces_below(tree, node) for node in np.flatnonzero(tree.child < 0)]
    assert sorted(np.concatenate(leaves)) == list(range(len(corners)))
    assert max(map(len, leaves)) <= most_faces
    assert np.array_equal(tree.corners, corners[tree.number])


@pytest.mark.sampled(3)
@each_kind
@each_mesh
@pytest.mark.parametrize("scale", [1.0, 1e-200, 1e70])
def test_tree_has_at_most_as_many_levels_as_faces(kind, name, scale):
    """Its faces fit into 2^(depth - 1) leaves, as many as a binary tree of that depth may have."""
    corners = MESHES[name] * scale
    _tree, depth = tree_of(corners, kind)
    assert depth <= len(corners) <= TREE_KINDS[kind].leaf_faces * 2 ** (depth - 1)


@pytest.mark.sampled(3)
@pytest.mark.parametrize("kind", [name for name, row in TREE_KINDS.items() if row.search and name != "aabb"])
@each_mesh
@pytest.mark.parametrize("scale", [1.0, 1e-200, 1e70])
def test_boxes_of_nodes_fit_their_faces(kind, name, scale):
    """The box of a node holds the corners below it, and fits them to 1e-9; its size is its longest half edge.

    So it is also at scales at which products of coordinates overflow or underflow. Boxes of ``aabb``, placed along the
    axes of the world, are left out.
    """
    corners = MESHES[name] * scale
    tree, _depth = tree_of(corners, kind)
    rounding = 1e-14 * np.abs(corners).max()
    for node in range(len(tree.child)):
        below = tree.corners[faces_below(tree, node)].reshape(-1, 3)
        along_axes = np.abs((below - tree.centre[node]) @ tree.axes[node].T)
        assert (along_axes <= tree.half[node] + rounding).all(), node
        assert np.allclose(along_axes.max(axis=0), tree.half[node], rtol=1e-9, atol=rounding), node
        assert tree.size[node] == tree.half[node].max(), node


def test_rapid_axes_do_not_depend_on_tessellation():
    """The covariance is of the surface: a plate of 18 x 6 m in 2 faces, and the same in 72, have one box.

    Half of its edges are 9, 3 and 0 m.
    """
    coarse = np.array([[[0.0, 0, 0], [6, 0, 0], [6, 6, 0]], [[0, 0, 0], [6, 6, 0], [0, 6, 0]]])
    fine = grid_plate(size=6)
    stretched = np.array([3.0, 1.0, 1.0])
    coarse_tree, fine_tree = (tree_of(plate * stretched, "rapid-style")[0] for plate in (coarse, fine))
    assert np.allclose(np.abs(coarse_tree.axes[0]), np.abs(fine_tree.axes[0]), atol=1e-9)
    assert np.allclose(coarse_tree.half[0], [9.0, 3.0, 0.0], atol=1e-9)
    assert np.allclose(fine_tree.half[0], [9.0, 3.0, 0.0], atol=1e-9)


SMALL_FACE = np.array([[0.0, 0, 0], [0.01, 0, 0], [0, 0.01, 0]])
"""A triangle of 1 cm."""


@pytest.mark.parametrize(
    ("kind", "positions", "first_child"),
    [
        pytest.param("solid-style", [0.0, 0.1, 0.2, 0.3, 10.0], [0, 1, 2, 3], id="solid: middle of the longest side"),
        pytest.param("aabb", [10.0, 0.3, 0.2, 0.1, 0.0], [3, 4], id="aabb: median"),
        pytest.param("rapid-style", [0.0, 0.1, 0.2, 0.3, 10.0], [0, 1, 2, 3], id="rapid: mean"),
        pytest.param("solid-style", [0.0] * 4, [0, 1], id="solid: half of faces that lie in one place"),
        pytest.param("rapid-style", [0.0] * 4, [0, 1], id="rapid: half of faces that lie in one place"),
    ],
)
def test_a_node_is_cut_where_its_row_says(kind, positions, first_child):
    """Faces of 1 cm at these x; ``first_child``: numbers of the faces below the root's first child."""
    faces = SMALL_FACE + np.array(positions)[:, None, None] * np.array([1.0, 0, 0])
    tree, _depth = tree_of(faces, kind)
    root = 0
    assert sorted(tree.number[faces_below(tree, tree.child[root])]) == first_child
