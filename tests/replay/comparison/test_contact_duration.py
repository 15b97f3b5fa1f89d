"""Dwell and expected misses against closed forms and against phases that were tried out."""

import numpy as np
import pytest
from support.small_worlds import cubes, verdict_column

from replay.base.wilson import wilson
from replay.comparison.contact_duration import RATES_HZ, contact_durations, expected_misses, miss_probability, safe_rate
from replay.comparison.episodes import episodes
from replay.pipeline.engine import compute
from replay.prepare.assemble import assemble
from sessions.synthetic import make_analytic

PHASES = 1000


def tried(spans, step):
    """How many of 1,000 phases have no look within each span."""
    phases = (np.arange(PHASES) + 0.5) / PHASES * step
    misses = []
    for start, end in spans:
        first = phases + step * np.ceil((start - phases) / step)
        misses.append(int((first > end).sum()))
    return np.array(misses)


@pytest.mark.parametrize("rate", [22.5, 50.0, 60.0, 72.0, 90.0, 240.0])
def test_the_formula_is_within_the_interval_of_a_thousand_resampled_phases(rate):
    _, truth = make_analytic("fast-ball", seconds=10.0)
    spans = [episode.nominal for episode in truth.episodes]
    dwells = np.array([end - start for start, end in spans])
    misses = tried(spans, 1.0 / rate)
    assert (misses > 0).any() or rate == 240.0
    for count, share in zip(misses.tolist(), miss_probability(dwells, 1.0 / rate).tolist(), strict=True):
        low, high = wilson(count, PHASES)
        assert low <= share <= high
    assert expected_misses(dwells, rate) == pytest.approx(misses.sum() / PHASES, abs=len(spans) / PHASES)


def test_from_the_safe_rate_on_no_phase_misses_and_just_below_it_some_do():
    _, truth = make_analytic("fast-ball", seconds=10.0)
    spans = [episode.nominal for episode in truth.episodes]
    rate = safe_rate([end - start for start, end in spans])
    assert tried(spans, 0.999 / rate).sum() == 0 < tried(spans, 1.01 / rate).sum()
    assert safe_rate([0.1, 0.0]) is None and safe_rate([]) == 0.0


def test_the_thin_wall_of_the_hard_cases_gives_its_known_share():
    # a 5 mm cube through a 1 mm plate at 90 Hz: contact over 6 mm, 0 / 100 / 460 / 730 / 865 of 1,000 phases miss it
    shares = [float(miss_probability(0.006 / speed, 1 / 90)) for speed in (0.4, 0.6, 1.0, 2.0, 4.0)]
    assert np.round(np.array(shares) * 1000).astype(int).tolist() == [0, 100, 460, 730, 865]


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
    assert {miss.cause for miss in result.misses["slow"]} <= {"between looks", "between frames"}
    assert told["causes"]["misses"]["between frames"] > 0 and told["between_frames"] != "not examined"


def test_the_table_of_a_run_is_in_its_summary_and_falls_with_the_rate():
    session, _ = make_analytic("fast-ball", seconds=6.0)
    summary = compute(session, detectors="hybrid").summary
    told = summary["dwell"]
    assert told["rates_hz"] == list(RATES_HZ) and len(told["expected_misses"]) == len(RATES_HZ)
    assert all(a >= b for a, b in zip(told["expected_misses"], told["expected_misses"][1:], strict=False))
    assert told["contacts"] == summary["detectors"]["exact"]["contacts"]
    assert 1.0 / told["none_missed_from_hz"] == pytest.approx(told["shortest"])
