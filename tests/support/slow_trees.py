"""Plain recursive searches through hierarchies, to compare compiled ones with: same rules, other arithmetic."""

from contextlib import suppress
from functools import partial

import numpy as np
import pytest
from support.random_worlds import bodies_of
from support.shapes import ball_mesh, beaker_mesh, random_rotations, rod_mesh

from cdcore import triangles_intersect
from cdcore.narrow.published_trees.tree_descent import PairPoses
from cdcore.narrow.tree_stage import TreeSettings, TreeStage
from cdcore.numerics import place_points


class Enough(Exception):  # noqa: N818 - not an error
    """The budget is spent, or the first hit was all that was wanted."""


class SlowSearch:
    """Counts tests as a search goes down two trees; ``apart`` and ``splits_first`` are what a hierarchy adds."""

    def __init__(self, trees, *poses, every=True, budget=None):
        self.trees, self.poses = trees, poses
        self.world_a, self.world_b = (placed(tree.corners, *pose) for tree, pose in zip(trees, poses, strict=True))
        self.every, self.budget = every, budget
        self.node_tests = self.leaf_tests = 0
        self.truncated = False
        self.found = []

    def spend(self):
        if self.node_tests + self.leaf_tests == self.budget:
            self.truncated = True
            raise Enough

    def ask_nodes(self, a, b):
        self.spend()
        self.node_tests += 1
        return not self.apart(a, b)

    def ask_faces(self, face_a, face_b):
        self.spend()
        self.leaf_tests += 1
        if triangles_intersect([[self.world_a[face_a], self.world_b[face_b]]])[0]:
            self.found.append((int(self.trees[0].number[face_a]), int(self.trees[1].number[face_b])))
            if not self.every:
                raise Enough

    def descend(self, a, b):
        """Two children a node, one face a leaf; of two nodes that may meet one is split."""
        if not self.ask_nodes(a, b):
            return
        first_a, first_b = self.trees[0].child[a], self.trees[1].child[b]
        if first_a < 0 and first_b < 0:
            self.ask_faces(self.trees[0].start[a], self.trees[1].start[b])
        elif first_b < 0 or (first_a >= 0 and self.splits_first(a, b)):
            self.descend(first_a, b)
            self.descend(first_a + 1, b)
        else:
            self.descend(a, first_b)
            self.descend(a, first_b + 1)

    def run(self):
        with suppress(Enough):
            self.descend(0, 0)
        return self


class SlowBoxes(SlowSearch):
    """Over boxes that turn with their bodies, told apart with the products of their edges."""

    edges = True

    def box(self, side, node):
        tree = self.trees[side]
        return tree.centre[node], tree.axes[node], tree.half[node]

    def apart(self, a, b):
        return boxes_apart(self.box(0, a), self.poses[0], self.box(1, b), self.poses[1], edges=self.edges)


def placed(corners, turn, move):
    return place_points(corners.reshape(-1, 3), turn, move).reshape(-1, 3, 3)


def box_corners(centre, axes, half, turn, move):
    """World corners (8, 3) of a box whose axes are the rows of ``axes``."""
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    return (centre + (signs * half) @ axes) @ turn.T + move


def corners_apart_along(axis, corners_a, corners_b):
    a, b = corners_a @ axis, corners_b @ axis
    return a.min() > b.max() or b.min() > a.max()


def boxes_apart(box_a, pose_a, box_b, pose_b, *, edges):
    """Separating axes by projecting all corners in the world; with or without the products of edges."""
    corners_a, corners_b = box_corners(*box_a, *pose_a), box_corners(*box_b, *pose_b)
    normals_a, normals_b = box_a[1] @ pose_a[0].T, box_b[1] @ pose_b[0].T
    axes = [*normals_a, *normals_b]
    if edges:
        axes += [np.cross(u, v) for u in normals_a for v in normals_b]
    return any(corners_apart_along(axis, corners_a, corners_b) for axis in axes if np.linalg.norm(axis) > 1e-9)


def poses_near(first, second, spread, count=3, seed=0):
    """The corners of two meshes, and K poses of both about the origin."""
    rng = np.random.default_rng(seed)
    turn, move = random_rotations(rng, 2, count), rng.normal(size=(2, count, 3)) * spread
    poses = PairPoses(turn[0], move[0], turn[1], move[1], np.full(count, 1e-13))
    return (first.triangles, second.triangles), poses


SCENES = {
    "ball and beaker": partial(poses_near, ball_mesh(0.03, 5, 6), beaker_mesh(sides=8), 0.02),
    "rod and ball": partial(poses_near, rod_mesh(), ball_mesh(0.02, 5, 7), 0.01, seed=1),
}


def poses_of(poses, row):
    return (poses.turn_a[row], poses.move_a[row]), (poses.turn_b[row], poses.move_b[row])


each_scene = pytest.mark.parametrize("scene", SCENES)
complete_first_hit_or_cut_short = pytest.mark.parametrize(
    ("every", "budget"), [(True, None), (False, None), (True, 150), (False, 40), (True, 1)]
)


def searched(kind, corners):
    """Trees of a kind over two bodies."""
    return TreeStage(bodies_of(corners), np.array([[0, 1]]), kind, TreeSettings())


def assert_as_slow(scene, kind, slow, every, budget):
    """The compiled search gives counts, faces and truncation of the slow one, row by row."""
    corners, poses = SCENES[scene]()
    search = searched(kind, corners)
    limit = np.iinfo(np.int64).max if budget is None else budget
    found, counts, ended = search.search(0, 1, poses, every=every, budget=limit)
    hits = 0
    for row in range(len(poses.pad)):
        want = slow(search.trees, *poses_of(poses, row), every=every, budget=budget).run()
        assert counts[row, :2].tolist() == [want.node_tests, want.leaf_tests]
        assert bool(ended[row]) == want.truncated
        assert [tuple(r) for r in found[found[:, 0] == row, 1:].tolist()] == want.found
        hits += bool(want.found)
    assert hits or budget


def faces_below(tree, node):
    """Faces, by their number in the mesh, in the leaves below a node of a ``BoxTree``."""
    todo, found = [node], []
    while todo:
        child, leaf = tree.links[todo.pop()].tolist()
        if leaf >= 0:
            start, count = tree.leaves[leaf, :2].tolist()
            found.append(tree.faces[start : start + count])
        else:
            todo += [child, child + 1]
    return np.sort(np.concatenate(found)).astype(np.int64)
