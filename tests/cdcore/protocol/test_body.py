"""Bodies become pairs of numbers, in the order asked for; blocks of other bodies or out of order are refused."""

import numpy as np
import pytest
from support.shapes import box_mesh, motion_at_rest

from cdcore import Body
from cdcore.errors import InvalidPairError, InvalidPoseError
from cdcore.protocol import ZeroOrderHold, blocks_in_order, is_sampled, ordered_by_name, require_bodies, resolve_pairs

BODIES = [Body(name, box_mesh()) for name in ("table", "rod", "cup")]
"""Numbers 0, 1 and 2."""


def test_all_pairs_are_tested_when_pairs_is_omitted():
    """Three bodies are three pairs, one body is none."""
    assert resolve_pairs(BODIES, pairs=None).tolist() == [[0, 1], [0, 2], [1, 2]]
    assert resolve_pairs(BODIES[:1], pairs=None).shape == (0, 2)


@pytest.mark.parametrize(
    "pairs",
    [
        pytest.param([("cup", "table"), ("rod", "cup")], id="names"),
        pytest.param([[2, 0], [1, 2]], id="numbers"),
        pytest.param(np.array([[2, 0], [1, 2]]), id="array"),
        pytest.param([("cup", 0), (1, "cup")], id="mixed"),
    ],
)
def test_names_and_numbers_mean_the_same_and_keep_their_order(pairs):
    """Bodies are table (0), rod (1) and cup (2): cup and table, and rod and cup, are requested by name, by number, or
    by both.
    """
    resolved = resolve_pairs(BODIES, pairs)
    assert resolved.tolist() == [[2, 0], [1, 2]]
    assert resolved.dtype == np.int64


def test_empty_list_of_pairs_requests_no_pair():
    """Three bodies and an empty list: unlike ``None``, which requests all their pairs."""
    assert resolve_pairs(BODIES, []).shape == (0, 2)


def test_two_bodies_of_equal_name_are_refused():
    """Bodies are table, rod and cup, and a second one called rod."""
    table, rod, cup = BODIES
    with pytest.raises(InvalidPairError, match="used twice: rod"):
        resolve_pairs([table, rod, cup, Body("rod", box_mesh())], pairs=None)


def test_motion_needs_as_many_bodies():
    """A motion of three bodies, for a detector of three and of two."""
    motion = motion_at_rest(BODIES, np.zeros((3, 3)))
    require_bodies(motion, BODIES)
    with pytest.raises(
        InvalidPoseError, match=r"poses of 3 bodies, the detector has 2; give one column .*: table, rod"
    ):
        require_bodies(motion, BODIES[:2])


def test_blocks_pass_in_order_and_empty_blocks_do_not_count():
    """Six frames as blocks of two, none and four: blocks must follow each other, and an empty one is no gap."""
    motion = motion_at_rest(BODIES, np.zeros((3, 3)), frames=6)
    blocks = [motion.frames(0, 2), motion.frames(2, 2), motion.frames(2, 6)]
    assert [len(block) for block in blocks_in_order(blocks)] == [2, 0, 4]


def test_pairs_are_ordered_by_name_and_swaps_marked():
    """Table (0), rod (1) and cup (2): by name cup, rod, table; a pair whose bodies are exchanged for that is marked."""
    ordered, swapped = ordered_by_name(BODIES, np.array([[0, 1], [1, 0], [2, 1]]))
    assert ordered.tolist() == [[1, 0], [1, 0], [2, 1]]
    assert swapped.tolist() == [True, False, False]


def test_no_pairs_are_ordered_to_no_pairs():
    """An array of shape (0, 2)."""
    ordered, swapped = ordered_by_name(BODIES, np.zeros((0, 2), dtype=np.int64))
    assert ordered.shape == (0, 2)
    assert swapped.shape == (0,)


@pytest.mark.parametrize("rate_hz", [22.5, 50.0, 60.0, 72.0, 90.0])
def test_sampling_agrees_for_blocks_whole_and_single_frames(rate_hz):
    """300 frames 2 to 30 ms apart: whether each is sampled at this rate, asked as a whole, in two
    blocks, one by one.
    """
    times, cut = np.cumsum(np.random.default_rng(0).uniform(0.002, 0.03, 300)), 77
    whole, in_blocks = ZeroOrderHold(pairs=0, rate_hz=rate_hz).sampled(times), ZeroOrderHold(pairs=0, rate_hz=rate_hz)
    assert np.array_equal(np.concatenate([in_blocks.sampled(times[:cut]), in_blocks.sampled(times[cut:])]), whole)
    assert [is_sampled(times, frame, rate_hz) for frame in range(300)] == whole.tolist()


def test_full_rate_samples_every_frame_despite_rounded_stamps():
    """9,000 frames at 90 Hz, stamps rounded to nanoseconds; at 45 Hz every second frame is sampled,
    from the first on.
    """
    times = np.round(np.arange(9000) / 90, 9)
    assert ZeroOrderHold(pairs=0, rate_hz=90.0).sampled(times).all()
    at_half_the_rate = ZeroOrderHold(pairs=0, rate_hz=45.0).sampled(times)
    assert np.flatnonzero(at_half_the_rate).tolist() == list(range(0, 9000, 2))
