import numpy as np
import pytest
from support.small_worlds import along_x, cube

from replay.effects.hazard_proximity import surface_points
from replay.pipeline.engine import compute
from sessions import Session
from sessions.mesh_data import MeshData
from sessions.model.scene import Scene, SceneBody, SceneEffect

NEAR, LEAVE = 0.2, 0.05


def run(places, rotation=(0.0, 0.0, 0.0, 1.0), **more):
    """Two unit cubes; the visitor's distance to the hazard is ``place - 1``."""
    settings = {"of": ["hand"], "hazard": "lamp", "distance": NEAR, "leave_by": LEAVE, **more}
    scene = Scene(bodies=(SceneBody("hand"), SceneBody("lamp")), effects=(SceneEffect("hazard-proximity", settings),))
    stamps = np.arange(len(places)) * 10_000_000
    poses = {"hand": along_x(places, rotation), "lamp": along_x([0.0] * len(places))}
    session = Session.from_arrays(stamps, poses, {"hand": cube(), "lamp": cube()}, scene)
    result = compute(session)
    assert not result.detections and len(result.assembly.pairs) == 0
    return result.effects["hazard-proximity"]


def test_near_begins_below_the_distance_and_ends_above_it_by_the_hysteresis():
    (event,) = run([3, 1.3, 1.19, 1.1, 1.22, 1.19, 1.24, 1.26, 3]).events
    assert (event.time, event.end) == pytest.approx((0.02, 0.07))
    assert event.values["least_m"] == pytest.approx(0.1) and event.values["seconds"] == pytest.approx(0.05)


def test_the_distance_is_that_of_the_turned_visitor():
    eighth = np.sin(np.pi / 8), np.cos(np.pi / 8)
    run_ = run([1.3, 1.3], (0.0, eighth[0], 0.0, eighth[1]))
    assert run_.series["hand-lamp/distance"].values[0] == pytest.approx(1.3 - 0.5 - np.sqrt(0.5))


def test_far_away_only_balls_are_tested():
    far = run([3.0] * 50)
    assert far.frames_run == 0 and far.counters == {"vertex tests": 0} and far.series == {}
    assert run([3.0, 1.1, 3.0]).counters["vertex tests"] == len(surface_points(cube()))


def test_a_board_is_as_near_as_its_surface_and_not_as_its_corners():
    """A board of 0.8 m lies 5 mm over a lamp of 80 mm: its corners are 0.5 m away."""
    board, lamp = cube(0.8), cube(0.08)
    flat = MeshData(np.asarray(board.vertices) * [1.0, 0.02, 1.0], board.faces)
    settings = {"of": ["board"], "hazard": "lamp", "distance": NEAR}
    scene = Scene(bodies=(SceneBody("board"), SceneBody("lamp")), effects=(SceneEffect("hazard-proximity", settings),))
    places = {"board": along_x([0.0] * 2), "lamp": along_x([0.0] * 2)}
    places["board"][0][:, 1] = 0.04 + 0.008 + 0.005
    session = Session.from_arrays(np.arange(2) * 10_000_000, places, {"board": flat, "lamp": lamp}, scene)
    series = compute(session).effects["hazard-proximity"].series["board-lamp/distance"]
    assert series.values == pytest.approx([0.005, 0.005], abs=1e-6)


def test_a_flame_above_the_mesh_is_part_of_the_hazard():
    scene_distance = run([0.0, 0.0], above=3.0).events[0].values["least_m"]
    assert scene_distance == 0.0
