"""The candidate answers the benchmark's question as python-fcl does in general position, and keeps no answers."""

import importlib.util
import sys

import numpy as np
import pytest
from support.bench_loads import ENGINES, YARDSTICK, FclLoop, make_workload, run
from support.optional import BENCH, needs_bench


@pytest.fixture
def lab_workload():
    """The workload of the common benchmark: bodies of 300 faces each in 900 frames."""
    spec = importlib.util.spec_from_file_location("workload", BENCH / "workload.py")
    sys.modules["workload"] = module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.lab_bench(300, n_frames=900)


@needs_bench
def test_benchmark_counts_python_fcl_pairs_and_renews_other_poses(lab_workload):
    """Bodies of 300 faces each in 900 frames: the candidate, cdcore's own, counts the face pairs that meet in each pair
    of bodies and frame as python-fcl does.

    Then the poses of the same workload change, each body is 10 m further than the last: the answers are computed anew,
    and nothing touches.
    """
    counts = FclLoop(lab_workload).ask("faces")
    assert counts.any()
    assert np.array_equal(run(lab_workload, "faces"), counts)
    assert np.array_equal(run(lab_workload, "bool"), counts > 0)
    lab_workload.poses[:, :, :3, 3] += 10.0 * np.arange(len(lab_workload.names))[:, None]
    assert not run(lab_workload, "bool").any()


@pytest.mark.sampled(3)
@pytest.mark.parametrize("name", ENGINES)
def test_all_engines_agree_on_which_pairs_touch_when(name):
    """Bodies of 200 faces in 900 frames; the answers are those of YARDSTICK, the engine that all are timed against.

    An engine answers whether each pair touches in each frame ("bool"), and how many pairs of faces do ("faces").
    """
    workload = make_workload(faces=200, frames=900)
    engine = ENGINES[name](workload)
    expected = ENGINES[YARDSTICK](workload).ask("bool")
    assert expected.any()
    assert np.array_equal(engine.ask("bool"), expected)
    assert np.array_equal(engine.ask("faces") > 0, expected > 0)
