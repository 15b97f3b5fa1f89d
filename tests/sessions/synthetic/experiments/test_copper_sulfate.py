from __future__ import annotations

import numpy as np
import pytest


def test_the_dish_is_heated_while_it_stands_over_the_flame(made):
    run = made("copper-sulfate")
    (effect,) = (effect for effect in run.session.scene.effects if effect.kind == "heat")
    dish, lamp = run.pose("dish")[0], run.pose("lamp")[0]
    resting = np.r_[True, np.linalg.norm(np.diff(dish, axis=0), axis=1) == 0.0]
    over = (np.hypot(*(dish - lamp)[:, [0, 2]].T) < effect.settings["within"]) & resting & (dish[:, 1] > 1.0)
    (fact,) = run.facts("heat")
    step = np.diff(run.times).max()
    assert run.times[over][0] == pytest.approx(fact.start, abs=2.0 * step)
    assert run.times[over][-1] == pytest.approx(fact.end, abs=2.0 * step)


def test_the_burn_is_the_touch_of_the_dish(made):
    run = made("copper-sulfate")
    (burn,) = run.facts("burn")
    (episode,) = run.truth.of("dish", "hand-left")
    (effect,) = (effect for effect in run.session.scene.effects if effect.kind == "burn-exposure")
    assert (burn.start, burn.end) == episode.nominal
    assert burn.values["seconds"] == pytest.approx(burn.end - burn.start)
    assert burn.values["seconds"] > effect.settings["seconds"]
    assert burn.values["surface_c"] > effect.settings["threshold_c"]
    (heat,) = run.facts("heat")
    assert heat.start < burn.start < heat.end


def test_the_dish_stands_on_the_gauze_without_touching(made):
    run = made("copper-sulfate")
    (fact,) = run.facts("heat")
    dish = run.pose("dish")[0][run.near(fact.start + 0.1, fact.end - 0.1)]
    gauze = run.session.meshes["gauze"].bounds[1, 1] + run.session.scene.body("gauze").fixed.position[1]
    assert dish[:, 1].min() - gauze == pytest.approx(1e-4, abs=1e-4)
    assert dish[:, 1].min() > gauze
