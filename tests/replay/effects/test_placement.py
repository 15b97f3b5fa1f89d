import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.small_worlds import cube

from replay.effects.placement import centre_of_mass, margin_over
from replay.pipeline.engine import compute
from sessions import MeshData, Session
from sessions.model.scene import Scene, SceneBody, SceneEffect

STAMPS = np.arange(120) * 10_000_000
TIMES = STAMPS / 1e9
DOWN = np.maximum(-0.0005, 0.1 - 0.2 * TIMES)


def placed(heights, x=0.0, tilt=0.0, limit=30.0):
    scene = Scene(
        bodies=(SceneBody("cup"), SceneBody("top")),
        effects=(SceneEffect("placement", {"between": ["cup", "top"], "tilt_deg": limit}),),
    )
    place = np.zeros((120, 3))
    place[:, 0] = x
    half = 0.1 * (np.cos(np.radians(tilt)) + np.sin(np.radians(tilt)))
    place[:, 1] = 0.5 + half + heights
    turn = np.tile([0.0, 0.0, np.sin(np.radians(tilt) / 2), np.cos(np.radians(tilt) / 2)], (120, 1))
    poses = {"cup": (place, turn), "top": (np.zeros((120, 3)), np.tile([0.0, 0, 0, 1], (120, 1)))}
    session = Session.from_arrays(STAMPS, poses, {"cup": cube(0.2), "top": cube()}, scene)
    return compute(session, detectors=()).effects["placement"]


def test_a_thing_set_down_upright_is_placed_when_it_has_come_to_rest():
    run = placed(DOWN)
    (event,) = run.events
    assert (
        event.name == "placed" and 0.5 <= event.time <= 0.6 and event.values["tilt_deg"] == pytest.approx(0, abs=1e-6)
    )
    assert event.values["margin_m"] == pytest.approx(0.1, abs=0.01)
    assert run.frames_run < 75 and run.output.lanes["cup-top"][0].word == "rests"


def test_a_thing_that_overhangs_by_more_than_half_tips():
    (event,) = placed(DOWN, x=0.52).events
    assert event.name == "tipped" and event.values["margin_m"] < 0 and event.level == "warning"
    assert placed(DOWN, x=0.45).events[0].name == "placed"


def test_a_thing_that_lies_askew_is_tipped():
    assert placed(DOWN, tilt=40.0).events[0].name == "tipped"


def test_a_thing_that_slides_on_is_not_placed():
    assert placed(DOWN, x=np.where(TIMES < 0.5, 0.0, 0.2 * (TIMES - 0.5))).events == ()


def test_a_thing_above_its_support_costs_nothing():
    run = placed(DOWN + 0.2)
    assert run.events == () and run.frames_run == 0 and run.counters == {}


def test_the_centre_of_mass_of_a_box_is_its_middle_wherever_it_stands():
    box = cube(0.2)
    moved = MeshData(np.add(box.vertices, (5.0, -3.0, 1.0)), box.faces)
    assert np.allclose(centre_of_mass(moved), [5.0, -3.0, 1.0], atol=1e-12)


def test_an_open_sheet_has_the_centre_of_its_area():
    sheet = MeshData([[0, 0, 0], [2, 0, 0], [0, 0, 3.0], [2, 0, 3.0]], [[0, 1, 2], [1, 3, 2]])
    assert np.allclose(centre_of_mass(sheet), [1.0, 0.0, 1.5])


@given(st.floats(-0.4, 0.4), st.floats(-0.4, 0.4))
def test_the_margin_in_a_square_is_the_distance_to_its_nearest_side(x, z):
    square = np.array([[i, j] for i in (-0.5, 0.0, 0.5) for j in (-0.5, 0.5)])
    assert margin_over(np.array([x, z]), square) == pytest.approx(0.5 - max(abs(x), abs(z)), abs=1e-12)


def test_outside_a_hull_or_over_a_line_the_margin_is_not_positive():
    triangle = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    assert margin_over(np.array([1.0, 1.0]), triangle) < 0
    assert margin_over(np.array([0.5, 0.0]), triangle[:2]) <= 0 and margin_over(np.array([0.0, 0.0]), triangle[:1]) <= 0
