"""Engines agree where nothing is hard; their stages are told apart, and counters say how their work grows."""

from types import SimpleNamespace

import numpy as np
import pytest

from cdcore.narrow.spacetime.box_tree import build_box_tree
from cdcore.narrow.spacetime.pair_job import Poses
from cdcore.narrow.spacetime.whole_motion import decide_motion
from replay.studies.bench import engines
from replay.studies.bench import stages as stages_module
from replay.studies.bench.engines import ENGINES, YARDSTICK, frame_by_frame, installed_engines
from replay.studies.bench.stages import STAGES, grow, root_only, stages, without_faces
from replay.studies.bench.workload import make_resting, make_workload


@pytest.fixture(scope="module")
def answers():
    part = make_workload(200, 900)
    return {(name, what): ENGINES[name](part).ask(what) for name in installed_engines() for what in ("bool", "faces")}


@pytest.mark.parametrize("name", ENGINES)
def test_all_engines_agree_on_which_pairs_touch_when(answers, name):
    if (name, "bool") not in answers:
        pytest.skip(f"{name} is not installed")
    assert answers[YARDSTICK, "bool"].any()
    assert np.array_equal(answers[name, "bool"], answers[YARDSTICK, "bool"])
    assert np.array_equal(answers[name, "faces"] > 0, answers[name, "bool"] > 0)


def test_stages_begin_with_the_check_of_the_poses_and_add_up_to_less_than_the_call():
    seconds, found = ENGINES["exact"](make_workload(100, 300)).staged("faces")
    assert next(iter(seconds)) == "check"
    assert {"poses", "search", "exact", "faces", "containment"} <= set(seconds)
    assert min(seconds.values()) >= 0
    assert found.face_sets is not None


def test_the_plain_loop_places_what_moves_and_nothing_else():
    load, placed = make_workload(100, 5), []
    frame_by_frame(load, lambda body, pose: placed.append(body), lambda row: None)
    assert {load.names[body].split("-")[0] for body in placed} == {"rod", "tube", "hand"}
    assert len(placed) == 5 * 3


def test_what_needs_an_extra_is_left_out_when_absent(monkeypatch):
    monkeypatch.setattr(engines, "find_spec", lambda name: None)
    assert installed_engines() == ["python-fcl", "trimesh", "exact"]


def asked(load, cut):
    trees = [cut(build_box_tree(vertices[faces])) for vertices, faces in load.meshes]
    turn, move = load.poses[..., :3, :3].copy(), load.poses[..., :3, 3].copy()
    return decide_motion(trees, load.pairs, Poses(turn, move, np.ones(move.shape[:2], dtype=bool)), faces=True)


def test_cut_trees_dismiss_the_same_by_spheres_and_ask_no_face():
    load = make_workload(200, 900)
    whole, hollow, roots = (asked(load, cut) for cut in (lambda tree: tree, without_faces, root_only))
    for name in ("skipped", "span_tests", "gap_tests", "blocks"):
        assert whole.work[name] == hollow.work[name] == roots.work[name] > 0
    assert whole.work["node_tests"] == hollow.work["node_tests"] > roots.work["node_tests"] == roots.work["blocks"]
    assert whole.work["face_tests"] > 0 == hollow.work["face_tests"] == roots.work["face_tests"]
    assert whole.hits.any() and not hollow.hits.any() and not roots.hits.any()


@pytest.mark.parametrize(("what", "parts"), [("bool", {"trees": 4.0}), ("faces", {"trees": 2.0, "faces": 2.0})])
def test_the_stages_of_a_search_add_up_to_it(what, parts, monkeypatch):
    def decided(trees, *_, **__):
        faces, nodes = trees[0].leaves[:, 1].any(), len(trees[0].boxes)
        seconds = {"poses": 0.5, "search": 1.0 if nodes == 1 else 5.0 if faces else 3.0, "exact": 0.1, "faces": 0.2}
        return SimpleNamespace(seconds=seconds)

    monkeypatch.setattr(stages_module, "decide_motion", decided)
    spent = stages("bench", make_workload(200, 10), what).seconds
    del spent["check"]
    assert spent == {"poses": 0.5, "spheres": 1.0, "exact": 0.1, "sorting": 0.2, **parts}


@pytest.mark.parametrize("what", ["bool", "faces"])
def test_every_stage_has_its_seconds_and_a_boolean_leaves_faces_within_trees(what):
    spent = stages("bench", make_workload(2_000, 900), what)
    assert set(STAGES) - set(spent.seconds) == (set() if what == "faces" else {"faces"})
    assert min(spent.seconds.values()) >= 0
    assert spent.seconds["check"] > 0 and spent.seconds["trees"] > 0


def test_most_of_a_resting_contact_is_exact_arithmetic():
    spent = stages("resting", make_resting(500, 30), "faces").seconds
    assert spent["exact"] == max(spent.values())


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_ten_times_the_frames_of_distant_bodies_take_one_or_two_tests_more_a_pair(seed):
    short, long = (grow("distant", "frames", frames, seed=seed) for frames in (2_700, 27_000))
    pairs = len(make_workload(100, 1).pairs)
    for one in (short, long):
        assert one.work["skipped"] == one.pair_frames
        assert one.work["blocks"] == one.work["gap_tests"] == one.work["node_tests"] == 0
    assert short.tests == 3 * pairs
    assert long.tests == 4 * pairs


def test_near_bodies_take_tests_in_proportion_and_most_pair_frames_are_skipped_all_the_same():
    short, long = (grow("near", "frames", frames) for frames in (2_700, 13_500))
    assert 4 < long.tests / short.tests < 6
    assert long.work["skipped"] > 0.85 * long.pair_frames


def test_growth_says_how_much_was_asked_and_where_time_went():
    one = grow("near", "bodies", 5)
    assert one.pair_frames == 5400 * len(make_workload(10, 1, bodies=5).pairs)
    assert 0 < one.reading + one.search < one.seconds
    assert one.stages.keys() >= {"check", "poses", "search", "exact"}


def test_the_exact_engine_asks_containment_as_the_table_of_the_race_says():
    assert ENGINES["exact"](make_workload(100, 5))._detector.settings.containment
