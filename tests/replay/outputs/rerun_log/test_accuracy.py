"""Accuracy against cost: dots stand where their figures are, and no two names on one another."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from support.small_worlds import cubes

from replay.outputs.plots import HIGH, LETTER, Axis, Dot, scatter
from replay.outputs.rerun_log.documents import dots_of
from replay.pipeline.gates import figure
from replay.tradeoffs.sweep import tradeoff


def test_dots_are_those_of_the_ranking_on_one_axis_of_cost(demo, read):
    dots = dots_of(demo)
    assert {dot.name.partition(":")[0] for dot, *_ in dots} == set(demo.detections)
    wrong, false = (
        np.array(read.column(f"accuracy/plot/{name}/dots", "Points2D:positions")[0][2]) for name in ("wrong", "false")
    )
    assert np.allclose(wrong[:, 0], false[:, 0]) and wrong[:, 1].max() < false[:, 1].min()
    for place, figures in ((wrong[:, 0], [dot.x for dot, *_ in dots]), (-false[:, 1], [share for _, share, _ in dots])):
        for a, b in combinations(range(len(dots)), 2):
            assert (place[a] < place[b]) == (figures[a] < figures[b])
    labels = read.column("accuracy/plot/wrong/words", "Points2D:labels")[0][2]
    assert {dot.name for dot, *_ in dots} <= set(labels)
    shares = {f"{dot.name.partition(':')[0]}: {figure(100 * share)} %" for dot, share, _ in dots}
    below = read.column("accuracy/plot/false/words", "Points2D:labels")[0][2]
    assert set() < {words for words in below if words.endswith(" %")} <= shares


@pytest.mark.parametrize("seed", range(5))
def test_names_stand_beside_their_dots_and_never_on_one_another(seed):
    random = np.random.default_rng(seed)
    dots = [Dot(f"detector {k}", float(x), float(y)) for k, (x, y) in enumerate(random.uniform(0.1, 9.0, (6, 2)))]
    plot = scatter(dots, "", "ms", Axis("wrong", [0, 5, 10]))
    names = [(words.at, LETTER * len(words.text)) for words in plot.words if words.dot >= 0]
    assert names
    for ((x, y), wide), ((other, below), broad) in combinations(names, 2):
        assert x + wide <= other or other + broad <= x or abs(y - below) >= HIGH


def test_a_tradeoff_has_a_dot_for_each_setting_on_its_front_at_its_wrong_contacts_and_its_cost(demo):
    bumped = cubes({"a": [0] * 12, "b": [3, 1.3, 1.3, 3, 0.9, 3, 1.3, 1.3, 0.9, 0.8, 1.3, 3]})
    tried = tradeoff(bumped, detectors={"exact": "exact", "balls": "sphere"})
    dots = dots_of(replace(demo, tradeoff=tried))
    rows = {row["label"]: row for row in tried.rows}
    assert tried.front and [dot.name.rpartition(": ")[0] for dot, *_ in dots] == list(tried.front)
    for dot, false, _ in dots:
        row = rows[dot.name.rpartition(": ")[0]]
        assert (dot.x, dot.y) == (row["mean_ms"], row["missed"] + row["late"]) and false == row["false"]
