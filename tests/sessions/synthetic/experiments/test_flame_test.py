from __future__ import annotations

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


def test_every_visit_follows_a_dip_into_its_salt(made):
    run = made("flame-test")
    _, effect = in_flame(run)
    for fact in run.facts("flame"):
        before = max((dip for dip in run.facts("dip") if dip.end < fact.start), key=lambda dip: dip.end)
        (vessel,) = set(before.bodies) - {"wire"}
        assert effect.settings["dips"][vessel] == fact.values["salt"]


def test_dips_put_the_tip_into_the_beaker(made):
    run = made("flame-test")
    for dip in run.facts("dip"):
        (vessel,) = set(dip.bodies) - {"wire"}
        tip = run.within(vessel, run.pose("wire")[0])[run.near(dip.start + 0.05, dip.end - 0.05)]
        cavity = run.cavity(vessel)
        assert np.hypot(tip[:, 0], tip[:, 2]).max() < cavity["radius"]
        assert (tip[:, 1] > cavity["floor"]).all() and (tip[:, 1] < cavity["mark"]).all()
