"""The candidate answers the benchmark's question as python-fcl does in general position, and keeps no answers."""

import importlib.util
import sys

import numpy as np
import pytest
from support.bench_candidate import Candidate, run
from support.bench_engines import ENGINES, YARDSTICK, FclLoop
from support.bench_loads import make_workload
from support.shared_data import BENCH, needs_bench


@pytest.fixture(scope="module")
def workload():
    spec = importlib.util.spec_from_file_location("workload", BENCH / "workload.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["workload"] = module
    spec.loader.exec_module(module)
    return module.lab_bench(300, n_frames=900)


@needs_bench
def test_it_counts_the_face_pairs_python_fcl_counts(workload):
    counts = FclLoop(workload).ask("faces")
    assert counts.sum() > 0
    assert np.array_equal(run(workload, "faces"), counts)


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


@pytest.fixture(scope="module")
def answers():
    part = make_workload(200, 900)
    return {(name, what): engine(part).ask(what) for name, engine in ENGINES.items() for what in ("bool", "faces")}


@pytest.mark.parametrize("name", ENGINES)
def test_all_engines_agree_on_which_pairs_touch_when(answers, name):
    assert answers[YARDSTICK, "bool"].any()
    assert np.array_equal(answers[name, "bool"], answers[YARDSTICK, "bool"])
    assert np.array_equal(answers[name, "faces"] > 0, answers[name, "bool"] > 0)
