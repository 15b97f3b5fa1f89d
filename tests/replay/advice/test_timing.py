"""The clock of a tradeoff: which frames it times, and ratios to the reference with their intervals."""

from time import sleep
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import t
from support.shapes import unrotated_motion

from replay.advice.timing import BATCH_FRAMES, LEAD_FRAMES, MEAN_LEVEL, Clock, LiveFrames, Timed, known
from replay.detection.sample_times import P99


class SleepingDetector:
    """A detector that takes so long for each frame, or, offline, for all at once; ``batches``: frames it was given."""

    def __init__(self, seconds, online=True):
        self.seconds, self.online, self.batches = seconds, online, []

    def detect(self, motion):
        sleep(self.seconds)

    def live(self):
        return self

    def look(self, now):
        self.batches.append(len(now))
        sleep(self.seconds)


def test_timed_pass_queries_each_detector_frame_by_frame():
    """A pass over 12 frames of two detectors that sleep 1 and 3 ms a frame: each is given one frame at a time."""
    motion = unrotated_motion(np.zeros((12, 1, 3)))
    quick, slow = SleepingDetector(seconds=0.001), SleepingDetector(seconds=0.003)
    requested = [Timed("", detector, motion) for detector in (quick, slow)]
    seconds_of_quick, seconds_of_slow = LiveFrames(motion, most=10_000).live_pass(requested)
    assert quick.batches == slow.batches == [1] * 12
    assert len(seconds_of_quick) == len(seconds_of_slow) == 12
    assert (seconds_of_quick >= 0.001).all()
    assert (seconds_of_slow >= 0.003).all()


def test_timed_pass_spreads_an_offline_answer_over_its_frames():
    """A detector that cannot run frame by frame answers all 12 at once in 24 ms: 2 ms each, all alike."""
    motion = unrotated_motion(np.zeros((12, 1, 3)))
    offline = SleepingDetector(seconds=0.024, online=False)
    (seconds,) = LiveFrames(motion, most=10_000).live_pass([Timed("", offline, motion)])
    assert offline.batches == []
    assert len(set(seconds)) == 1
    assert (seconds >= 0.002).all()


class MotionOf20Batches:
    """A motion whose frames are numbers."""

    def __len__(self):
        return 20 * BATCH_FRAMES

    def frames(self, start, stop):
        return range(start, stop)


def test_long_sessions_are_timed_in_even_blocks_without_time_jumps():
    """Five of 20 batches of frames of a motion may be timed: they are spread from the first frame to the last.

    A detector sees no jump in time: untimed frames lead up to each batch but the first.
    """
    frames = LiveFrames(MotionOf20Batches(), most=5 * BATCH_FRAMES)
    leads, timed = zip(*frames.turns, strict=True)
    assert frames.count == 5 * BATCH_FRAMES
    assert len(timed) == 5
    assert (timed[0][0].start, timed[-1][-1].stop) == (0, 20 * BATCH_FRAMES)
    assert [len(lead) for lead in leads] == [0] + [LEAD_FRAMES] * 4
    assert [lead[-1].stop for lead in leads[1:]] == [batch[0].start for batch in timed[1:]]


@pytest.mark.parametrize(
    ("most_frames", "timed_batches"), [pytest.param(10**9, 20, id="room for all"), pytest.param(-5, 1, id="no room")]
)
def test_number_of_timed_frames_is_between_a_batch_and_all(most_frames, timed_batches):
    """A motion of 20 batches of frames, of which ``most_frames`` may be timed."""
    assert LiveFrames(MotionOf20Batches(), most=most_frames).count == timed_batches * BATCH_FRAMES


def timed_detector(own, reference):
    """Seconds of a detector and of the reference beside it: of each pass, the frames."""
    own_passes, reference_passes = ([np.array(frames, dtype=float) for frames in passes] for passes in (own, reference))
    return Timed("it", None, None, own_passes, reference_passes)


def test_ratio_compares_equal_passes():
    """The machine is 1 to 5 times as slow as usual in seven passes; the detector takes twice the reference in each.

    Ratios of both in one pass do not vary, so the interval is narrow: it ends less than 10 % above 2.
    """
    slowness = [1.0, 3.0, 1.0, 2.0, 5.0, 1.0, 1.5]
    detector = timed_detector(own=[[2 * slow] for slow in slowness], reference=[[slow] for slow in slowness])
    ratio, _lower, upper = detector.ratio(MEAN_LEVEL)
    assert ratio == pytest.approx(2.0)
    assert upper < 1.1 * 2.0


