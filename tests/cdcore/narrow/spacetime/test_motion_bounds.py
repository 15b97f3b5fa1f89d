"""A gap is kept by the bodies in truth, and the first unsafe frame is the first whose paths may close it."""

import numpy as np
import pytest
from support.eight_frames import EightFrames

from cdcore.kernels.compiling import kernel
from cdcore.narrow.spacetime.motion_bounds import first_unsafe, root_gap


@kernel
def gap_of(boxes_a, pose_a, boxes_b, pose_b, frame, pad):
    return root_gap(boxes_a, pose_a, boxes_b, pose_b, frame, pad)


@kernel
def unsafe_of(pose_a, pose_b, frame, stop, gap):
    return first_unsafe(pose_a, pose_b, frame, stop, gap)


@pytest.mark.parametrize("apart", [0.0, 3.0, 30.0])
def test_no_two_corners_are_nearer_than_the_gap(apart):
    scene = EightFrames(1)
    scene.poses[0].entries.reshape(15, -1)[[9, 12]] += apart
    for frame in range(8):
        gap = gap_of(scene.flat[0].boxes, scene.poses[0], scene.flat[1].boxes, scene.poses[1], frame, scene.pad)
        first, second = (world.reshape(-1, 3) for world in scene.world(frame))
        nearest = np.linalg.norm((first + np.array([apart, 0, 0]))[:, None] - second[None], axis=2).min()
        assert gap <= nearest
        assert apart < 30 or gap > 20


@pytest.mark.parametrize("gap", [1e-9, 0.05, 0.4, 2.0, 1e9])
def test_the_first_unsafe_frame_is_where_the_paths_reach_the_gap(gap):
    a, b = EightFrames(2).poses
    for frame in range(24):
        walked = (a.path - a.path[frame]) + (b.path - b.path[frame])
        reached = [h for h in range(frame + 1, 24) if walked[h] >= gap * (1 - 1e-9)]
        assert unsafe_of(a, b, frame, 24, gap) == (reached[0] if reached else 24)
