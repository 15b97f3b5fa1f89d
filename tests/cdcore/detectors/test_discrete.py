"""Discrete is right where it looks, believes its last look in between, and passes through what is thin."""

import numpy as np
import pytest
from support.shapes import ball_mesh, box_mesh, lab

from cdcore import Body, Motion, Verdict, create_detector, join
from cdcore.detectors.discrete import STAGES

BODIES = [Body("ball", ball_mesh(0.5)), Body("box", box_mesh())]


def along(xs, times):
    places = np.zeros((len(xs), 2, 3))
    places[:, 0, 0] = xs
    return Motion(times, places, np.tile(np.eye(3), (len(xs), 2, 1, 1)))


def looks(times, rate, block=None):
    """Frames that were looked at, told from a body whose verdict changes every frame."""
    xs = np.where(np.arange(len(times)) % 2 == 0, 0.9, 3.0)
    detector = create_detector("discrete", BODIES, rate_hz=rate)
    motion = along(xs, times)
    detection = detector.detect(motion) if block is None else join(detector.stream(motion.blocks(block)))
    return np.flatnonzero(detection.seconds["spheres"] > 0).tolist(), detection


@pytest.mark.parametrize("seed", range(3))
def test_at_every_frame_it_says_what_hybrid_says(seed):
    bodies, motion = lab(150, seed)
    hybrid = create_detector("hybrid", bodies).detect(motion, faces=True)
    discrete = create_detector("discrete", bodies).detect(motion, faces=True)
    assert discrete.digest == hybrid.digest
    assert discrete.faces_digest == hybrid.faces_digest
    assert discrete.work["held"] == 0


def test_a_quarter_of_the_rate_looks_at_every_fourth_frame():
    frames, detection = looks(np.arange(90) / 90, 22.5)
    assert frames == list(range(0, 90, 4))
    assert detection.work["looks"] == 23
    assert detection.work["held"] == 90 - 23


def test_stamps_rounded_to_nanoseconds_look_at_the_same_frames():
    times = np.round(np.arange(5400) / 90 * 1e9) / 1e9
    assert looks(times, 22.5)[0] == list(range(0, 5400, 4))


def test_a_look_is_the_first_frame_at_or_after_each_tick():
    rng = np.random.default_rng(0)
    times = 7.3 + np.cumsum(rng.uniform(0.002, 0.13, 300))
    rate = 10.0
    expected, tick = [0], np.floor(times[0] * rate)
    for frame in range(1, 300):
        if np.floor(times[frame] * rate) > tick:
            expected.append(frame)
            tick = np.floor(times[frame] * rate)
    assert looks(times, rate)[0] == expected
    assert looks(times, rate, block=7)[0] == expected


def test_a_verdict_stands_until_the_next_look():
    _, detection = looks(np.arange(12) / 90, 22.5)
    assert detection.verdict[:, 0].tolist() == [Verdict.CONTACT] * 12
    xs = [0.9] * 4 + [3.0] * 6
    late = create_detector("discrete", BODIES, rate_hz=22.5).detect(along(xs, np.arange(1, 11) / 90))
    assert late.verdict[:, 0].tolist() == [1] * 7 + [0] * 3


def test_a_fast_ball_passes_a_thin_plate_unseen_between_looks():
    plate = [Body("ball", ball_mesh(0.01)), Body("plate", box_mesh((0.002, 1, 1)))]
    times = np.arange(90) / 90
    xs = -0.4505 + 1.0 * times
    motion = along(xs, times)
    full = create_detector("discrete", plate).detect(motion).verdict[:, 0] == Verdict.CONTACT
    slow = create_detector("discrete", plate, rate_hz=7.5).detect(motion).verdict[:, 0] == Verdict.CONTACT
    assert full.sum() == 2
    assert not slow.any()


def test_a_look_without_a_pose_teaches_nothing():
    times = np.arange(12) / 90
    motion = along([0.9] * 4 + [3.0] * 8, times)
    valid = np.ones((12, 2), dtype=bool)
    valid[4:6, 0] = False
    blind = Motion(times, motion.translations, motion.rotations, valid)
    detection = create_detector("discrete", BODIES, rate_hz=22.5).detect(blind, faces=True)
    assert detection.verdict[:, 0].tolist() == [1] * 4 + [Verdict.NO_POSE] * 2 + [1] * 2 + [0] * 4
    assert detection.faces(6, 0).tolist() == detection.faces(0, 0).tolist()
    valid[:5] = False
    blind = Motion(times, motion.translations, motion.rotations, valid)
    verdict = create_detector("discrete", BODIES, rate_hz=22.5).detect(blind).verdict[:, 0]
    assert verdict.tolist() == [Verdict.NO_POSE] * 8 + [0] * 4


def test_faces_and_sections_stand_with_the_verdict_they_were_seen_with():
    times = np.arange(8) / 90
    motion = along([0.9, 0.91, 0.92, 0.93, 0.8, 0.81, 0.82, 0.83], times)
    detector = create_detector("discrete", BODIES, rate_hz=22.5)
    for detection in (detector.detect(motion, faces=True), join(detector.stream(motion.blocks(3), faces=True))):
        for frame in range(4):
            assert detection.faces(frame, 0).tolist() == detection.faces(0, 0).tolist()
            assert np.array_equal(detection.section(frame, 0), detection.section(0, 0))
        assert detection.faces(4, 0).tolist() != detection.faces(0, 0).tolist()
        assert len(detection.section(5, 0)) > 0


@pytest.mark.parametrize("rate", [None, 22.5, 31.0])
@pytest.mark.parametrize("block", [1, 7, 64])
def test_a_stream_says_what_the_whole_says_at_any_rate(rate, block):
    bodies, motion = lab(150)
    detector = create_detector("discrete", bodies, rate_hz=rate)
    whole, joined = detector.detect(motion, faces=True), join(detector.stream(motion.blocks(block), faces=True))
    assert joined.digest == whole.digest
    assert joined.faces_digest == whole.faces_digest
    assert joined.work == whole.work


def test_the_queries_follow_the_formula_frames_at_ticks_times_pairs_with_poses():
    bodies, motion = lab(180)
    detection = create_detector("discrete", bodies, rate_hz=22.5).detect(motion)
    known = motion.valid[:, detection.pairs[:, 0]] & motion.valid[:, detection.pairs[:, 1]]
    assert detection.work["pair_looks"] == known[::4].sum() == detection.work["sphere_tests"]


def test_seconds_are_spent_only_at_looks():
    _, detection = looks(np.arange(90) / 90, 22.5)
    assert set(detection.seconds) == set(STAGES)
    spent = sum(detection.seconds.values())
    assert (spent[::4] > 0).all()
    assert not np.delete(spent, np.arange(0, 90, 4)).any()
