"""A sampled detector keeps its last answer, and reports no contact before it has one."""

import numpy as np
import pytest
from support.shapes import ball_mesh, unrotated_motion

from cdcore import Body, Verdict, create_detector
from cdcore.protocol import detect_live
from cdcore.protocol.zero_order_hold import BEFORE_BLOCK, ZeroOrderHold, answering_samples, is_sampled

BALLS = [Body("a", ball_mesh(1.0)), Body("b", ball_mesh(1.0))]


def verdicts_of_touching_balls(name, live, tracked, rate_hz=1.0):
    """Two balls that touch throughout, of which b is ``tracked`` in some of ten frames a second."""
    positions = np.zeros((len(tracked), 2, 3))
    positions[:, 1, 0] = 1.0
    valid = np.ones((len(tracked), 2), dtype=bool)
    valid[:, 1] = tracked
    motion = unrotated_motion(positions, np.arange(len(tracked)) / 10.0, valid)
    detector = create_detector(name, BALLS, rate_hz=rate_hz)
    return (detect_live(detector, motion) if live else detector.detect(motion)).verdict[:, 0]


@pytest.mark.parametrize("live", [False, True], ids=["offline", "live"])
@pytest.mark.parametrize("name", ["discrete", "collider"])
def test_before_its_first_answer_a_sampled_detector_reports_no_contact(name, live):
    """10 frames and 1 sample a second: frame 0 has no pose, frames from 3 on have one, the next sample is frame 10."""
    tracked = np.arange(25) >= 3
    tracked[15] = False
    answer = verdicts_of_touching_balls(name, live, tracked)
    assert (answer == Verdict.NO_POSE).tolist() == (~tracked).tolist()
    assert (answer[3:10] == Verdict.NOT_FOUND).all()
    assert (answer[10:][tracked[10:]] == Verdict.CONTACT).all()


@pytest.mark.parametrize("name", ["discrete", "collider"])
def test_held_answers_across_blocks_equal_the_whole_motion(name):
    """Sampled once a second, a body without poses in its first sample has no answer to hold until the next."""
    tracked = np.arange(25) >= 3
    positions = np.zeros((25, 2, 3))
    valid = np.stack([np.ones(25, dtype=bool), tracked], axis=1)
    motion = unrotated_motion(positions, np.arange(25) / 10.0, valid)
    blocks = [motion.frames(start, start + 5) for start in range(0, 25, 5)]
    components = list(create_detector(name, BALLS, rate_hz=1.0).stream(blocks))
    whole = create_detector(name, BALLS, rate_hz=1.0).detect(motion)
    assert np.array_equal(np.concatenate([component.verdict for component in components]), whole.verdict)
    assert Verdict.NOT_FOUND in whole.verdict


@pytest.mark.parametrize("seed", range(5))
def test_held_answer_comes_from_the_last_answered_sample(seed):
    """Random samples in 30 frames answer four pairs now and then; expected: by a plain loop."""
    rng = np.random.default_rng(seed)
    sampled = rng.random(30) < 0.5
    answered = rng.random((sampled.sum(), 4)) < 0.4
    expected = np.full((30, 4), BEFORE_BLOCK)
    for pair in range(4):
        sample, last = -1, BEFORE_BLOCK
        for frame in range(30):
            if sampled[frame]:
                sample += 1
                last = sample if answered[sample, pair] else last
            expected[frame, pair] = last
    assert np.array_equal(answering_samples(answered, sampled), expected)


def test_block_without_frames_has_no_answering_sample():
    """No frames, and two frames of which none is sampled: their answers are from before the block."""
    assert answering_samples(np.zeros((0, 3), dtype=bool), np.zeros(0, dtype=bool)).shape == (0, 3)
    assert (answering_samples(np.zeros((0, 3), dtype=bool), np.zeros(2, dtype=bool)) == BEFORE_BLOCK).all()


def test_samples_are_the_first_frame_and_those_at_ticks():
    """Twice a second from 0.2 s on, of ten frames a second: the ticks are at 0.2 s and 0.7 s."""
    times = np.arange(10) / 10.0
    sampled = [frame for frame in range(10) if is_sampled(times, frame, 2.0, offset_s=0.2)]
    assert sampled == [0, 2, 7]
    assert all(is_sampled(times, frame, rate_hz=None) for frame in range(10))
    assert len(ZeroOrderHold(pairs=1, rate_hz=2.0).sampled(times[:0])) == 0


def test_kept_answers_are_counted_where_poses_are_known():
    """Samples at frames 0 and 2 of four; at the second, one of two pairs gives no answer; at last it has no pose.

    7 of 8 frames of pairs have poses, and 3 of them are answered by a sample: 4 repeat one.
    """
    sampled = np.array([True, False, True, False])
    answered, known = np.array([[True, True], [True, False]]), np.ones((4, 2), dtype=bool)
    known[3, 1] = False
    samples = np.array([[Verdict.CONTACT, Verdict.CONTACT], [Verdict.CLEAR, Verdict.NO_POSE]], dtype=np.uint8)
    verdict, counters = ZeroOrderHold(pairs=2, rate_hz=2.0).hold(samples, answered, sampled, known)
    assert verdict[:, 0].tolist() == [Verdict.CONTACT, Verdict.CONTACT, Verdict.CLEAR, Verdict.CLEAR]
    assert verdict[:, 1].tolist() == [Verdict.CONTACT, Verdict.CONTACT, Verdict.CONTACT, Verdict.NO_POSE]
    assert counters == {"looks": 2, "held": 7 - 3}
