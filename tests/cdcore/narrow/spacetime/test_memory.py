"""A row of addresses gives a tree's and a track's arrays under their names."""

import numpy as np
from support.eight_frames import ARRAYS, EightFrames

from cdcore.kernels.compiling import kernel, runtime_int
from cdcore.narrow.spacetime.memory import pose_memory, tree_memory


@kernel
def first_entries(row, at):
    tree = tree_memory(row, at)
    return (
        tree.boxes[3], runtime_int(tree.links[3]), runtime_int(tree.leaves[3]), runtime_int(tree.faces[3]),
        tree.placed[3], runtime_int(tree.picks[3]), tree.corners[3], tree.boxed[3], tree.spans[3], tree.planes[3],
    )  # fmt: skip


@kernel
def track(row, at):
    pose = pose_memory(row, at)
    return pose.entries[2], pose.stride, pose.step, pose.path[2], pose.ranges[2], pose.frames


def test_the_row_of_a_tree_gives_its_arrays_under_their_names():
    tree = EightFrames(0).trees[1]
    names = [*ARRAYS[:3], "faces", *ARRAYS[3:]]
    row = np.concatenate([np.zeros(5, dtype=np.int64), tree.row])
    assert first_entries(row, 5) == tuple(getattr(tree, name).ravel()[3] for name in names)


def test_the_row_of_a_track_gives_its_arrays_and_numbers():
    pose = EightFrames(0).poses[1]
    row = np.concatenate([np.zeros(3, dtype=np.int64), pose.row])
    wanted = pose.entries[2], pose.stride, pose.step, pose.path[2], pose.ranges[2], pose.frames
    assert track(row, 3) == wanted
