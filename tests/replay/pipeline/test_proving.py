"""What is proven of made-up and real sessions, how large the proof is, and that the verifier accepts it."""

import sys

import numpy as np
import pytest
from support.proofs import proven
from support.shared_data import BENCH, DATA, needs_bench, needs_data
from support.small_worlds import cube, cubes, jumping

from cdcore import Body, Motion, TriangleMesh
from replay import run
from replay.errors import ProofError
from replay.pipeline.proving import EVERY_FACE, _far_front, prove
from replay.proof.claims import Kind, Proof
from replay.proof.loading import load
from replay.proof.verifier import verify
from sessions.importers import import_session
from sessions.synthetic.scenes import SCENES, make_scene_session


def accepted(session):
    """The size of the proof of a session, in bytes."""
    result = run(session, detectors="sphere", oracle="exact")
    data = prove(result, session).written()
    proof = Proof.read(data)
    meshes, poses, _ = load(session, proof)
    verify(proof, meshes, poses)
    assert np.array_equal(proof.verdicts(len(poses.valid)), result.detections["exact"].verdict)
    return len(data)


def test_the_proof_of_a_short_session_is_accepted_and_small():
    assert accepted(jumping()) < 10_000


@pytest.mark.slow
@pytest.mark.parametrize("scene", SCENES)
def test_the_proof_of_every_made_up_session_is_accepted(scene):
    print(f"{scene}: {accepted(make_scene_session(scene)[0]):,} bytes")


@needs_data
@pytest.mark.slow
@pytest.mark.parametrize(
    ("recording", "wands"),
    [(name, wands) for name in ("grabLeft", "grabRight", "tracked-recording") for wands in (True, False)]
    + [("dance", False)],
)
def test_the_proof_of_every_real_recording_is_accepted(recording, wands):
    wand = DATA / "webxr-vive-controller" / "htc-vive-none.glb"
    folder = "a-saturday-night" if recording == "dance" else "aframe-motion-capture"
    meshes = {"left": wand, "right": wand} if wands else {}
    size = accepted(import_session("aframe", DATA / folder / f"{recording}.json", meshes=meshes))
    print(f"{recording}: {size:,} bytes")


@needs_bench
@pytest.mark.slow
@pytest.mark.parametrize("faces", [500, 5_000, 50_000])
def test_the_proof_of_the_common_workload_has_less_than_a_megabyte(faces, monkeypatch):
    monkeypatch.syspath_prepend(str(BENCH))
    monkeypatch.delitem(sys.modules, "workload", raising=False)
    work = pytest.importorskip("workload").lab_bench(faces)
    bodies = [Body(name, TriangleMesh(*mesh)) for name, mesh in zip(work.names, work.meshes, strict=True)]
    motion = Motion.from_matrices(np.arange(len(work.poses)) / work.rate_hz, work.poses)
    proof, meshes, poses, _ = proven(bodies, motion, work.pairs)
    verify(proof, meshes, poses)
    assert len(proof.written()) < 1_000_000


def test_two_faces_witness_a_contact_for_as_long_as_they_can():
    mesh = TriangleMesh(cube(1.0).vertices, cube(1.0).faces)
    count = 30
    places = np.zeros((count, 2, 3))
    places[:, 1, 0] = np.linspace(0.9, 0.8, count)
    motion = Motion(np.arange(count) / 90, places, np.tile(np.eye(3), (count, 2, 1, 1)))
    assert _far_front(np.full((2, 3), 1e9), 1.0) == EVERY_FACE, "where a metre is below rounding nothing is apart"
    proof, meshes, poses, _ = proven([Body("a", mesh), Body("b", mesh)], motion)
    assert proof["claims"][:, :4].tolist() == [[0, 0, count - 1, Kind.CONTACT]]
    assert verify(proof, meshes, poses)["face_pairs"] == count


def test_only_what_exact_says_of_the_recording_itself_is_proven():
    session = cubes({"a": [0.0] * 4, "b": [3.0, 2.0, 1.5, 0.5]})
    for asked in ({"oracle": "hybrid"}, {"oracle": "none"}):
        with pytest.raises(ProofError, match="make it the oracle"):
            prove(run(session, detectors="sphere", **asked), session)
    other = cubes({"a": [0.0] * 3, "b": [3.0, 2.0, 1.5]})
    with pytest.raises(ProofError, match="not consecutive ones of the recording"):
        prove(run(session, detectors="sphere", oracle="exact"), other)
