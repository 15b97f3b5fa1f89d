import numpy as np
import pytest
from support.small_worlds import along_x, cube, cubes

from cdcore import Detection, Verdict
from replay.effects.contact import SPEC
from replay.effects.effect_plan import plan
from replay.effects.effects_runner import run_effects
from replay.pipeline.engine import compute
from replay.prepare.assemble import assemble
from sessions import Session
from sessions.model.scene import Scene, SceneBody, SceneEffect

SCENE = Scene(
    bodies=(SceneBody("a"), SceneBody("b"), SceneBody("c")), effects=(SceneEffect("contact", {"between": ["a", "b"]}),)
)
NEAR, FAR = 0.9, 3.0


def run(places, **more):
    count = len(places)
    return compute(cubes({"a": [0] * count, "b": places, "c": [9.0] * (count - 1) + [0.5]}, scene=SCENE), **more)


def test_a_contact_begins_with_two_frames_and_ends_with_two():
    result = run([FAR, NEAR, FAR, NEAR, NEAR, FAR, NEAR, FAR, FAR, NEAR], detectors=())
    (event,) = result.effects["contact"].events
    assert (event.name, event.bodies, event.values) == ("contact", ("a", "b"), {"frames": 4})
    assert (event.time, event.end) == pytest.approx((0.03, 0.07))
    assert result.effects["contact"].counters == {"pair-frames": 10, "flickers": 3}


def test_only_the_declared_pair_is_looked_at_by_the_detector_that_contact_names():
    result = run([FAR, NEAR, NEAR], detectors=())
    assert set(result.detections) == {SPEC.detector} and len(result.assembly.pairs) == 1


def test_a_contact_stands_where_the_surfaces_met_and_lasts_to_the_end_of_the_recording():
    (event,) = run([FAR, FAR, NEAR, NEAR], detectors=()).effects["contact"].events
    assert event.end is None and event.point is not None and 0.4 <= event.point[0] <= 0.5


def test_the_lane_and_the_faces_tell_of_the_pair():
    output = run([FAR, NEAR, NEAR, FAR, FAR], detectors=()).effects["contact"].output
    ((span,),) = output.lanes.values()
    assert (span.start, span.end) == pytest.approx((0.01, 0.03)) and list(output.lanes) == ["a-b"]
    assert output.series["a-b/face_pairs"].values[[0, -1]].tolist() == [0.0, 0.0]
    assert output.series["a-b/face_pairs"].values.max() > 0


def test_face_pairs_are_told_on_both_sides_of_every_change_and_nowhere_else():
    series = run([FAR] * 9 + [NEAR] * 9 + [FAR] * 9, detectors=()).effects["contact"].series["a-b/face_pairs"]
    assert np.round(series.times * 100).tolist() == [0, 8, 9, 17, 18]
    assert (series.values > 0).tolist() == [False, False, True, True, False]


def test_touches_remember_the_last_clear_frame():
    touches = run([FAR, FAR, NEAR, NEAR], detectors=()).effects["contact"].output.data
    (touch,) = touches.of(("b", "a"))
    assert (touch.before, touch.first, touch.stop) == (1, 2, 4)


def test_the_answer_is_the_same_whoever_else_is_audited():
    places = [FAR, NEAR, NEAR, FAR, FAR, NEAR, NEAR]
    alone = run(places, detectors=()).effects["contact"].output.digest
    assert run(places, detectors="discrete[rate_hz=25]", oracle="exact").effects["contact"].output.digest == alone
    assert np.array_equal(run(places, detectors="exact").effects["contact"].output.digest, alone)


NEAR_hazard_proximity, LEAVE = 0.2, 0.05


def run_hazard_proximity(places, rotation=(0.0, 0.0, 0.0, 1.0), **more):
    """Two unit cubes; the visitor's distance to the hazard is ``place - 1``."""
    settings = {"of": ["hand"], "hazard": "lamp", "distance": NEAR_hazard_proximity, "leave_by": LEAVE, **more}
    scene = Scene(bodies=(SceneBody("hand"), SceneBody("lamp")), effects=(SceneEffect("hazard-proximity", settings),))
    stamps = np.arange(len(places)) * 10_000_000
    poses = {"hand": along_x(places, rotation), "lamp": along_x([0.0] * len(places))}
    session = Session.from_arrays(stamps, poses, {"hand": cube(), "lamp": cube()}, scene)
    result = compute(session)
    assert not result.detections and len(result.assembly.pairs) == 0
    return result.effects["hazard-proximity"]


