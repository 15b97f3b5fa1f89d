"""Engines agree where nothing is hard; workloads, stages and growth are what they say."""

import importlib.util
import sys

import numpy as np
import pytest
from support.shared_data import BENCH, needs_bench

from cdcore.narrow.spacetime.box_tree import build_box_tree
from cdcore.narrow.spacetime.pair_job import Poses
from cdcore.narrow.spacetime.whole_motion import decide_motion
from replay.studies.bench import engines
from replay.studies.bench.candidate import Candidate, run
from replay.studies.bench.engines import ENGINES, YARDSTICK, OwnExact, frame_by_frame, installed_engines
from replay.studies.bench.growth import Growth, grow
from replay.studies.bench.shapes import MAKERS, bench_mesh
from replay.studies.bench.stages import STAGES, root_only, stages, without_faces
from replay.studies.bench.workload import PERIOD, RATE_HZ, make_resting, make_workload


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


def test_exact_names_as_many_face_pairs_as_python_fcl(answers):
    assert answers[YARDSTICK, "faces"].max() > 10
    assert np.array_equal(answers["exact", "faces"], answers[YARDSTICK, "faces"])


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


def test_growth_sums_what_reading_and_the_search_took():
    stages = {"check": 0.5, "poses": 1.0, "search": 2.0, "exact": 4.0, "faces": 8.0}
    work = {"span_tests": 1, "node_tests": 2, "face_tests": 4, "skipped": 8}
    one = Growth("near", "bodies", 5, 1, 20.0, work, stages)
    assert (one.reading, one.search, one.tests) == (1.5, 6.0, 7)


def test_growth_says_how_much_was_asked_and_where_time_went():
    one = grow("near", "bodies", 5)
    assert one.pair_frames == 5400 * len(make_workload(10, 1, bodies=5).pairs)
    assert 0 < one.reading + one.search < one.seconds
    assert one.as_json()["stages"].keys() >= {"check", "poses", "search", "exact"}


FRAMES = int(PERIOD * RATE_HZ)


def test_the_same_seed_gives_the_same_bench_and_another_does_not():
    one, same, other = (make_workload(200, 90, seed=seed) for seed in (3, 3, 4))
    assert np.array_equal(one.poses, same.poses)
    assert not np.array_equal(one.poses, other.poses)


@pytest.mark.parametrize("distant", [False, True])
def test_poses_are_rigid_smooth_and_go_on_where_the_script_begins_again(distant):
    load = make_workload(100, FRAMES + 200, bodies=9, distant=distant)
    turn, place = load.poses[..., :3, :3], load.poses[..., :3, 3]
    assert np.allclose(turn @ turn.swapaxes(-1, -2), np.eye(3), atol=1e-14)
    assert np.allclose(np.linalg.det(turn), 1)
    assert np.linalg.norm(np.diff(place, axis=0), axis=-1).max() < 0.03
    assert np.abs(np.diff(turn, axis=0)).max() < 0.1
    assert len(load.names) == 9 and load.names[8].startswith("rod")


def test_two_bodies_are_no_bench():
    with pytest.raises(ValueError, match="3 bodies or more, not 2"):
        make_workload(10, 10, bodies=2)


@pytest.mark.parametrize("seed", [0, 1])
def test_every_moving_thing_touches_something_and_a_twentieth_of_the_pair_frames_is_near(seed):
    load = make_workload(500, FRAMES, seed=seed)
    found = OwnExact(load).staged("bool")[1]
    touching = load.pairs[(found.verdict == 1).any(axis=0)]
    assert {load.names[k] for k in touching.ravel()} == set(load.names)
    assert 0.06 < (found.verdict == 1).any(axis=1).mean() < 0.15
    assert 0.85 < found.work["skipped"] / found.verdict.size < 0.96


def test_distant_bodies_are_metres_apart_and_move_as_they_do_on_the_bench():
    near, far = make_workload(100, 90), make_workload(100, 90, distant=True)
    x = far.poses[:, :, 0, 3]
    assert np.diff(x, axis=1).min() > 4
    assert np.array_equal(near.poses[..., 1:3, :], far.poses[..., 1:3, :])


def test_a_resting_cup_takes_exact_arithmetic_in_every_frame():
    found = OwnExact(make_resting(200, 20)).staged("faces")[1]
    assert (found.verdict == 1).all()
    assert found.work["exact_tests"] > 20


@pytest.mark.parametrize("faces", [500, 5_000])
@pytest.mark.parametrize("kind", MAKERS)
def test_a_mesh_has_nearly_the_faces_asked_for_and_each_has_an_area(kind, faces):
    vertices, triangles = bench_mesh(kind, faces)
    assert abs(len(triangles) / faces - 1) < 0.1
    assert np.array_equal(vertices, vertices.astype(np.float32))
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    assert np.linalg.norm(np.cross(b - a, c - a), axis=1).min() > 0
    assert np.array_equal(np.unique(triangles), np.arange(len(vertices)))


def test_a_rod_goes_into_a_cup_and_a_tube_into_a_ring():
    rod, cup, tube, ring = (np.hypot(*bench_mesh(kind, 500)[0][:, :2].T) for kind in ("rod", "cup", "tube", "ring"))
    assert rod.max() < 0.1 * cup.max()
    assert tube.max() < 0.5 * ring.min()


@pytest.fixture(scope="module")
def workload():
    spec = importlib.util.spec_from_file_location("workload", BENCH / "workload.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["workload"] = module
    spec.loader.exec_module(module)
    return module.lab_bench(300, n_frames=900)


def fcl_counts(workload, frames):
    import fcl

    models = []
    for vertices, faces in workload.meshes:
        model = fcl.BVHModel()
        model.beginModel(len(vertices), len(faces))
        model.addSubModel(vertices, faces)
        model.endModel()
        models.append(model)
    counts = np.zeros((len(frames), len(workload.pairs)), dtype=int)
    for row, frame in enumerate(frames):
        objects = [
            fcl.CollisionObject(model, fcl.Transform(pose[:3, :3], pose[:3, 3]))
            for model, pose in zip(models, workload.poses[frame], strict=True)
        ]
        for column, (i, j) in enumerate(workload.pairs):
            result = fcl.CollisionResult()
            fcl.collide(objects[i], objects[j], fcl.CollisionRequest(num_max_contacts=100_000), result)
            counts[row, column] = len({(contact.b1, contact.b2) for contact in result.contacts})
    return counts


@needs_bench
def test_it_counts_the_face_pairs_python_fcl_counts(workload):
    frames = np.arange(560, 900, 3)
    assert fcl_counts(workload, frames).sum() > 0
    assert np.array_equal(run(workload, "faces")[frames], fcl_counts(workload, frames))


@needs_bench
def test_booleans_are_where_faces_are(workload):
    assert np.array_equal(run(workload, "bool"), run(workload, "faces") > 0)


@needs_bench
def test_other_poses_of_the_same_meshes_are_answered_anew(workload):
    candidate = Candidate()
    first = candidate(workload, "bool")
    poses = workload.poses.copy()
    workload.poses[:, :, :3, 3] += 10.0 * np.arange(len(workload.names))[None, :, None]
    try:
        assert first.any()
        assert not candidate(workload, "bool").any()
    finally:
        workload.poses[:] = poses


@needs_bench
def test_a_pose_that_is_not_finite_is_refused_not_counted(workload):
    from cdcore.errors import InvalidPoseError

    poses = workload.poses.copy()
    workload.poses[7, 4, 0, 3] = np.nan
    try:
        with pytest.raises(InvalidPoseError, match="frame 7"):
            run(workload, "bool")
    finally:
        workload.poses[:] = poses
