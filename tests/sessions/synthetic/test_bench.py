from __future__ import annotations

import numpy as np
import pytest

from sessions.synthetic.bench import BENCH_TOP, STAND_M, Layout, Placed, standing, widest


@pytest.fixture(scope="module")
def layout():
    return Layout(
        {
            "bench": Placed("bench", moves=False),
            "glass": Placed("beaker_100", standing(0.1, -0.2), properties={"liquid": "water"}, tags=("hot",)),
            "hand": Placed("hand_left", options={"grip_radius": 0.02}, faces=800),
        },
        600,
    )


def test_what_stands_is_lifted_from_the_bench_by_a_tenth_of_a_millimetre(layout):
    base = layout.at("glass")[1] + layout.mesh("glass").bounds[0, 1]
    top = layout.mesh("bench").bounds[1, 1]
    assert base - top == pytest.approx(STAND_M, abs=1e-6)
    assert top == pytest.approx(BENCH_TOP)


def test_bodies_of_the_scene_carry_mass_cavity_tags_and_own_keys(layout):
    bench, glass, hand = layout.bodies()
    assert bench.fixed is not None and glass.fixed is None
    assert glass.extra["cavity"]["capacity_ml"] == 100.0
    assert 0.0 < glass.extra["cavity"]["floor"] < glass.extra["cavity"]["mark"] < 0.07
    assert glass.extra["properties"] == {"liquid": "water"} and "hot" in glass.tags and "glass" in glass.tags
    assert hand.extra["options"] == {"grip_radius": 0.02}
    assert (glass.extra["faces"], hand.extra["faces"]) == (600, 800)
    assert all(type(value) is float for value in glass.extra["cavity"]["lip"])
    assert 0.02 < glass.extra["mass"] < 0.05


def test_meshes_have_the_resolution_asked_for(layout):
    assert len(layout.mesh("glass").faces) == pytest.approx(600, rel=0.3)
    assert len(layout.mesh("hand").faces) == pytest.approx(800, rel=0.3)
    assert set(layout.meshes) == {"bench", "glass", "hand"}


def test_sites_and_levers_are_in_the_bodys_frame(layout):
    assert layout.site("hand", "grip").tolist() == [0.0, 0.0, 0.0]
    corner = widest(layout.mesh("glass"))
    assert corner == pytest.approx(np.hypot(0.0275, 0.07), rel=0.1)
    assert widest(layout.mesh("glass"), (0.0, 0.07, 0.0)) < corner
