"""Two trees and eight frames of two bodies that meet in some of them: what the kernels of a block are asked about."""

import numpy as np
from support.motions import motion_of, placed, soup

from cdcore.kernels.compiling import kernel
from cdcore.kernels.memory import integers_of
from cdcore.narrow.bvh.bounds import position_pad
from cdcore.narrow.bvh.box_tree import build_box_trees
from cdcore.narrow.bvh.pose_lanes import Tracks
from cdcore.narrow.bvh.traverse import fill_relative, largest_chord
from cdcore.narrow.bvh.tree_memory import DOUBLES, Pair, Scratch, TreeMemory, layout, pair_at
from cdcore.narrow.bvh.whole_motion import PairRows

ROOM = 4096


@kernel
def relative_of(row, relative, middle, squares):
    pair = pair_at(integers_of(row))
    fill_relative(pair.pose_a, pair.pose_b, 0 * len(row), relative)
    return largest_chord(relative, 4 + 0 * len(row), 8 + 0 * len(row), middle, squares)


def row_of_pair(trees, turn, move):
    """Trees and poses of two bodies, as given, as the kernels take them, and what must be kept while they do."""
    tracks, marks = Tracks(trees, np.arange(2), len(turn)), np.zeros((1, 3, len(turn)), dtype=np.uint8)
    tracks.lay_out(np.ones((len(turn), 2), dtype=bool))
    tracks.fill(turn, move)
    words = PairRows(trees, np.array([[0, 1]]), every=True).about(tracks, marks, 0, len(turn))
    pair = words.view(layout(Pair))[:, 0]
    for side, body in zip("ab", range(2), strict=True):
        pair[f"tree_{side}"] = trees[body].memory_row.view(layout(TreeMemory))
        pair[f"pose_{side}"] = tracks.rows[body]
    return words[0], (tracks, marks)


class EightFrames:
    """``apart``: metres by which the first body is moved along x; ``grains``: large faces, bunches of tiny ones."""

    def __init__(self, seed, size=0.3, apart=0.0, grains=False):
        rng = np.random.default_rng(seed)
        self.meshes = [soup(rng, 40, size), soup(rng, 60, size)]
        if grains:
            bunches = np.repeat(rng.uniform(-0.5, 0.5, (80, 1, 3)), 4, axis=0)
            self.meshes = [soup(rng, 4, 2.0), bunches + rng.normal(size=(320, 3, 3)) * 0.01]
        self.turn, self.move = motion_of("soup", rng, 24, 2)
        self.move[:, 0, 0] += apart
        self.trees = build_box_trees(self.meshes)
        self.row, self._kept = row_of_pair(self.trees, self.turn, self.move)
        self.pad = position_pad(sum(t.reach for t in self.trees) + np.linalg.norm(self.move, axis=2).max(0).sum(), 0.0)
        doubles, words = [np.empty(size) for size in DOUBLES], np.zeros(ROOM, dtype=np.int64)
        candidates = np.empty(256, np.int64)
        self.scratch = Scratch(
            *doubles,
            words,
            candidates,
            np.zeros(8, np.int64),
            words,
            words,
            words,
            words,
            keys_end=ROOM,
            later_end=ROOM,
        )
        self.relative, self.middle, self.candidates = (
            self.scratch.relative,
            self.scratch.middle,
            self.scratch.candidates,
        )
        self.chord = relative_of(self.row, self.relative, self.middle, np.empty(32))

    def world(self, frame):
        return [placed(mesh, self.turn[frame, k], self.move[frame, k]) for k, mesh in enumerate(self.meshes)]
