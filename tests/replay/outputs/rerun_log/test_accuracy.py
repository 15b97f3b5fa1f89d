"""Accuracy against cost: dots stand where their figures are, and no two names on one another."""

from dataclasses import replace
from itertools import combinations
from math import log10

import numpy as np
import pytest
from support.small_worlds import cubes

from replay.outputs.rerun_log.accuracy import HEIGHT, TOPS, half_width, placed_labels
from replay.outputs.rerun_log.texts import dots_of
from replay.tradeoffs.settings import Setting
from replay.tradeoffs.sweep import tradeoff


def test_dots_are_those_of_the_ranking_on_one_axis_of_cost(demo, read):
    dots, contacts = dots_of(demo)
    assert {one.name.partition(":")[0] for one in dots} == set(demo.detections) and contacts > 0
    panels = [
        np.array(read.column(f"accuracy/plot/{name}/dots", "Points2D:positions")[0][2]) for name in ("wrong", "false")
    ]
    assert np.allclose(panels[0][:, 0], panels[1][:, 0])
    ms = [one.ms for one in dots]
    for a, b in combinations(range(len(dots)), 2):
        if ms[a] != ms[b]:
            assert (panels[0][a, 0] < panels[0][b, 0]) == (log10(ms[a]) < log10(ms[b]))
    assert np.allclose(panels[1][:, 1], [TOPS[1] + HEIGHT * (1.0 - one.false) for one in dots], atol=1e-3)
    labels = read.column("accuracy/plot/wrong/words", "Points2D:labels")[0][2]
    for one in dots:
        assert any(
            text.startswith(one.name) and text.endswith(f", {one.wrong:.1f}".removesuffix(".0")) for text in labels
        )


@pytest.mark.parametrize("seed", range(5))
def test_names_stand_beside_their_dots_and_never_on_one_another(seed):
    random = np.random.default_rng(seed)
    dots = [(float(x), float(y)) for x, y in random.uniform((0, 60), (760, 360), (6, 2))]
    texts = [f"detector {k}: as it comes" for k in range(6)]
    places = placed_labels(dots, texts, (40.0, 360.0))
    for (place, text), (other, words) in combinations(zip(places, texts, strict=True), 2):
        apart = abs(place[0] - other[0]) >= half_width(text) + half_width(words) or abs(place[1] - other[1]) >= 28.0
        assert apart


def test_a_tradeoff_has_a_dot_for_each_setting_on_its_front_at_its_wrong_contacts_and_its_cost(demo):
    bumped = cubes({"a": [0] * 12, "b": [3, 1.3, 1.3, 3, 0.9, 3, 1.3, 1.3, 0.9, 0.8, 1.3, 3]})
    tried = tradeoff(bumped, settings=(Setting("exact", "exact"), Setting("balls", "sphere")))
    dots, contacts = dots_of(replace(demo, tradeoff=tried))
    rows = {row["label"]: row for row in tried.rows}
    assert tried.front and [one.name for one in dots] == list(tried.front) and contacts == tried.about["contacts"]
    for one in dots:
        row = rows[one.name]
        assert (one.ms, one.wrong) == (row["mean_ms"], row["missed"] + row["late"]) and one.false == row["false"]
