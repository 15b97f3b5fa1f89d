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
