import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from replay.comparison.outcome import Outcome
from replay.outputs.report.charts import LABEL, LANE, RIGHT, STRETCH, WIDTH, lane_bars, timeline, timing


def test_every_stretch_of_an_outcome_is_a_bar_at_its_time(run):
    text = timeline(run, "slow")
    times, outcome = run.assembly.motion.times, run.comparisons["slow"].outcome
    starts = []
    for column in outcome.T:
        missed = column == Outcome.MISSED
        starts += np.flatnonzero(missed & ~np.concatenate([[False], missed[:-1]])).tolist()
    bars = re.findall(r'<rect x="([0-9.]+)"[^>]*><title>MISSED: ([0-9.]+) s', text)
    assert sorted(float(at) for _, at in bars) == sorted(round(float(times[k]), 3) for k in starts)
    for x, at in bars:
        share = (float(at) - times[0]) / (times[-1] - times[0])
        assert abs(float(x) - (LABEL + (WIDTH - RIGHT - LABEL) * share)) < 0.2


def test_one_pair_is_not_called_pairs(run):
    assert len(run.assembly.pairs) == 1 and "1 pair over" in timeline(run, "slow")


def test_every_miss_has_its_number(run):
    assert numbers_in(timeline(run, "slow")) == [miss.number for miss in run.misses["slow"]]


def numbers_in(text):
    boxes = [box.split("-") for box in re.findall(r'class="miss">([0-9-]+)<', text)]
    return [number for box in boxes for number in range(int(box[0]), int(box[-1]) + 1)]


def test_numbers_of_hundreds_share_boxes_that_stand_where_they_are_and_do_not_overlap(run):
    times, one = run.assembly.motion.times, run.misses["slow"][0]
    starts = np.linspace(times[0], times[-1], 400)
    made = tuple(replace(one, number=k, start=float(at), end=float(at)) for k, at in enumerate(starts, 1))
    text = timeline(replace(run, misses={"slow": made}), "slow")
    assert numbers_in(text) == list(range(1, 401))
    boxes = [(float(x), float(w)) for x, w in re.findall(r'<rect x="([0-9.]+)" y="24" width="([0-9.]+)"', text)]
    assert 10 < len(boxes) < 60 and all(a + w < b for (a, w), (b, _) in pairwise(boxes))
    assert all(x >= LABEL and x + w < WIDTH for x, w in boxes)


def test_a_flickering_lane_shows_shares_and_hides_no_miss():
    times = np.arange(5400) / 90
    outcome = np.full(5400, Outcome.BOTH, dtype=np.uint8)
    outcome[:2700:4] = Outcome.MISSED
    outcome[4000] = Outcome.MISSED
    bars = [
        (float(x), int(y), float(width), int(high), word)
        for x, y, width, high, word in re.findall(
            r'<rect x="([0-9.]+)" y="(\d+)" width="([0-9.]+)" height="(\d+)"[^>]*><title>(\w+)',
            "".join(lane_bars(outcome, times, 0)),
        )
    ]
    red = [bar for bar in bars if bar[4] == "MISSED"]
    quarter = sum(width for _, _, width, high, _ in red if high == round((LANE - 6) / 4))
    assert abs(quarter - (WIDTH - RIGHT - LABEL) / 2) < 60
    (lone,) = [bar for bar in red if bar[0] > LABEL + 0.6 * (WIDTH - RIGHT - LABEL)]
    assert lone[1:4] == (0, STRETCH, 1), "one frame of a stretch keeps a point of height"
    area = sum(width * high for _, _, width, high, _ in bars)
    assert area == pytest.approx((WIDTH - RIGHT - LABEL) // STRETCH * STRETCH * (LANE - 6)), (
        "every frame is in the lane once"
    )
    assert len(bars) < 300


def test_the_plot_names_each_detector_and_the_budget(run):
    text = timing(run)
    assert "slow, frame by frame" in text and "exact, mean of the whole motion" in text and "11.1 ms" in text
    assert timing(run) == text
