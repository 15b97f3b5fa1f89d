"""The candidate answers the benchmark's question as python-fcl does in general position, and keeps no answers."""

import importlib.util
import sys

import numpy as np
import pytest
from support.shared_data import BENCH, needs_bench

from replay.studies.bench.candidate import Candidate, run


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
