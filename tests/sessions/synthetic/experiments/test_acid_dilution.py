from __future__ import annotations

import numpy as np
import pytest

VOLUMES = {"acid": 40.0, "rinse": 60.0}


def test_pours_and_the_spill_agree_with_the_poses(made, check_pour):
    run = made("acid-dilution")
    left = dict(VOLUMES)
    poured = sorted([*run.facts("pour"), *run.facts("spill")], key=lambda fact: fact.start)
    assert [fact.kind for fact in poured] == ["pour", "pour", "spill", "pour"]
    for fact in poured:
        source = fact.values["source"]
        check_pour(run, fact, before=left[source])
        left[source] -= fact.values["volume_ml"]
        assert fact.values["left_ml"] == pytest.approx(left[source])


def test_water_into_acid_is_written_down_as_the_wrong_order(made):
    run = made("acid-dilution")
    (wrong,) = run.facts("wrong_order")
    last = max(run.facts("pour"), key=lambda fact: fact.start)
    assert (last.values["source"], last.values["target"]) == ("rinse", "acid")
    assert (wrong.start, wrong.end) == (last.start, last.end)


def test_the_dropped_beaker_falls_freely_and_breaks_at_the_speed_it_lands_with(made):
    run = made("acid-dilution")
    (drop,), (broken,) = run.facts("drop"), run.facts("break")
    height = run.pose("rinse")[0][:, 1]
    falling = run.near(drop.start + 0.012, drop.end)
    curve = np.polyfit(run.times[falling] - drop.end, height[falling], 2)
    assert curve[0] == pytest.approx(-9.80665 / 2.0, rel=1e-3)
    assert -curve[1] == pytest.approx(broken.values["speed_m_s"], rel=1e-3)
    assert broken.start == drop.end and broken.values["speed_m_s"] > broken.values["threshold_m_s"]
    assert height[run.times > drop.end + 0.02].max() < 0.9
    assert drop.values["height_m"] == pytest.approx(height[run.near(drop.start - 0.05, drop.start)][0] - 0.9, abs=1e-6)


def test_the_scene_threshold_is_the_one_in_the_truth(made):
    run = made("acid-dilution")
    (effect,) = (effect for effect in run.session.scene.effects if effect.kind == "breakage")
    (broken,) = run.facts("break")
    assert effect.settings["speed_m_s"] == broken.values["threshold_m_s"]