def test_ratio_of_a_single_pass_has_no_interval():
    """The detector took 2 s, the reference 1 s; ``known`` gives None for a number that is not known."""
    detector = timed_detector(own=[[2.0]], reference=[[1.0]])
    assert known(detector.ratio(MEAN_LEVEL)) == [pytest.approx(2.0), None, None]


def test_interval_of_a_ratio_is_students_over_logarithms_of_passes():
    """Ratios of 1, 1.5 and 2.25 in three passes: their logarithms have the mean log 1.5 and the deviation log 1.5.

    The 95 % interval of Student's t, with 2 degrees of freedom, is that of SciPy.
    """
    detector = timed_detector(own=[[1.0], [1.5], [2.25]], reference=[[1.0]] * 3)
    log_step = np.log(1.5)
    lower, upper = np.exp(t.interval(0.95, df=2, loc=log_step, scale=log_step / np.sqrt(3)))
    assert detector.ratio(MEAN_LEVEL) == pytest.approx([1.5, lower, upper])


def test_widened_interval_reaches_a_factor_further_on_both_sides():
    """Intervals are widened by a factor, here 3, where a detector timed twice differs from itself so much."""
    detector = timed_detector(own=[[1.0], [1.5], [2.25]], reference=[[1.0]] * 3)
    ratio, lower, upper = detector.ratio(MEAN_LEVEL)
    assert detector.ratio(MEAN_LEVEL, widened=3.0) == pytest.approx([ratio, lower / 3.0, 3.0 * upper])


@pytest.mark.parametrize(
    ("level", "value"), [pytest.param(MEAN_LEVEL, 1.5, id="mean"), pytest.param(P99, 1.99, id="p99")]
)
def test_interruption_in_a_single_pass_changes_no_price(level, value):
    """Seven passes of 400 frames that take 1 to 2 s, evenly: 1.5 s in the mean, at most 1.99 s in 99 % of the frames.

    3 % of these times, at random (any seed), are 50 s longer; the reference takes 1 s a frame. A time above three times
    the median of its frame counts as that median, which is wrong only if four of seven passes are interrupted there.
    """
    seconds = np.tile(np.linspace(1.0, 2.0, 400), (7, 1))
    is_interrupted = np.random.default_rng(3).random((7, 400)) < 0.03
    detector = timed_detector(own=seconds + 50 * is_interrupted, reference=np.ones((7, 400)))
    ratio, _lower, upper = detector.ratio(level)
    assert ratio == pytest.approx(value, abs=0.01)
    assert upper < 1.1 * value


class PlannedFrames:
    """Passes with planned times: the reference takes 2 ms, its twin a ratio of that a pass, the setting "one" 4 ms."""

    def __init__(self, ratios, compiles=lambda number: None):
        self.ratios, self.compiles, self.passes = ratios, compiles, 0

    def live_pass(self, requested, number):
        self.passes += 1
        self.compiles(self.passes)
        times = {"reference": 0.002, "twin": 0.002 * self.ratios[number], "one": 0.004}
        return [np.array([times[each.label]]) for each in requested]


def clock_after_passes(frames, compiled=None):
    """A clock that timed the setting "one" and the twin of the reference in these passes, and that setting."""
    reference, twin, setting = (Timed(name, detector=None, motion=None) for name in ("reference", "twin", "one"))
    clock = Clock(frames, reference, twin, compiled)
    for _ in frames.ratios:
        clock.time([setting, twin])
    return clock, setting


def test_reference_timed_twice_within_3_percent_is_a_tie():
    """``twin`` is the reference once more, as a check of the clock: in seven passes it takes 0.97 to 1.03 of its time.

    Intervals stay as they are; the setting "one" takes 4 ms.
    """
    clock, setting = clock_after_passes(PlannedFrames([1.0, 1.02, 0.97, 1.01, 0.99, 1.0, 1.03]))
    check = clock.as_json()
    assert (check["tie"], check["widened"], check["passes"]) == (True, 1.0, 7)
    seconds, _lower, _upper = clock.price(setting, MEAN_LEVEL)
    assert seconds == pytest.approx(0.004)
    assert setting.passes == clock.twin.passes == 7


