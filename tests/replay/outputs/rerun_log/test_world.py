"""Bodies stand where the motion has them, at every frame and at a touch between two."""

import numpy as np
import pytest

from cdcore.transforms.rigid import rotation_from_quaternion
from replay.outputs.rerun_log.scene import body_path


def test_poses_read_back_are_those_of_the_motion_at_every_frame(demo, read):
    motion = demo.assembly.motion
    for column, body in enumerate(demo.assembly.bodies):
        places = read.column(body_path(body.name), "Transform3D:translation")
        turns = read.column(body_path(body.name), "Transform3D:quaternion")
        frames = [row[1] for row in places]
        latest = np.searchsorted(frames, np.arange(len(motion)), side="right") - 1
        shown = np.array([row[2][0] for row in places])[latest]
        valid = motion.valid[:, column]
        assert np.allclose(shown[valid], motion.translations[valid, column], atol=1e-6)
        matrix = rotation_from_quaternion(np.array([row[2][0] for row in turns]))[latest]
        assert np.allclose(matrix[valid], motion.rotations[valid, column], atol=1e-6)


def test_at_a_touch_between_frames_the_bodies_stand_where_they_touch_until_the_next_frame(passed, passed_read):
    (miss,) = passed.misses["exact"]
    assert miss.touch is not None
    moment = 10_000_000 * miss.touch.frame + miss.touch.later_ns
    places = [
        passed_read.at_ns("world/b", "Transform3D:translation", ns)[0][0] for ns in (moment - 1, moment, 20_000_000)
    ]
    assert places == pytest.approx([0.06, 0.02, -0.06], abs=1e-4)
