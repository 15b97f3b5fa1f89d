from time import sleep

import numpy as np
import pytest

from cdcore import detect_live
from replay.detection.detector_spec import parse_detector
from replay.detection.run_detector import make_detector
from replay.errors import TradeoffError
from replay.prepare.assemble import assemble
from replay.tradeoffs.timing import LEAD_FRAMES, TURN_FRAMES, Clock, LiveFrames, Passes, Timed, whole_pass


class Sleepy:
    """Wraps a detector, and takes longer in every look and every answer than it says itself."""

    def __init__(self, inner, seconds):
        self.inner, self.seconds, self.looks = inner, seconds, []

    def detect(self, motion, *, faces=False):
        sleep(self.seconds)
        return self.inner.detect(motion, faces=faces)

    def live(self):
        outer, session = self, self.inner.live()

        class Session:
            def look(self, now):
                outer.looks.append(len(now))
                sleep(outer.seconds)
                return session.look(now)

        return Session()


@pytest.fixture(scope="module")
def assembly(bumped):
    return assemble(bumped)


def timed(assembly, seconds, spec="exact"):
    detector = make_detector(parse_detector(spec), assembly, 0)
    digest = detector.detect(assembly.motion).digest
    return Timed(spec, Sleepy(detector, seconds), assembly.motion, digest=digest)


def test_a_live_pass_asks_one_frame_after_the_other_with_the_clock_outside(assembly):
    one, two = timed(assembly, 0.001), timed(assembly, 0.003, "discrete")
    first, second = LiveFrames(assembly.motion, 10_000).live_pass([one, two])
    assert one.detector.looks == two.detector.looks == [1] * 12 and len(first) == len(second) == 12
    assert (first >= 0.001).all() and (second >= 0.003).all()
    assert detect_live(two.detector.inner, assembly.motion).digest == two.digest


def test_of_too_many_frames_turns_spread_evenly_are_timed_and_a_jump_in_time_is_not():
    class Long:
        def __len__(self):
            return 20 * TURN_FRAMES

        def frames(self, start, stop):
            return range(start, stop)

    frames = LiveFrames(Long(), 5 * TURN_FRAMES)
    assert frames.count == 5 * TURN_FRAMES and len(frames.turns) == 5
    assert [len(lead) for lead, _ in frames.turns] == [0] + [LEAD_FRAMES] * 4
    assert frames.turns[0][1][0].start == 0 and frames.turns[-1][1][-1].stop == 20 * TURN_FRAMES
    assert all(lead[-1].stop == asked[0].start for lead, asked in frames.turns[1:])
    assert LiveFrames(Long(), 10**9).count == 20 * TURN_FRAMES and LiveFrames(Long(), -5).count == TURN_FRAMES


def test_another_answer_the_second_time_is_refused(assembly):
    one = timed(assembly, 0.0)
    one.digest = "other"
    with pytest.raises(TradeoffError, match="other verdicts the second time"):
        whole_pass([one])


def made(own, reference):
    return Passes([np.array(one, dtype=float) for one in own], [np.array(one, dtype=float) for one in reference])


def test_a_ratio_is_of_the_same_passes_and_a_slow_moment_falls_on_both():
    machine = [1.0, 3.0, 1.0, 2.0, 5.0, 1.0, 1.5]
    price = made([[2 * slow] for slow in machine], [[slow] for slow in machine]).ratio(0.5)
    assert price.value == pytest.approx(2.0) and price.precise
    lone = made([[2.0]], [[1.0]]).ratio(0.5)
    assert (lone.value, lone.low, lone.high) == (2.0, None, None) and not lone.precise


def test_an_interruption_in_one_pass_of_seven_is_in_no_price():
    random = np.random.default_rng(3)
    own = np.tile(np.linspace(1.0, 2.0, 400), (7, 1))
    hit = random.random((7, 400)) < 0.03
    price = made(own + 50 * hit, np.ones((7, 400))).ratio(0.99)
    assert price.value == pytest.approx(1.99, abs=0.01) and price.high < 2.1


def test_the_interval_holds_the_truth_in_most_samples_of_a_noisy_machine():
    random, held = np.random.default_rng(5), 0
    for _ in range(300):
        noise = np.exp(0.2 * random.standard_normal((2, 7, 1)))
        price = made(3.0 * noise[0], noise[1]).ratio(0.5)
        held += price.low <= 3.0 <= price.high
    assert held / 300 >= 0.9


def clocked(ratios):
    """A clock whose reference takes 2 ms, and its twin so many times that in each pass; a setting takes 4 ms."""
    reference, twin, one = (Timed(name, None, None) for name in ("reference", "twin", "one"))
    clock = Clock("live", lambda asked, number: [
        np.array([{"reference": 0.002, "twin": 0.002 * ratios[number], "one": 0.004}[each.label]]) for each in asked
    ], 0.99, reference, twin)  # fmt: skip
    for _ in ratios:
        clock.time([one, twin])
    return clock, one


def test_the_same_setting_twice_is_a_tie_and_the_clock_says_so():
    clock, one = clocked([1.0, 1.02, 0.97, 1.01, 0.99, 1.0, 1.03])
    assert clock.as_json()["tie"] and clock.as_json()["widened"] == 1.0 and clock.as_json()["passes"] == 7
    assert clock.price(one).value == pytest.approx(0.004) and len(one.live) == 7 == len(clock.twin)


def test_where_the_same_setting_twice_is_no_tie_every_interval_is_widened_until_it_is_one():
    clock, one = clocked([1.4, 1.41, 1.39, 1.4, 1.4, 1.4, 1.4])
    told, price = clock.as_json(), clock.price(one)
    assert not told["tie"] and told["widened"] == pytest.approx(1.4, rel=1e-4)
    ends = [end / 0.004 for end in (price.low, price.high)]
    assert ends == pytest.approx([1 / 1.4, 1.4], rel=1e-4)
    again = clock.price(clock._pair[1])
    assert again.low <= 0.002 * 1.0001 <= again.high * 1.0001
