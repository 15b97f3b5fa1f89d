from time import sleep
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import t
from support.shapes import unrotated_motion

from replay.advice.timing import BATCH_FRAMES, LEAD_FRAMES, MEAN_LEVEL, Clock, LiveFrames, Timed, known
from replay.detection.sample_times import P99


class Sleepy:
    """Takes so long for every look and for every answer."""

    def __init__(self, seconds, online=True):
        self.seconds, self.online, self.looks = seconds, online, []

    def detect(self, motion):
        sleep(self.seconds)

    def live(self):
        return self

    def look(self, now):
        self.looks.append(len(now))
        sleep(self.seconds)


def test_timed_pass_queries_frames_in_order_with_clock_outside():
    """``whole`` answers all 12 frames at once in 24 ms: 2 ms each."""
    motion = unrotated_motion(np.zeros((12, 1, 3)))
    item, two, whole = Sleepy(seconds=0.001), Sleepy(seconds=0.003), Sleepy(seconds=0.024, online=False)
    requested = [Timed("", detector, motion) for detector in (item, two, whole)]
    first, second, third = LiveFrames(motion, 10_000).live_pass(requested)
    assert item.looks == two.looks == [1] * 12 and len(first) == len(second) == 12
    assert (first >= 0.001).all() and (second >= 0.003).all()
    assert not whole.looks and (third >= 0.002).all() and len(set(third)) == 1


def test_long_sessions_are_timed_in_even_blocks_without_time_jumps():
    """Five of 20 batches of frames are timed; all but the first are led up to by frames that are not."""

    class Long:
        def __len__(self):
            return 20 * BATCH_FRAMES

        def frames(self, start, stop):
            return range(start, stop)

    frames = LiveFrames(Long(), 5 * BATCH_FRAMES)
    assert frames.count == 5 * BATCH_FRAMES and len(frames.turns) == 5
    assert [len(lead) for lead, _ in frames.turns] == [0] + [LEAD_FRAMES] * 4
    (_, first), *_, (_, last) = frames.turns
    assert first[0].start == 0 and last[-1].stop == 20 * BATCH_FRAMES
    assert all(lead[-1].stop == requested[0].start for lead, requested in frames.turns[1:])
    assert LiveFrames(Long(), 10**9).count == 20 * BATCH_FRAMES and LiveFrames(Long(), -5).count == BATCH_FRAMES


def timed_detector(own, reference):
    """Seconds of a detector, stage by stage, and of the reference beside it."""
    rows = [[np.array(item, dtype=float) for item in each] for each in (own, reference)]
    return Timed("it", None, None, *rows)


def test_ratio_compares_equal_passes_and_single_pass_has_no_interval():
    """The machine slows down by 1 to 5 in seven passes; the detector takes twice the reference in each."""
    machine = [1.0, 3.0, 1.0, 2.0, 5.0, 1.0, 1.5]
    value, _, upper = timed_detector([[2 * slow] for slow in machine], [[slow] for slow in machine]).ratio(MEAN_LEVEL)
    assert value == pytest.approx(2.0) and upper < 2.2
    assert known(timed_detector([[2.0]], [[1.0]]).ratio(MEAN_LEVEL)) == [pytest.approx(2.0), None, None]


def test_interval_of_a_ratio_is_students_over_logarithms_of_passes():
    """Ratios of 1, 1.5 and 2.25 in three passes: mean and deviation of their logarithms are that of 1.5."""
    detector, step = timed_detector([[1.0], [1.5], [2.25]], [[1.0]] * 3), np.log(1.5)
    lower, upper = np.exp(t.interval(0.95, df=2, loc=step, scale=step / np.sqrt(3)))
    assert detector.ratio(MEAN_LEVEL) == pytest.approx([1.5, lower, upper])
    assert detector.ratio(MEAN_LEVEL, widened=3.0) == pytest.approx([1.5, lower / 3.0, 3.0 * upper])


@pytest.mark.parametrize(("level", "value"), [(MEAN_LEVEL, 1.5), (P99, 1.99)])
def test_interruption_in_a_single_pass_changes_no_price(level, value):
    """Seven passes of 400 frames that take 1 to 2 s; 3 % of the samples are 50 s longer."""
    own = np.tile(np.linspace(1.0, 2.0, 400), (7, 1))
    hit = np.random.default_rng(3).random((7, 400)) < 0.03
    middle, _, upper = timed_detector(own + 50 * hit, np.ones((7, 400))).ratio(level)
    assert middle == pytest.approx(value, abs=0.01) and upper < 1.1 * value


