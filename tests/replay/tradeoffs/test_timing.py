from time import sleep

import numpy as np
import pytest

from replay.base.constants import BUDGET_MS
from replay.detection.detector_spec import parse_detector
from replay.detection.run_detector import make_detector
from replay.prepare.assemble import assemble
from replay.tradeoffs.timing import Pass, figures, quantile, timed


class Sleepy:
    """Wraps a detector, and takes 2 ms longer in every frame than it says itself."""

    def __init__(self, inner, online):
        self.inner, self.online, self.sizes = inner, online, []

    def detect(self, motion, *, faces=False):
        self.sizes.append(len(motion))
        sleep(0.002 * len(motion))
        return self.inner.detect(motion, faces=faces)

    def stream(self, motions, *, faces=False):
        def slow():
            for motion in motions:
                self.sizes.append(len(motion))
                sleep(0.002)
                yield motion

        return self.inner.stream(slow(), faces=faces)


@pytest.mark.parametrize("name", ["discrete", "discrete[rate_hz=20]"])
def test_an_online_detector_gets_one_frame_after_the_other_and_answers_the_same(bumped, name):
    assembly = assemble(bumped)
    inner = make_detector(parse_detector(name), assembly, 0)
    watched = Sleepy(inner, online=True)
    detection, clock = timed(watched, assembly.motion, faces=False)
    # at once; the first frame, for what does not change; then frame by frame
    assert watched.sizes == [12, 1] + [1] * 12 and detection.digest == inner.detect(assembly.motion).digest
    assert clock.frames.shape == (12,) and (clock.frames >= 0.002).all() and clock.seconds >= 0.024


def test_the_clock_of_an_offline_detector_stands_outside(bumped):
    assembly = assemble(bumped)
    watched = Sleepy(make_detector(parse_detector("hybrid"), assembly, 0), online=False)
    _, clock = timed(watched, assembly.motion, faces=False)
    assert watched.sizes == [12] and clock.frames is None and clock.seconds >= 0.024


def test_a_frame_takes_what_its_quickest_pass_takes_and_no_late_frame_is_left_out():
    one, two = np.linspace(1e-3, 2e-3, 100), np.linspace(1e-3, 2e-3, 100)
    one[:5] = two[90:] = (BUDGET_MS + 1) / 1e3
    told = figures([Pass(float(each.sum()), each, 0.05) for each in (one, two)])
    assert told["p50_ms"] == pytest.approx(1.495, abs=0.01) and told["p99_ms"] == pytest.approx(1.99, abs=0.01)
    assert told["p99_all_ms"] == pytest.approx(BUDGET_MS + 1)
    assert told["over_share"] == pytest.approx(15 / 200) and told["over_low"] < 15 / 200 < told["over_high"]


def test_the_quickest_pass_counts_and_the_slowest_is_told():
    told = figures([Pass(seconds, np.full(10, seconds / 10), 0.05) for seconds in (0.3, 0.1, 0.2)])
    assert (told["seconds"], told["seconds_median"], told["seconds_high"]) == (0.1, 0.2, 0.3)
    assert told["processor_seconds"] == 0.05 and told["passes"] == 3


def test_the_same_frames_once_more_make_no_interval_narrower():
    frames = np.arange(1, 1001) * 1e-5
    once, thrice = (figures([Pass(float(frames.sum()), frames, 0.0)] * count) for count in (1, 3))
    for name in ("p50", "p95", "p99"):
        widths = [told[f"{name}_high"] - told[f"{name}_low"] for told in (once, thrice)]
        assert widths[1] == pytest.approx(widths[0], rel=0.1), name
    assert [once[key] for key in ("over_low", "over_high")] == [thrice[key] for key in ("over_low", "over_high")]


def test_offline_figures_have_no_quantiles():
    told = figures([Pass(2.0, None, 1.0), Pass(4.0, None, 1.5), Pass(3.0, None, 1.2)])
    assert (told["seconds"], told["seconds_median"], told["seconds_high"], told["passes"]) == (2.0, 3.0, 4.0, 3)
    assert told["p99_ms"] is None and told["over_share"] is None and told["processor_seconds"] == 1.0


def test_waiting_is_on_the_clock_and_not_in_the_processors_seconds(bumped):
    assembly = assemble(bumped)
    watched = Sleepy(make_detector(parse_detector("hybrid"), assembly, 0), online=False)
    timed(watched, assembly.motion, faces=False)
    _, clock = timed(watched, assembly.motion, faces=False)
    assert clock.processor < clock.seconds


def test_a_quantile_lies_in_its_interval_which_holds_the_truth_in_95_of_100_samples():
    random = np.random.default_rng(5)
    for level in (0.5, 0.95):
        held = 0
        for _ in range(400):
            middle, low, high = quantile(np.sort(random.random(300)), level)
            assert low <= middle <= high
            held += low <= level <= high
        assert 0.92 <= held / 400 <= 0.99
