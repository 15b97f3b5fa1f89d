"""Poses that the recording gives, to the bit those of the run; others come from the proof and are counted."""

from dataclasses import replace

import numpy as np
import pytest
from support.shapes import random_rotations
from support.small_worlds import STEP_NS, cubes, framed

from replay import run
from replay.pipeline.proving import prove
from replay.proof.claims import Proof, WrongRecord
from replay.proof.loading import load
from replay.proof.verifier import verify
from sessions import Status
from sessions.geometry.rotations import quaternion_from_matrix
from sessions.model.scene import Pose, Scene, SceneBody

COUNT = 24
STAMPS = np.arange(COUNT) * STEP_NS


def quaternion(rng):
    return quaternion_from_matrix(random_rotations(rng, 1)[0])


def drifting(status, scene=None):
    """Cubes a and b that turn, b towards a, with a status for each sample of b."""
    rng = np.random.default_rng(3)
    places = np.zeros((COUNT, 2, 3))
    places[:, 1, 0] = np.linspace(2.5, 1.0, COUNT)
    turns = np.tile([quaternion(rng), quaternion(rng)], (COUNT, 1, 1))
    both = np.column_stack([np.ones(COUNT), status])
    session = framed(STAMPS, both, places, turns)
    return session if scene is None else replace(session, scene=scene)


def checked(session, **asked):
    """What the verifier counts of a session, and where its poses come from."""
    result = run(session, detectors="sphere", oracle="exact", **asked)
    proof = Proof.read(prove(result, session).written())
    meshes, poses, whence = load(session, proof)
    told = verify(proof, meshes, poses)
    motion = result.assembly.motion
    assert np.array_equal(poses.valid, motion.valid)
    assert np.array_equal(poses.rotation[poses.valid], motion.rotations[motion.valid])
    assert np.array_equal(poses.translation[poses.valid], motion.translations[motion.valid])
    assert np.array_equal(proof.verdicts(len(motion)), result.detections["exact"].verdict)
    return proof, told, dict(whence)


def test_recorded_poses_are_those_of_the_run_to_the_bit():
    _, told, whence = checked(drifting(np.ones(COUNT)))
    assert whence == {"recorded": 2 * COUNT} and told["CLEAR"] and told["CONTACT"]


def test_interpolated_and_held_poses_come_from_the_proof_and_lost_ones_are_none():
    status = np.ones(COUNT)
    status[[3, 4, 9]] = Status.ABSENT
    status[-2:] = Status.ABSENT
    status[15:17] = Status.LOST
    _, told, whence = checked(drifting(status))
    assert whence == {"recorded": 2 * COUNT - 7, "interpolated": 3, "held": 2}
    assert told["NO_POSE"] == 2


def test_parents_offsets_and_fixed_bodies_are_put_together_to_the_bit():
    rng = np.random.default_rng(5)
    pose = [Pose(tuple(rng.normal(size=3) * 0.1), tuple(quaternion(rng).tolist())) for _ in range(3)]
    bodies = SceneBody("a", offset=pose[0]), SceneBody("b", parent="a", offset=pose[1]), SceneBody("c", fixed=pose[2])
    session = drifting(np.ones(COUNT), Scene(bodies=bodies))
    session = replace(session, meshes={**session.meshes, "c": session.meshes["a"]})
    _, _, whence = checked(session)
    assert whence == {"recorded": 3 * COUNT}


def test_a_window_of_the_recording_is_proven_as_that_window():
    proof, _, _ = checked(drifting(np.ones(COUNT)), start=0.05, end=0.12)
    assert proof.header["frames"] == [5, 13]


def test_what_a_policy_leaves_out_is_named_and_only_that():
    session = cubes({"a": [0.0] * 400, "b": np.concatenate([np.linspace(3, 0.9, 200), np.full(200, 0.9)])})
    rng = np.random.default_rng(0)
    frames = session.frames
    position = frames.position + rng.normal(scale=1e-4, size=frames.position.shape)
    position[100:300, 1] = position[100, 1]
    session = replace(session, source=replace(frames, position=position))
    proof, told, whence = checked(session, policy=["frozen=drop"])
    assert whence["left_out"] == told["NO_POSE"] > 100
    (flag,) = proof.header["flags"]
    assert flag[:2] == ["frozen", "b"] and flag[4] == "drop"
    for flags, words in (
        ([], r"body b, frames .*: the recording holds another pose"),
        ([[*flag[:3], flag[3] + STEP_NS, "drop"]], "the doctor finds it nowhere frozen"),
    ):
        with pytest.raises(WrongRecord, match=words):
            load(session, Proof({**proof.header, "flags": flags}, proof.arrays))


def test_another_mesh_or_scene_is_noticed():
    session = drifting(np.ones(COUNT))
    proof, _, _ = checked(session)
    larger = replace(session, meshes={**session.meshes, "b": cubes({"b": [0]}).meshes["b"]})
    load(larger, proof)
    moved = np.asarray(session.meshes["b"].vertices) * 1.1
    other = replace(session, meshes={**session.meshes, "b": replace(session.meshes["b"], vertices=moved)})
    with pytest.raises(WrongRecord, match="body b: the recording holds another mesh"):
        load(other, proof)
    with pytest.raises(WrongRecord, match="another scene"):
        load(replace(session, scene=Scene(name="other")), proof)
