import numpy as np
import pytest


def in_flame(run):
    (effect,) = (effect for effect in run.session.scene.effects if effect.kind == "flame-test")
    lamp = np.array(run.session.scene.body("lamp").fixed.position)
    wick = lamp + np.array([0.0, WICK, 0.0])
    tip = run.pose("wire")[0] - wick
    height, radius = effect.settings["flame_height"], effect.settings["flame_radius"]
    inside = (tip[:, 1] >= 0.0) & (np.hypot(tip[:, 0], tip[:, 2]) <= radius * (1.0 - tip[:, 1] / height))
    return inside, effect


WICK = 0.0982


def test_the_tip_is_in_the_flame_exactly_in_the_stated_visits(made):
    run = made("flame-test")
    inside, _ = in_flame(run)
    edges = np.flatnonzero(np.diff(np.r_[0, inside.astype(int), 0]))
    visits = list(zip(run.times[edges[::2]], run.times[edges[1::2] - 1], strict=True))
    facts = run.facts("flame")
    assert len(visits) == len(facts) == 3
    step = np.diff(run.times).max()
    for (first, last), fact in zip(visits, facts, strict=True):
        assert first == pytest.approx(fact.start, abs=step)
        assert last == pytest.approx(fact.end, abs=step)


def test_a_colour_is_seen_when_the_visit_is_long_enough(made):
    run = made("flame-test")
    _, effect = in_flame(run)
    seen = {}
    for fact in run.facts("flame"):
        long_enough = fact.end - fact.start >= effect.settings["seconds"]
        assert bool(fact.values["seen"]) == long_enough
        seen[fact.values["salt"]] = fact.values["seen"]
    assert seen == {"NaCl": "yellow", "KCl": "", "CuSO4": "green"}


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


@pytest.mark.parametrize(("name", "before"), [("gas-collection", 80.0), ("silver-chloride", 30.0)])
def test_the_pour_agrees_with_the_poses(made, check_pour, name, before):
    run = made(name)
    (fact,) = run.facts("pour")
    check_pour(run, fact, before=before)


def test_gas_is_collected_while_the_tubes_end_is_inside_the_jar(made):
    run = made("gas-collection")
    (effect,) = (effect for effect in run.session.scene.effects if effect.kind == "gas")
    outlet = run.within("jar", run.point("tube", effect.settings["outlet"]))
    cavity = run.cavity("jar")
    inside = (np.hypot(outlet[:, 0], outlet[:, 2]) < cavity["opening_radius"]) & (outlet[:, 1] < cavity["opening"][1])
    inside &= outlet[:, 1] > cavity["floor"]
    (fact,) = run.facts("collect")
    step = np.diff(run.times).max()
    assert run.times[inside][0] == pytest.approx(fact.start, abs=step)
    assert run.times[inside][-1] == pytest.approx(fact.end, abs=step)
    between = run.near(fact.start + step, fact.end - step)
    assert inside[between].all()


def test_what_is_collected_follows_from_the_declared_rate(made):
    run = made("gas-collection")
    (fact,), (pour,) = run.facts("collect"), run.facts("pour")
    (reaction,) = (effect for effect in run.session.scene.effects if effect.kind == "reaction")
    zinc = run.session.scene.body("flask").extra["properties"]["solid"]
    acid = run.session.scene.body("acid").extra["properties"]["liquid"]
    moles = zinc["mass_g"] / 65.38
    # Zinc is the limiting reagent: two acid for one zinc.
    assert pour.values["volume_ml"] * 1e-3 * acid["molar"] > 2.0 * moles
    left = moles * np.exp(-reaction.settings["rate_per_s"] * (np.array([fact.start, fact.end]) - pour.start))
    assert fact.values["collected_mol"] == pytest.approx(left[0] - left[1])
    assert fact.values["leaked_before_mol"] == pytest.approx(moles - left[0])