def test_near_begins_below_the_distance_and_ends_above_it_by_the_hysteresis():
    (event,) = run_hazard_proximity([3, 1.3, 1.19, 1.1, 1.22, 1.19, 1.24, 1.26, 3]).events
    assert (event.time, event.end) == pytest.approx((0.02, 0.07))
    assert event.values["least_m"] == pytest.approx(0.1) and event.values["seconds"] == pytest.approx(0.05)


def test_leaving_by_a_leap_beyond_the_gate_ends_it():
    (event,) = run_hazard_proximity([3, 1.1, 9, 9]).events
    assert event.end == pytest.approx(0.02)


def test_who_is_there_at_the_end_has_not_left():
    assert run_hazard_proximity([3, 1.1, 1.1]).events[0].end is None


def test_inside_the_hazard_the_distance_is_zero():
    assert run_hazard_proximity([3, 0.5, 3]).events[0].values["least_m"] == 0.0


def test_the_distance_is_that_of_the_turned_visitor():
    eighth = np.sin(np.pi / 8), np.cos(np.pi / 8)
    run_ = run_hazard_proximity([1.3, 1.3], (0.0, eighth[0], 0.0, eighth[1]))
    assert run_.series["hand-lamp/distance"].values[0] == pytest.approx(1.3 - 0.5 - np.sqrt(0.5))


def test_far_away_only_balls_are_tested():
    far = run_hazard_proximity([3.0] * 50)
    assert far.frames_run == 0 and far.counters == {"ball tests": 50, "vertex tests": 0} and far.series == {}
    assert run_hazard_proximity([3.0, 1.1, 3.0]).counters["vertex tests"] == 8


def test_a_flame_above_the_mesh_is_part_of_the_hazard():
    scene_distance = run_hazard_proximity([0.0, 0.0], above=3.0).events[0].values["least_m"]
    assert scene_distance == 0.0


SCENE_sweep = Scene(
    bodies=(SceneBody("a"), SceneBody("b")), effects=(SceneEffect("sweep", {"between": ["a", "b"]}),), pairs=()
)
WORDS = {".": Verdict.CLEAR, "C": Verdict.CONTACT, "u": Verdict.UNRESOLVED}


def swept(row, **more):
    """What the effect makes of a detector of intervals that said this."""
    session = cubes({"a": [0.0] * len(row), "b": [3.0 - 0.1 * k for k in range(len(row))]}, scene=SCENE_sweep)
    assembly = assemble(session, pairs=[("a", "b")])
    verdict = np.array([[WORDS[letter]] for letter in row], dtype=np.uint8)
    told = Detection("fake", assembly.names, assembly.pairs, assembly.motion.times, verdict, covers="intervals", **more)
    return run_effects(plan(SCENE_sweep), session, assembly, {"continuous": told})["sweep"]


def test_a_contact_between_two_frames_is_a_hit_in_the_interval_of_its_impact():
    run = swept("..C..", toi={(2, 0): (0.0131, 0.0132)})
    (event,) = run.events
    assert (event.name, event.time, event.end) == ("hit", 0.0132, pytest.approx(0.03))
    assert event.values["impact_low_s"] == 0.0131 and run.output.lanes["a-b"][0].start == pytest.approx(0.01)


def test_without_an_interval_the_step_bounds_the_impact():
    (event,) = swept(".CC").events
    assert (event.values["impact_low_s"], event.values["impact_high_s"]) == (0.0, 0.01) and event.end is None


def test_undecided_steps_are_told_with_their_reason_and_are_no_hits():
    run = swept(".u.", reasons={(1, 0): "budget spent"})
    assert [(e.name, e.values["reason"]) for e in run.events] == [("unresolved", "budget spent")]
    assert run.counters == {"intervals": 3, "unresolved": 1}


def test_a_body_that_passes_through_between_two_frames_is_hit_on_the_way():
    places = [3.0, 2.0, -2.0, -3.0]
    result = compute(cubes({"a": [0.0] * 4, "b": places}, step_ns=10**9, scene=SCENE_sweep), detectors=())
    (event,) = result.effects["sweep"].events
    # The faces are 1 m apart at x = 1: a quarter of the way from 2 to -2, and so a quarter of the step after frame 1.
    assert event.values["impact_low_s"] <= 1.25 <= event.values["impact_high_s"] + 1e-9
    assert event.bodies == ("a", "b") and set(result.detections) == {"continuous"}


def test_the_plan_asks_the_detector_of_intervals_about_the_declared_pair():
    planned = plan(SCENE_sweep)
    assert planned.detectors == {"continuous": ("sweep",)} and planned.pairs == (("a", "b"),)
