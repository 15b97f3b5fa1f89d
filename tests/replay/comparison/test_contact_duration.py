"""How long contacts last, against closed forms; what step rates miss, against detectors of these rates."""

from dataclasses import replace

import numpy as np
import pytest
from support.analytic_cases import make_analytic
from support.small_worlds import cubes, verdict_column

from cdcore import Motion, create_detector
from replay.comparison.compare import compare
from replay.comparison.contact_counts import count_contacts
from replay.comparison.contact_duration import RATES_HZ, StepRates, contact_durations
from replay.comparison.episodes import episodes
from replay.comparison.look_phases import PHASES
from replay.comparison.tolerance import Tolerance
from replay.pipeline.engine import compute
from replay.prepare.assemble import assemble

FRAME_NS = 11_111_111
TOUCHED = {"a": [0.0] * 40, "b": [3, 0.9, 3, 0.9, 0.9, 3, 3, 0.9, 0.9, 0.9, 3, 0.9, 3, 3, *[0.9] * 12, *[3] * 8, 0.9, 3,
                                  1 - 1e-7, 3, 3, 0.9]}  # fmt: skip
"""Contacts of 1 to 12 frames, one that touches by a tenth of a micrometre, and one at the end."""


def audited(*rates, oracle="exact"):
    session = cubes(TOUCHED, step_ns=FRAME_NS)
    return compute(session, detectors=[f"discrete[rate_hz={rate}]" for rate in rates], oracle=oracle)


def rated(result, rate, phases):
    """The contacts that ``discrete`` misses where its ticks count from each of these seconds on."""
    bodies, motion, oracle = result.assembly.bodies, result.assembly.motion, result.detections[result.oracle]
    exact, detector = create_detector("exact", bodies), create_detector("discrete", bodies, rate_hz=rate)
    tolerance = Tolerance(result.assembly, lambda some: exact.detect(some, faces=True))
    missed = []
    for phase in phases:
        later = Motion(motion.times - phase, motion.translations, motion.rotations, motion.valid, linked=motion.linked)
        found = replace(detector.detect(later), times=motion.times)
        comparison = compare(found, oracle, within=tolerance.judge(found, oracle))
        missed.append(count_contacts(comparison, result.episodes[result.oracle]).missed)
    return missed


@pytest.mark.parametrize("oracle", ["exact", "continuous"])
def test_what_a_rate_misses_at_this_phase_is_what_its_detector_misses_in_the_headline(oracle):
    result = audited(*RATES_HZ, oracle=oracle)
    told = result.summary["dwell"]
    missed = [result.summary["audit"][label]["contacts_missed"] for label in result.comparisons]
    assert told["missed_at_this_phase"] == missed and len(set(missed)) > 2
    assert told["rates_hz"] == list(RATES_HZ) and told["contacts"] == len(result.episodes[oracle])


@pytest.mark.parametrize("rate", [10.0, 22.5, 72.0])
def test_the_mean_over_phases_is_that_of_detectors_whose_ticks_are_moved(rate):
    result = audited(90.0)
    first, *tried = rated(result, rate, [0.0, *((np.arange(PHASES) + 0.5) / PHASES / rate)])
    now, mean = result.dwell.rates.missed(rate)
    assert (now, mean) == (first, pytest.approx(np.mean(tried))) and len(set(tried)) > 1


@pytest.mark.parametrize("rate", [22.5, 50.0])
def test_a_detector_of_a_rate_is_scored_over_the_same_phases(rate):
    result = audited(rate)
    (label,) = result.phases
    tried = rated(result, rate, (np.arange(PHASES) + 0.5) / PHASES / rate)
    found, contacts = result.phases[label].shares()["contacts_missed"], len(result.episodes["exact"])
    told = result.summary["audit"][label]["offsets"]["contacts_missed"]
    assert told == {"smallest": min(tried), "largest": max(tried), "mean": sum(tried) / PHASES}
    assert found["count"] == sum(tried) and found["of"] == PHASES * contacts
    assert result.dwell.rates.missed(rate)[1] == pytest.approx(found["share"] * contacts)
    assert audited(rate, oracle="exact").summary["audit"][label]["phases"] == result.phases[label].shares()
    assert not compute(cubes(TOUCHED, step_ns=FRAME_NS), detectors="discrete").phases


