"""Each compiled search counts and finds what a plain recursive one does, complete, at the first hit, or cut short."""

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
    """The last two meshes are 20 faces in a point and a single huge face."""
    row, meshes = TREE_KINDS[kind], [*MESHES.values(), np.zeros((20, 3, 3)), grid_plate(size=1)[:1] * 1e70]
    for corners, (tree, depth) in zip(meshes, build_trees(meshes, row.rule, row.leaf_faces), strict=True):
        alone, its_depth = tree_of(corners, kind)
        assert depth == its_depth
        assert all(np.array_equal(*both) for both in zip(tree, alone, strict=True))


SCENES = {
    "ball and beaker": (ball_mesh(0.03, rings=5, sides=6), beaker_mesh(sides=8), 0.02, 0),
    "rod and ball": (rod_mesh(), ball_mesh(0.02, rings=5, sides=7), 0.01, 1),
}
"""Two meshes, how far from the origin they are, and a seed."""


def trees_and_search(kind, scene, *, every=True, budget=UNLIMITED):
    """Trees of a kind over two bodies, three poses of both about the origin, and what a search gives for these."""
    first, second, spread, seed = SCENES[scene]
    rng = np.random.default_rng(seed)
    rotation, move = random_rotations(rng, 2, 3), rng.normal(size=(2, 3, 3)) * spread
    stage = TreeStage(bodies_of([first.triangles, second.triangles]), np.array([[0, 1]]), kind, TreeSettings())
    poses = PairPoses(rotation[0], move[0], rotation[1], move[1], np.full(3, 1e-13))
    return (
        stage.trees,
        zip(rotation.swapaxes(0, 1), move.swapaxes(0, 1), strict=True),
        stage.search(0, 1, poses, every=every, budget=budget),
    )


@pytest.mark.sampled(6)
@each_kind
@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize(("every", "budget"), [(True, None), (False, None), (True, 150), (False, 40), (True, 1)])
def test_tree_search_counts_and_faces_equal_a_recursive_search(kind, scene, every, budget):
    """Every: all pairs of faces or the first; budget: at most so many tests of nodes and leaves."""
    trees, poses, (result, counts, ended) = trees_and_search(kind, scene, every=every, budget=budget or UNLIMITED)
    hits = 0
    for row, (rotations, moves) in enumerate(poses):
        slow = SlowSearch(kind, trees, [*zip(rotations, moves, strict=True)], every=every, budget=budget)
        assert counts[row, :2].tolist() == [slow.node_tests, slow.leaf_tests]
        assert bool(ended[row]) == slow.truncated
        assert [tuple(faces) for faces in result[result[:, 0] == row, 1:].tolist()] == slow.result
        hits += bool(slow.result)
    assert hits or budget


def test_cached_axis_ends_many_leaf_tests_of_solid():
    """``hits`` of the ``leaf`` tests end by the axis kept from before; meeting faces and few others need an exact test.

    The rest are separated by GJK, in one step or more each.
    """
    result, counts, _ = trees_and_search("solid-style", "ball and beaker")[2]
    _, leaf, hits, steps, exact = counts.sum(axis=0).tolist()
    assert hits > 0.3 * leaf > 0
    assert 0 < len(result) <= exact <= 1.01 * len(result) + 2
    assert 0 < leaf - hits - exact <= steps


def faces_below(tree, node):
    """Rows of ``tree.corners`` in the leaves below a node."""
    return list(range(tree.start[node], tree.stop[node]))


@pytest.mark.sampled(3)
@each_kind
@each_mesh
@pytest.mark.parametrize("scale", [1.0, 1e-200, 1e70])
def test_every_face_is_in_a_leaf_inside_its_boxes(kind, name, scale):
    """Also at scales where products of coordinates overflow or underflow; boxes fit to 1e-9 (``aabb`` is left out).

    A tree of some depth has at most 2^(depth - 1) leaves.
    """
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


def test_rapid_axes_do_not_depend_on_tessellation():
    """The covariance is of the surface: a plate of 18 x 6 m in 2 faces, and the same in many, have one box."""
    coarse = np.array([[[0.0, 0, 0], [6, 0, 0], [6, 6, 0]], [[0, 0, 0], [6, 6, 0], [0, 6, 0]]])
    stretched = np.array([3.0, 1.0, 1.0])
    first, second = (tree_of(plate * stretched, "rapid-style")[0] for plate in (coarse, grid_plate(size=6)))
    assert np.allclose(np.abs(first.axes[0]), np.abs(second.axes[0]), atol=1e-9)
    assert np.allclose(first.half[0], [9.0, 3.0, 0.0], atol=1e-9)
    assert np.allclose(second.half[0], [9.0, 3.0, 0.0], atol=1e-9)


SMALL_FACE = np.array([[0.0, 0, 0], [0.01, 0, 0], [0, 0.01, 0]])


@pytest.mark.parametrize(
    ("kind", "positions", "first_child"),
    [
        # solid: middle of the longest side; aabb: median; rapid: mean; half of the faces where all lie in one place
        ("solid-style", [0.0, 0.1, 0.2, 0.3, 10.0], [0, 1, 2, 3]),
        ("aabb", [10.0, 0.3, 0.2, 0.1, 0.0], [3, 4]),
        ("solid-style", [0.0] * 4, [0, 1]),
        ("rapid-style", [0.0] * 4, [0, 1]),
        ("rapid-style", [0.0, 0.1, 0.2, 0.3, 10.0], [0, 1, 2, 3]),
    ],
)
def test_a_node_is_cut_where_its_row_says(kind, positions, first_child):
    """Small faces at ``positions`` on X; ``first_child``: numbers of those below the root's first child."""
    faces = SMALL_FACE + np.array(positions)[:, None, None] * np.array([1.0, 0, 0])
    tree, _ = tree_of(faces, kind)
    assert sorted(tree.number[faces_below(tree, tree.child[0])]) == first_child
