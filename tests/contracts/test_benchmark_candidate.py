"""The candidate answers the benchmark's question as python-fcl does in general position, and keeps no answers."""

import importlib.util
import sys

import numpy as np
import pytest
from support.bench_loads import ENGINES, YARDSTICK, FclLoop, make_workload, run
from support.optional import BENCH, needs_bench


@needs_bench
def test_benchmark_counts_python_fcl_pairs_and_renews_other_poses():
    """Bodies of 300 faces each; afterwards each is moved 10 m further than the last, and none touch."""
    spec = importlib.util.spec_from_file_location("workload", BENCH / "workload.py")
    sys.modules["workload"] = module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    workload = module.lab_bench(300, n_frames=900)
    counts = FclLoop(workload).ask("faces")
    assert counts.any() and np.array_equal(run(workload, "faces"), counts)
    assert np.array_equal(run(workload, "bool"), counts > 0)
    workload.poses[:, :, :3, 3] += 10.0 * np.arange(len(workload.names))[:, None]
    assert not run(workload, "bool").any()


@pytest.mark.sampled(3)
@pytest.mark.parametrize("name", ENGINES)
def test_all_engines_agree_on_which_pairs_touch_when(name):
    """An engine is asked whether each pair touches in each frame ("bool") and how many pairs of faces do ("faces")."""
    load = make_workload(faces=200, frames=900)
    engine, yardstick = ENGINES[name](load), ENGINES[YARDSTICK](load)
    expected = yardstick.ask("bool")
    assert expected.any() and np.array_equal(engine.ask("bool"), expected)
    assert np.array_equal(engine.ask("faces") > 0, expected > 0)