def test_from_the_safe_rate_on_no_phase_misses_and_just_below_it_some_do():
    result = audited(90.0)
    safe = result.summary["dwell"]["none_missed_from_hz"]
    below, above = (rated(result, rate, np.arange(40) / 40 / rate) for rate in (0.95 * safe, 1.001 * safe))
    assert max(above) == 0 < max(below)


@pytest.mark.parametrize(("letters", "missed"), [("C.-C..", 0), ("..-C..", 1)])
def test_a_look_without_a_pose_keeps_the_answer_of_the_look_before(letters, missed):
    # looks at frames 0, 2 and 4: the second has no pose, so that the first still holds at the contact of frame 3
    seen = verdict_column(letters, step=1.0)
    rates = StepRates(seen, episodes(seen), lambda frames, columns: np.zeros(len(frames), dtype=bool), 0)
    assert rates.missed(0.5)[0] == missed


def test_no_rate_is_safe_for_a_contact_that_no_frame_shows():
    result = compute(
        cubes({"a": [0.0] * 6, "b": [3, 0.9, 3, 3, -3, -3]}),
        detectors="hybrid",
        oracle="swept=support.planted_stages:Swept",
    )
    told = result.summary["dwell"]
    assert told["none_missed_from_hz"] is None and told["expected_misses"][-1] == 1.0


@pytest.mark.parametrize("name", ["fast-ball", "ball-plate", "spinning-rod"])
def test_ends_between_frames_are_those_of_the_closed_form(name):
    session, truth = make_analytic(name, seconds=6.0)
    result = compute(session, detectors="exact", oracle="exact")
    dwell = contact_durations(result.assembly, result.detections["exact"], result.episodes["exact"])
    spans = [episode.nominal for episode in truth.episodes]
    # frames are joined by lines and even turns: within a frame a curved path differs by micrometres
    slack = {"fast-ball": 2e-6, "ball-plate": 2e-4, "spinning-rod": 1e-3}[name]
    assert len(dwell.seconds) > 3
    for begin, end, cut in zip(dwell.begin, dwell.end, dwell.open, strict=True):
        near = min(spans, key=lambda span: abs(span[0] - begin) + abs(span[1] - end))
        assert cut or (abs(near[0] - begin) < slack and abs(near[1] - end) < slack)


def test_a_contact_at_the_end_of_the_recording_is_cut_off():
    session = cubes({"a": [0.0] * 6, "b": [0.9, 3.0, 1.5, 0.5, 3.0, 0.9]}, step_ns=2_000_000_000)
    result = compute(session, detectors="exact", oracle="exact")
    dwell = contact_durations(result.assembly, result.detections["exact"], result.episodes["exact"])
    assert dwell.open.tolist() == [True, False, True]
    assert dwell.begin[1] == pytest.approx(5.0, abs=1e-6) and dwell.end[1] == pytest.approx(6.4, abs=1e-6)


def test_a_time_of_impact_is_where_a_contact_between_frames_begins():
    session = cubes({"a": [0.0] * 4, "b": [3.0, 3.0, -3.0, -3.0]})
    oracle = verdict_column("..C.", covers="intervals", toi={(2, 0): (0.01 + 1e-9 + 0.01 * 2 / 6, 0.0133334)})
    dwell = contact_durations(assemble(session), oracle, episodes(oracle))
    assert dwell.seconds[0] == pytest.approx(0.01 * 2 / 6, abs=1e-6)


def test_an_oracle_of_intervals_measures_what_one_of_instants_does_and_the_passes_it_cannot_see():
    session, truth = make_analytic("fast-ball", seconds=6.0)
    result = compute(session, detectors="slow=discrete[rate_hz=22.5]", oracle="continuous")
    dwell = result.dwell
    spans = [episode.nominal for episode in truth.episodes]
    assert len(dwell.seconds) == len(spans) and not dwell.open.any()
    assert np.allclose(np.stack([dwell.begin, dwell.end], axis=1), spans, atol=3e-6)
    told = result.summary["audit"]["slow"]
    assert {miss.cause for miss in result.misses["slow"]} <= {"between samples", "between frames"}
    assert told["causes"]["misses"]["between frames"] > 0 and told["between_frames"] != "not examined"