def test_reference_that_differs_from_itself_widens_all_intervals():
    """``twin`` is the reference once more, but takes 1.4 times as long, so that times are right to a factor of 1.4.

    The interval of the setting "one", 4 ms in each pass, is widened by that.
    """
    clock, setting = clock_after_passes(PlannedFrames([1.4, 1.41, 1.39, 1.4, 1.4, 1.4, 1.4]))
    check = clock.as_json()
    assert not check["tie"]
    assert check["widened"] == pytest.approx(1.4, rel=1e-3)
    _seconds, lower, upper = clock.price(setting, MEAN_LEVEL)
    assert [lower, upper] == pytest.approx([0.004 / 1.4, 1.4 * 0.004], rel=1e-3)


def test_pass_that_compiled_a_kernel_is_repeated():
    """In the second of three passes a kernel compiles for 5 s: that pass is made again, four in all.

    ``at_work``: seconds in which this program had the processor; ``seconds``: of the passes by the clock. Passes are
    planned, not timed, and take next to nothing; the 5 s of compiling are said, not spent.
    """
    compiled = SimpleNamespace(seconds=0.0)

    def compile_in_second_pass(number):
        if number == 2:
            compiled.seconds += 5.0

    frames = PlannedFrames([1.0, 1.0, 1.0], compile_in_second_pass)
    clock, setting = clock_after_passes(frames, compiled)
    assert frames.passes == 4
    assert setting.passes == 3
    assert 0.0 <= clock.at_work < 1.0
    assert 0.0 < clock.seconds < 60.0


@pytest.mark.parametrize(
    ("rate_hz", "sampled"),
    [
        pytest.param(None, 60, id="every frame"),
        pytest.param(90.0, 60, id="90 Hz, all"),
        pytest.param(30.0, 20, id="30 Hz, every third"),
        pytest.param(6.0, 4, id="6 Hz, every 15th"),
        pytest.param(0.5, 1, id="0.5 Hz, the first"),
    ],
)
def test_frames_sampled_at_a_rate_are_evenly_spaced(rate_hz, sampled):
    """A detector at this rate samples so many of 60 frames at 90 Hz, the first among them."""
    motion = unrotated_motion(np.zeros((60, 1, 3)), np.arange(60) / 90)
    samples = LiveFrames(motion, most=10_000).samples(rate_hz)
    assert samples[0]
    assert samples.sum() == sampled


@pytest.mark.parametrize(
    ("rate_hz", "sampled"),
    [
        pytest.param(None, 60, id="every frame"),
        pytest.param(30.0, 20, id="30 Hz, every third"),
        pytest.param(0.5, 1, id="0.5 Hz, the first"),
    ],
)
def test_p99_of_rate_covers_samples_and_mean_covers_frames(rate_hz, sampled):
    """60 frames at 90 Hz, of which so many are sampled at the rate; these take 0.28 s, the others nothing (1 us).

    99 of 100 samples take 0.28 s at most; the mean over all frames is a fraction of that.
    """
    motion = unrotated_motion(np.zeros((60, 1, 3)), np.arange(60) / 90)
    frames = LiveFrames(motion, most=10_000)
    clock = Clock(frames, Timed("reference", detector=None, motion=None), Timed("twin", detector=None, motion=None))
    seconds = np.where(frames.samples(rate_hz), 0.28, 1e-6)
    detector = timed_detector(own=[seconds] * 3, reference=[np.full(60, 0.01)] * 3)
    detector.rate_hz = rate_hz
    clock.twin.own = clock.twin.reference = detector.reference  # the check of the clock: alike
    p99, *_ = clock.price(detector, P99)
    mean, *_ = clock.price(detector, MEAN_LEVEL)
    assert p99 == pytest.approx(0.28)
    assert mean == pytest.approx(0.28 * sampled / 60, rel=1e-3)


def test_rate_without_timed_sample_has_no_p99():
    """Two passes of two frames, neither of which is a sample at some rate; ``known`` gives None for unknown numbers."""
    detector = timed_detector(own=[[1.0, 2.0]] * 2, reference=[[1.0, 1.0]] * 2)
    no_samples = np.zeros(2, np.bool_)
    assert known(detector.ratio(P99, samples=no_samples)) == [None, None, None]
