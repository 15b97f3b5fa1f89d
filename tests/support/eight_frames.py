"""Two trees and eight frames of two bodies that meet in some of them: what the kernels of a block are asked about."""

import numpy as np
from support.motions import motion_of, placed, soup

from cdcore.kernels.compiling import kernel
from cdcore.narrow.spacetime.bounds import position_pad
from cdcore.narrow.spacetime.box_tree import build_box_tree
from cdcore.narrow.spacetime.pose_lanes import pose_lanes
from cdcore.narrow.spacetime.traverse import fill_relative, largest_chord


@kernel
def relative_of(pose_a, pose_b, frame, relative, middle, scratch):
    fill_relative(pose_a, pose_b, frame, relative)
    return largest_chord(relative, 4 + 0 * frame, 8 + 0 * frame, middle, scratch)


ARRAYS = ("boxes", "links", "leaves", "placed", "picks", "corners", "boxed", "spans", "planes")


class EightFrames:
    def __init__(self, seed, size=0.3):
        rng = np.random.default_rng(seed)
        self.meshes = [soup(rng, 40, size), soup(rng, 60, size)]
        self.turn, self.move = motion_of("soup", rng, 24, 2)
        self.trees = [build_box_tree(mesh) for mesh in self.meshes]
        frames = np.arange(24)
        self.poses = [
            pose_lanes(self.turn, self.move, k, frames, tree.boxes[0], tree.reach) for k, tree in enumerate(self.trees)
        ]
        # kernels index every array as one row
        self.flat = [tree._replace(**{name: getattr(tree, name).ravel() for name in ARRAYS}) for tree in self.trees]
        a, b = self.poses
        self.pad = position_pad(sum(t.reach for t in self.trees) + a.size + b.size, a.skew + b.skew)
        self.relative, self.middle = np.empty(96), np.empty(9)
        self.chord = relative_of(a, b, 0, self.relative, self.middle, np.empty(32))

    def world(self, frame):
        return [placed(mesh, self.turn[frame, k], self.move[frame, k]) for k, mesh in enumerate(self.meshes)]
