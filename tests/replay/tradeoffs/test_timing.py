from dataclasses import replace
from time import sleep

import numpy as np
import pytest
from support.small_worlds import cubes

from cdcore import Verdict
from cdcore.protocol import FaceSets
from replay.base.constants import BUDGET_MS
from replay.comparison.tolerance import TAU
from replay.detection.detector_spec import parse_detector
from replay.detection.run_detector import make_detector
from replay.errors import TradeoffError
from replay.prepare.assemble import assemble
from replay.tradeoffs.scoring import Judge
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
    assert watched.sizes == [1] * 12 and detection.digest == inner.detect(assembly.motion).digest
    assert clock.frames.shape == (12,) and (clock.frames >= 0.002).all()
    assert clock.seconds == pytest.approx(clock.frames.sum())


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


@pytest.fixture(scope="module")
def assembly(bumped):
    return assemble(bumped)


def judged(assembly, spec, *, oracle="exact", faces=False, same_faces=True):
    judge = Judge(assembly, parse_detector(oracle), 0, TAU)
    detection = make_detector(parse_detector(spec), assembly, 0).detect(assembly.motion, faces=faces)
    return judge.figures(detection, same_faces=same_faces), detection, judge


def test_the_oracle_beside_itself_misses_and_invents_nothing(assembly):
    told, detection, judge = judged(assembly, "exact", faces=True)
    assert (told["both"], told["missed_pair_frames"], told["invented_pair_frames"]) == (3, 0, 0)
    assert (told["contacts"], told["contacts_missed"]) == (2, 0) == (len(judge.contacts), 0)
    assert told["face_recall"] == 1.0 and told["face_pairs_invented"] == 0
    assert told["face_pairs"] == told["face_pairs_listed"] == len(np.concatenate(
        [detection.face_sets.at(frame, 0) for frame in (4, 8, 9)]
    ))  # fmt: skip


def test_booleans_and_faces_of_one_detector_find_the_same_contacts(assembly):
    booleans, faces = (judged(assembly, "hybrid", faces=asked)[0] for asked in (False, True))
    of_faces = {"face_recall", "face_pairs", "face_pairs_listed", "face_pairs_invented"}
    assert {key: value for key, value in booleans.items() if key not in of_faces} == {
        key: value for key, value in faces.items() if key not in of_faces
    }
    assert all(booleans[key] is None for key in of_faces) and faces["face_recall"] == 1.0


def test_face_pairs_of_a_missed_frame_are_missed(assembly):
    _, detection, judge = judged(assembly, "exact", faces=True)
    verdict, sets = detection.verdict.copy(), detection.face_sets
    verdict[8, 0] = Verdict.CLEAR
    kept = [(frame, sets.at(frame, 0)) for frame in (4, 9)]
    blind = replace(
        detection, verdict=verdict, face_sets=FaceSets.from_lists([4, 9], [0, 0], [kept[0][1], kept[1][1][:5]])
    )
    told = judge.figures(blind)
    assert (told["missed_pair_frames"], told["face_pairs"]) == (1, sum(len(sets.at(frame, 0)) for frame in (4, 8, 9)))
    assert told["face_pairs_listed"] == len(kept[0][1]) + 5
    assert told["face_recall"] == told["face_pairs_listed"] / told["face_pairs"]


@pytest.mark.parametrize("how", [{"same_faces": False}, {"oracle": "continuous"}])
def test_faces_of_other_meshes_or_of_an_oracle_of_intervals_are_not_compared(assembly, how):
    told, _, _ = judged(assembly, "hybrid", faces=True, **how)
    assert told["face_recall"] is None is told["face_pairs"] and told["both"] > 0


def test_a_session_without_contact_is_refused():
    with pytest.raises(TradeoffError, match="nothing can be missed"):
        Judge(assemble(cubes({"a": [0, 0], "b": [3, 4]})), parse_detector("exact"), 0, TAU)
