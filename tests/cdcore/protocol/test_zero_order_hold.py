"""A sampled detector repeats its last answer between samples, and reports no contact before it has one."""

import numpy as np
import pytest
from support.shapes import ball_mesh, unrotated_motion

from cdcore import Body, Verdict, create_detector
from cdcore.protocol import detect_live
from cdcore.protocol.zero_order_hold import BEFORE_BLOCK, ZeroOrderHold, answering_samples, is_sampled

BALLS = [Body("a", ball_mesh(1.0)), Body("b", ball_mesh(1.0))]
FRAMES_PER_S = 10


def touching_balls(tracked):
    """A motion of two balls of radius 1 m, 1 m apart, at ten frames a second; b has poses where it is ``tracked``."""
    positions = np.zeros((len(tracked), 2, 3))
    positions[:, 1, 0] = 1.0
    valid = np.stack([np.ones(len(tracked), dtype=bool), tracked], axis=1)
    return unrotated_motion(positions, np.arange(len(tracked)) / FRAMES_PER_S, valid)


@pytest.mark.parametrize("live", [False, True], ids=["offline", "live"])
@pytest.mark.parametrize("name", ["discrete", "collider"])
def test_before_its_first_answer_a_sampled_detector_reports_no_contact(name, live):
    """Two balls touch all the time; 10 frames and 1 sample a second, in frames 0, 10 and 20.

    One ball has no pose in frames 0 to 2, so that sample 0 has no answer, and in frame 15.
    """
    tracked = np.arange(25) >= 3
    tracked[15] = False
    motion, detector = touching_balls(tracked), create_detector(name, BALLS, rate_hz=1.0)
    verdict = (detect_live(detector, motion) if live else detector.detect(motion)).verdict[:, 0]
    assert np.array_equal(verdict == Verdict.NO_POSE, ~tracked)
    assert (verdict[3:10] == Verdict.NOT_FOUND).all()
    assert (verdict[10:][tracked[10:]] == Verdict.CONTACT).all()


@pytest.mark.parametrize("name", ["discrete", "collider"])
def test_repeated_answers_across_blocks_equal_the_whole_motion(name):
    """Two balls touch in 25 frames, in blocks of five; samples are in frames 0, 10 and 20.

    One ball has no pose in frames 0 to 2: nothing is known until frame 10.
    """
    motion = touching_balls(tracked=np.arange(25) >= 3)
    blocks = [motion.frames(start, start + 5) for start in range(0, 25, 5)]
    answers = list(create_detector(name, BALLS, rate_hz=1.0).stream(blocks))
    whole = create_detector(name, BALLS, rate_hz=1.0).detect(motion)
    assert np.array_equal(np.concatenate([answer.verdict for answer in answers]), whole.verdict)
    assert Verdict.NOT_FOUND in whole.verdict


@pytest.mark.parametrize("seed", range(5))
def test_repeated_answer_comes_from_the_last_answered_sample(seed):
    """Some of 30 frames are sampled, and a sample answers some of four pairs, at random.

    By a plain loop: for each frame and pair the number of the last sample that answered it, else BEFORE_BLOCK.
    """
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
    """No samples and no frames of three pairs: an array of shape (0, 3)."""
    assert answering_samples(np.zeros((0, 3), dtype=bool), np.zeros(0, dtype=bool)).shape == (0, 3)


def test_answers_of_a_block_without_samples_are_from_before():
    """Two frames of three pairs, none of them sampled."""
    answering = answering_samples(np.zeros((0, 3), dtype=bool), np.zeros(2, dtype=bool))
    assert answering.tolist() == [[BEFORE_BLOCK] * 3] * 2


def sampled_frames(rate_hz, **offset):
    """Numbers of those of ten frames, a tenth of a second apart, that are sampled."""
    times = np.arange(10) / FRAMES_PER_S
    return [frame for frame in range(10) if is_sampled(times, frame, rate_hz, **offset)]


def test_samples_are_the_first_frame_and_those_at_ticks():
    """Twice a second from 0.2 s on: ticks are at 0.2 and 0.7 s, frames 2 and 7."""
    assert sampled_frames(rate_hz=2.0, offset_s=0.2) == [0, 2, 7]


def test_without_a_rate_every_frame_is_sampled():
    """Ten frames, and no sampling rate."""
    assert sampled_frames(rate_hz=None) == list(range(10))


def test_no_frames_have_no_samples():
    """A block without frames, at two samples a second."""
    assert len(ZeroOrderHold(pairs=1, rate_hz=2.0).sampled(np.zeros(0))) == 0


def test_repeated_answers_are_counted_where_poses_are_known():
    """Four frames of two pairs, sampled in frames 0 and 2; the second sample has no answer for pair 1.

    Pair 1 has no pose in frame 3. Of 8 frames of pairs 7 have poses, and 3 of these were answered by a sample: 4 repeat
    one.
    """
    sampled = np.array([True, False, True, False])
    answered, has_pose = np.array([[True, True], [True, False]]), np.ones((4, 2), dtype=bool)
    has_pose[3, 1] = False
    samples = np.array([[Verdict.CONTACT, Verdict.CONTACT], [Verdict.CLEAR, Verdict.NO_POSE]], dtype=np.uint8)
    verdict, counters = ZeroOrderHold(pairs=2, rate_hz=2.0).hold(samples, answered, sampled, has_pose)
    assert verdict[:, 0].tolist() == [Verdict.CONTACT, Verdict.CONTACT, Verdict.CLEAR, Verdict.CLEAR]
    assert verdict[:, 1].tolist() == [Verdict.CONTACT, Verdict.CONTACT, Verdict.CONTACT, Verdict.NO_POSE]
    assert counters == {"looks": 2, "held": 7 - 3}
