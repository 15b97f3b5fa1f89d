"""Plain recursive searches through hierarchies, to compare compiled ones with: same rules, other arithmetic."""

from contextlib import suppress
from itertools import product

import numpy as np
from support.motions import placed

from cdcore import triangles_intersect

SIGNS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])


class Enough(Exception):  # noqa: N818 - not an error
    """The budget is spent, or the first hit was all that was wanted."""


class SlowSearch:
    """Goes down two trees of a kind by its rule, counts the tests, and keeps the faces that meet.

    Boxes are told apart by their corners in the world: along its axes (``aabb``), or along their own, without
    (``solid-style``) or with the products of their edges.
    """

    def __init__(self, kind, trees, poses, *, every=True, budget=None):
        self.kind, self.trees, self.poses = kind, trees, poses
        self.world = [placed(tree.corners, *pose) for tree, pose in zip(trees, poses, strict=True)]
        self.every, self.budget = every, budget
        self.node_tests = self.leaf_tests = 0
        self.truncated = False
        self.found = []
        with suppress(Enough):
            self.descend(0, 0)

    def spend(self):
        if self.node_tests + self.leaf_tests == self.budget:
            self.truncated = True
            raise Enough

    def descend(self, *nodes):
        self.spend()
        self.node_tests += 1
        if self.apart(nodes):
            return
        children = [self.children(tree, node) for tree, node in zip(self.trees, nodes, strict=True)]
        if not any(children):
            faces = [range(tree.start[node], tree.stop[node]) for tree, node in zip(self.trees, nodes, strict=True)]
            for i, j in product(*faces):
                self.ask_faces(i, j)
            return
        both = [some or [node] for some, node in zip(children, nodes, strict=True)]
        if self.kind == "obb":  # which splits both
            both = [some[::-1] for some in both]
        elif all(children):
            kept = 1 if self.splits_first(nodes) else 0
            both[kept] = [nodes[kept]]
        for pair in product(*both):
            self.descend(*pair)

    def children(self, tree, node):
        first = tree.child[node]
        return [] if first < 0 else [first, first + 1]

    def ask_faces(self, i, j):
        self.spend()
        self.leaf_tests += 1
        if triangles_intersect([[self.world[0][i], self.world[1][j]]])[0]:
            self.found.append((int(self.trees[0].number[i]), int(self.trees[1].number[j])))
            if not self.every:
                raise Enough

    def corners(self, nodes):
        """World corners (8, 3) of both boxes, whose axes are rows."""
        for tree, node, (turn, move) in zip(self.trees, nodes, self.poses, strict=True):
            yield (tree.centre[node] + (SIGNS * tree.half[node]) @ tree.axes[node]) @ turn.T + move

    def apart(self, nodes):
        axes = np.eye(3)
        if self.kind != "aabb":
            own = [
                tree.axes[node] @ turn.T for tree, node, (turn, _) in zip(self.trees, nodes, self.poses, strict=True)
            ]
            axes = np.concatenate(own)
            if self.kind != "solid-style":
                axes = np.concatenate([axes, *(np.cross(u, own[1]) for u in own[0])])
            axes = axes[np.linalg.norm(axes, axis=1) > 1e-9]
        a, b = (corners @ axes.T for corners in self.corners(nodes))
        return bool(((a.min(axis=0) > b.max(axis=0)) | (b.min(axis=0) > a.max(axis=0))).any())

    def splits_first(self, nodes):
        first, second = (tree.half[node].max() for tree, node in zip(self.trees, nodes, strict=True))
        if self.kind == "aabb":
            first, second = (np.ptp(corners, axis=0).max() for corners in self.corners(nodes))
        return first > second or (first == second and self.kind != "rapid-style")


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
