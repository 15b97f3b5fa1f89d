from __future__ import annotations

import numpy as np
import pytest


def test_the_pour_agrees_with_the_poses(made, check_pour):
    run = made("silver-chloride")
    (fact,) = run.facts("pour")
    check_pour(run, fact, before=30.0)


def test_the_precipitate_is_what_the_poured_silver_binds(made):
    run = made("silver-chloride")
    (pour,), (solid,) = run.facts("pour"), run.facts("precipitate")
    moles = pour.values["volume_ml"] * 1e-3 * 0.1
    assert solid.values["moles"] == pytest.approx(moles)
    assert solid.values["mass_g"] == pytest.approx(moles * (107.868 + 35.45), rel=1e-4)
    assert solid.start == pour.start


def test_the_rod_circles_in_the_beaker_while_it_stirs(made):
    run = made("silver-chloride")
    (fact,) = run.facts("stir")
    stirring = run.near(fact.start + 1.0, fact.end - 1.0)
    tip = run.within("sodium-chloride", run.pose("rod")[0])[stirring]
    radius = np.hypot(tip[:, 0], tip[:, 2])
    assert np.median(radius) == pytest.approx(fact.values["radius_m"], abs=5e-4)
    turned = np.unwrap(np.arctan2(tip[:, 2], tip[:, 0]))
    times = run.times[stirring]
    rate = abs(turned[-1] - turned[0]) / (2.0 * np.pi) / (times[-1] - times[0])
    assert rate == pytest.approx(fact.values["turns_per_second"], rel=0.02)
    assert (tip[:, 1] > 0.01).all() and (tip[:, 1] < 0.03).all()


def test_near_misses_keep_their_clearance(made, verdicts):
    from dataclasses import replace

    from sessions import Session
    from sessions.model.track import Track

    run = made("silver-chloride")
    (fact,) = run.facts("near_miss")
    still = run.near(fact.start + 0.1, fact.end - 0.1)
    answers = []
    for nearer in (fact.values["clearance_m"] - 0.0005, fact.values["clearance_m"] + 0.0005):
        tracks = {}
        for name in ("hand-left", "sodium-chloride"):
            track = run.session.tracks[name]
            shift = np.array([0.0, 0.0, -nearer]) if name == "hand-left" else np.zeros(3)
            tracks[name] = Track(track.times_ns[still], track.positions[still] + shift, track.quaternions_xyzw[still])
        moved = Session.from_tracks(tracks, meshes=run.session.meshes)
        answers.append(verdicts(replace(moved), [("hand-left", "sodium-chloride")]).max())
    assert answers == [0, 1]
