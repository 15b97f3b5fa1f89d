"""Our detectors answer the question of the benchmark as python-fcl does in general position, and keep no answers."""

from dataclasses import replace

import numpy as np
import pytest
from support.bench_engines import ENGINES, YARDSTICK, Candidate, make_workload

FACES = {YARDSTICK, "exact", "hybrid"}
"""Those that name every pair of faces."""


@pytest.fixture(params=[(500, 1500), pytest.param((5000, 5400), marks=pytest.mark.slow)], scope="module")
def load(request):
    return make_workload(*request.param)


def test_all_engines_agree_on_which_pairs_touch_when_and_on_the_faces(load):
    answers = {(name, what): engine(load).ask(what) for name, engine in ENGINES.items() for what in ("bool", "faces")}
    truth = answers[YARDSTICK, "faces"]
    assert truth.any()
    for (name, what), answer in answers.items():
        assert np.array_equal(answer > 0, truth > 0), (name, what)
        assert what == "bool" or name not in FACES or np.array_equal(answer, truth), name


def test_other_poses_of_the_same_meshes_are_answered_anew(load):
    candidate, poses = Candidate(), load.poses.copy()
    poses[:, :, 0, 3] += 10.0 * np.arange(len(load.names))
    assert candidate(load, "bool").any() and not candidate(replace(load, poses=poses), "bool").any()
