import re

import numpy as np

from replay.audit.outcome import Outcome
from replay.report.charts import LABEL, WIDTH, timeline, timing


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
        assert abs(float(x) - (LABEL + (WIDTH - LABEL) * share)) < 0.2


def test_every_miss_has_its_number(run):
    numbers = re.findall(r'class="miss">(\d+)<', timeline(run, "slow"))
    assert numbers == [str(miss.number) for miss in run.misses["slow"]]


def test_the_plot_names_each_detector_and_the_budget(run):
    text = timing(run)
    assert "slow, frame by frame" in text and "exact, mean of the whole motion" in text and "11.1 ms" in text
    assert timing(run) == text
