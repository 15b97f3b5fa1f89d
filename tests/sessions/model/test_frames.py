import numpy as np
import pytest
from support.mcap_samples import assert_same_frames, random_frames

from sessions.model.frames import Frames, Status


def test_the_numbers_of_a_status_are_part_of_the_file_format():
    assert [(status.name, status.value) for status in Status] == [
        ("ABSENT", 0), ("VALID", 1), ("LOST", 2), ("HELD", 3), ("INTERPOLATED", 4),
    ]  # fmt: skip


def test_no_array_of_frames_can_be_written():
    frames = random_frames(0)
    for name in ("stamp_ns", "log_ns", "sample_ns", "position", "quaternion_xyzw", "status"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(frames, name)[0] = 1


@pytest.mark.parametrize("length", [1, 7, 50, 1000])
def test_blocks_joined_again_are_the_frames(length):
    frames = random_frames(0, absent=0.3)
    blocks = list(frames.blocks(length))
    assert all(len(block) == length for block in blocks[:-1]) and 0 < len(blocks[-1]) <= length
    assert_same_frames(Frames.join(blocks), frames)


def test_a_part_shares_memory_with_the_whole():
    frames = random_frames(0)
    part = frames.part(10, 20)
    assert len(part) == 10 and np.shares_memory(part.position, frames.position)
    assert part.stamp_ns.tolist() == frames.stamp_ns[10:20].tolist()


def test_no_frames_have_the_shapes_of_frames_and_no_block():
    none = Frames.empty(("a", "b"))
    assert len(none) == 0 and list(none.blocks(5)) == []
    assert_same_frames(Frames.join([none, none]), none)
    assert none.quaternion_xyzw.shape == (0, 2, 4)