class Frames:
    """Gives each setting its time: the reference 2 ms, its twin so many times that, a setting 4 ms."""

    def __init__(self, ratios, compiles=lambda number: None):
        self.ratios, self.compiles, self.asked = ratios, compiles, 0

    def live_pass(self, asked, number):
        self.asked += 1
        self.compiles(self.asked)
        times = {"reference": 0.002, "twin": 0.002 * self.ratios[number], "one": 0.004}
        return [np.array([times[each.label]]) for each in asked]


def clock_after_passes(frames, compiled=None):
    """A clock that timed a setting and the twin of the reference in these passes, and that setting."""
    reference, twin, item = (Timed(name, detector=None, motion=None) for name in ("reference", "twin", "one"))
    clock = Clock(frames, reference, twin, compiled)
    for _ in frames.ratios:
        clock.time([item, twin])
    return clock, item


def test_repeated_setting_ties_by_widening_intervals():
    """``twin`` is the reference once more: times within 3 % are a tie, 1.4 times as long widens intervals by 1.4."""
    clock, item = clock_after_passes(Frames([1.0, 1.02, 0.97, 1.01, 0.99, 1.0, 1.03]))
    assert clock.as_json()["tie"] and clock.as_json()["widened"] == 1.0 and clock.as_json()["passes"] == 7
    assert clock.price(item, MEAN_LEVEL)[0] == pytest.approx(0.004) and item.passes == 7 == clock.twin.passes
    clock, item = clock_after_passes(Frames([1.4, 1.41, 1.39, 1.4, 1.4, 1.4, 1.4]))
    reported, price = clock.as_json(), clock.price(item, MEAN_LEVEL)
    assert not reported["tie"] and reported["widened"] == pytest.approx(1.4, rel=1e-3)
    _value, lower, upper = price / 0.004
    assert [lower, upper] == pytest.approx([1 / 1.4, 1.4], rel=1e-3)


def test_pass_that_compiled_a_kernel_is_repeated():
    """The second pass compiles for 5 s: it is made again, and its seconds are not counted as work."""
    compiled = SimpleNamespace(seconds=0.0)

    def compiles(number):
        if number == 2:
            compiled.seconds += 5.0

    frames = Frames([1.0, 1.0, 1.0], compiles)
    clock, item = clock_after_passes(frames, compiled)
    assert frames.asked == 4 and item.passes == 3
    assert 0.0 <= clock.at_work < 1.0 and 0.0 < clock.seconds < 60.0


@pytest.mark.parametrize(("rate_hz", "sampled"), [(None, 60), (90.0, 60), (30.0, 20), (6.0, 4), (0.5, 1)])
def test_p99_of_rate_covers_samples_and_mean_covers_frames(rate_hz, sampled):
    """60 frames at 90 Hz; frames that sample take 0.28 s, the others nothing."""
    motion = unrotated_motion(np.zeros((60, 1, 3)), np.arange(60) / 90)
    frames = LiveFrames(motion, 10_000)
    samples = frames.samples(rate_hz)
    assert samples.sum() == sampled and samples[0]
    clock = Clock(frames, Timed("reference", detector=None, motion=None), Timed("twin", detector=None, motion=None))
    item = timed_detector([np.where(samples, 0.28, 1e-6)] * 3, [np.full(60, 0.01)] * 3)
    item.rate_hz = rate_hz
    clock.twin.reference = item.reference
    clock.twin.own = item.reference
    assert clock.price(item, P99)[0] == pytest.approx(0.28)
    assert clock.price(item, MEAN_LEVEL)[0] == pytest.approx(0.28 * sampled / 60, rel=1e-3)


def test_rate_without_timed_sample_has_no_p99():
    """Two frames were timed, in neither of which a step at this rate falls."""
    own = timed_detector([[1.0, 2.0]] * 2, [[1.0, 1.0]] * 2)
    assert known(own.ratio(P99, samples=np.zeros(2, np.bool_))) == [None, None, None]
