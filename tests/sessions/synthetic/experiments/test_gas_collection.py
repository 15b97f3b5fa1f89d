from __future__ import annotations

import numpy as np
import pytest


def test_the_pour_agrees_with_the_poses(made, check_pour):
    run = made("gas-collection")
    (fact,) = run.facts("pour")
    check_pour(run, fact, before=80.0)


def test_gas_is_collected_while_the_tubes_end_is_inside_the_jar(made):
    run = made("gas-collection")
    (effect,) = (effect for effect in run.session.scene.effects if effect.kind == "gas")
    outlet = run.within("jar", run.point("tube", effect.settings["outlet"]))
    cavity = run.cavity("jar")
    inside = (np.hypot(outlet[:, 0], outlet[:, 2]) < cavity["radius"]) & (outlet[:, 1] < cavity["opening"][1])
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
    moles = zinc["mass_g"] / zinc["molar_mass"]
    # Zinc is the limiting reagent: two acid for one zinc.
    assert pour.values["volume_ml"] * 1e-3 * acid["molar"] > 2.0 * moles
    left = moles * np.exp(-reaction.settings["rate_per_s"] * (np.array([fact.start, fact.end]) - pour.start))
    assert fact.values["collected_mol"] == pytest.approx(left[0] - left[1])
    assert fact.values["leaked_before_mol"] == pytest.approx(moles - left[0])


def test_the_jar_stays_overturned(made):
    run = made("gas-collection")
    (fact,) = run.facts("collect")
    up = run.point("jar", (0.0, 1.0, 0.0)) - run.pose("jar")[0]
    assert (up[:, 1] < -0.999).all()
    assert fact.start < fact.end
