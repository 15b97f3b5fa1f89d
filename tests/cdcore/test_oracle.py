"""Worlds, detectors, ways of asking: every complete detector finds the faces that meet, and no way changes an answer.

Truth is brute force over all faces in integers (``oracles.brute_force``), which knows nothing of trees.
"""

import tracemalloc
from functools import cache

import numpy as np
import pytest
from oracles.brute_force import meeting_faces, placed
from support.random_worlds import SHAPES, World, bodies_of, plate, random_world, rotation
from support.shapes import unrotated_motion

from cdcore import Motion, Verdict, create_detector, join
from cdcore.protocol import detect_live

COMPLETE_DETECTORS = ("exact", "aabb", "obb", "rapid-style", "solid-style")
WITHOUT_CONTAINMENT = {"containment": False}
FAR_AWAY_M = (1e7, 1e15, 1e60, 1e80, 1e160, 1e300)
"""Metres: from a pose that no room has to one whose square is no number."""
QUICK_WORLDS = [(shape, 5) for shape in SHAPES]
SLOW_WORLDS = [(shape, seed) for shape in SHAPES for seed in range(6, 30)]
FEW_WORLDS = [("soup", 5), ("plate", 6), ("ball", 7), ("corrupt", 1e15)]
"""Drifting, resting and sliding bodies, and one that is gone for a frame."""


def quick_and_slow(quick, slow):
    """A mark that runs a test on few worlds, and slowly on many."""
    return pytest.mark.parametrize("worlds", [quick, pytest.param(slow, marks=pytest.mark.slow)], ids=len)


def corrupted(far):
    """A world in which one body, then two, are that far away for a frame, and one loses its pose before."""
    world = random_world(seed=2, shape="soup")
    position, valid = world.motion.translations.copy(), world.motion.valid.copy()
    position[4, 0, 1], position[8, :2, 0] = far, -far
    valid[7] = False
    return World(world.bodies, Motion(world.motion.times, position, world.motion.rotations, valid))


@cache
def world_of(key):
    """The random world, or the corrupted one, of a key (kind, seed or distance)."""
    kind, value = key
    return corrupted(value) if kind == "corrupt" else random_world(value, kind)


@cache
def faces_by_brute_force(key, frames):
    """Faces of the pairs with poses in some frames: (frame, column) -> (k, 2), or ``None`` without a pose."""
    world, answer = world_of(key), {}
    rotations, positions = world.motion.rotations, world.motion.translations
    for frame in frames:
        for column, ends in enumerate(((0, 1), (0, 2), (1, 2))):
            if not world.motion.valid[frame, list(ends)].all():
                answer[frame, column] = None
                continue
            faces = [placed(world.bodies[k].mesh.triangles, rotations[frame, k], positions[frame, k]) for k in ends]
            answer[frame, column] = meeting_faces(*faces)
    return answer


def assert_answers_of_brute_force(key, name, frames=(0, 12)):
    """Verdicts and faces of a detector are those of brute force; how many face pairs met."""
    detection = create_detector(name, world_of(key).bodies, **WITHOUT_CONTAINMENT).detect(
        world_of(key).motion, faces=True
    )
    count = 0
    for (frame, column), faces in faces_by_brute_force(key, frames).items():
        verdict, where = detection.verdict[frame, column], (key, name, frame, column)
        if faces is None:
            assert verdict == Verdict.NO_POSE, where
            continue
        assert verdict == (Verdict.CONTACT if len(faces) else Verdict.CLEAR), where
        assert np.array_equal(detection.faces(frame, column), faces), where
        count += len(faces)
    return count


@quick_and_slow(QUICK_WORLDS, SLOW_WORLDS)
@pytest.mark.parametrize("name", COMPLETE_DETECTORS)
def test_complete_detectors_list_exactly_the_meeting_faces(name, worlds):
    """Brute force tests every pair of faces; more than 50 meet in all worlds together."""
    frames = (0, 12) if name == "exact" else (12,)
    assert sum(assert_answers_of_brute_force(world, name, frames) for world in worlds) > 50


@pytest.mark.sampled(2)
@pytest.mark.parametrize("name", ["exact", "aabb", "solid-style"])
@pytest.mark.parametrize("far", FAR_AWAY_M)
def test_a_corrupt_pose_changes_no_other_frame(name, far):
    """``far``: metres from the origin; frames beside the corrupt one have the faces of an exhaustive test."""
    assert assert_answers_of_brute_force(("corrupt", far), name, frames=(0, 3, 4, 5, 7, 8, 9, 12)) > 0


@quick_and_slow(FEW_WORLDS, [*QUICK_WORLDS, *SLOW_WORLDS, *(("corrupt", far) for far in FAR_AWAY_M)])
@pytest.mark.parametrize("name", COMPLETE_DETECTORS)
def test_detection_is_independent_of_blocks_and_pair_order(name, worlds):
    """Frame by frame, in blocks of 5 frames, and with pairs in another order and bodies exchanged."""
    for key in worlds:
        world = world_of(key)
        detector, motion = create_detector(name, world.bodies, **WITHOUT_CONTAINMENT), world.motion
        whole = detector.detect(motion, faces=True)
        assert detect_live(detector, motion).digest == whole.digest, key
        joined = join(detector.stream(motion.blocks(5), faces=True))
        assert (joined.digest, joined.faces_digest) == (whole.digest, whole.faces_digest), key
        rotated = create_detector(name, world.bodies, pairs=[(2, 1), (1, 0), (0, 2)], **WITHOUT_CONTAINMENT)
        other = rotated.detect(motion, faces=True)
        assert (other.digest, other.faces_digest) == (whole.digest, whole.faces_digest), key


def long_motion(frames, away=0.0):
    """A soup that wanders to and fro beside a ball, turned a little more each frame; ``away``: how far off it stays."""
    rng, number = np.random.default_rng(4), np.arange(frames)
    bodies = bodies_of([SHAPES["soup"](rng), SHAPES["ball"](rng)])
    position, orientation = np.zeros((frames, 2, 3)), np.tile(np.eye(3), (frames, 2, 1, 1))
    position[:, 0] = np.stack([number * 37 % 101, number * 11 % 89, number * 7 % 97], axis=1) / 64 + [away, 0, 0]
    orientation[:, 0] = rotation(np.stack([number / 256, 1 + 0 * number, 0 * number, number / 512], axis=1))
    return bodies, Motion(number / 90, position, orientation)


@pytest.mark.parametrize("far", [1e9, 1e15, 1e80])
def test_a_corrupt_pose_costs_the_other_frames_nothing(far):
    """One body is ``far`` metres away in frame 200 of 400; a fifth more tests, and 100, are allowed for that frame."""
    bodies, motion = long_motion(frames=400)
    position = motion.translations.copy()
    position[200, 0] = far
    work = [
        create_detector("exact", bodies, **WITHOUT_CONTAINMENT).detect(recorded, faces=True).work
        for recorded in (motion, Motion(motion.times, position, motion.rotations))
    ]
    assert work[1]["node_tests"] <= 1.2 * work[0]["node_tests"] + 100
    assert work[1]["world_tests"] <= 1.2 * work[0]["world_tests"] + 100


def test_distant_bodies_are_skipped_while_paths_allow():
    """Bodies 100 m apart: no frame is tested, and less than one distance per 30 frames computed."""
    work = (
        create_detector("exact", long_motion(frames=8)[0], **WITHOUT_CONTAINMENT)
        .detect(long_motion(frames=8_192, away=100.0)[1])
        .work
    )
    assert work["skipped"] == 8_192 and work["blocks"] == 0
    assert work["gap_tests"] < 8_192 / 30


def test_small_fast_bodies_meet_in_the_right_frame():
    """One plate falls through the other by 1/1024 m a frame and is level with it in frame 64."""
    bodies = bodies_of([plate(None) / 512, plate(None) / 512])
    position = np.zeros((129, 2, 3))
    position[:, 0, 2] = (np.arange(129) - 64) / 1024
    motion = unrotated_motion(position)
    detection = create_detector("exact", bodies, **WITHOUT_CONTAINMENT).detect(motion)
    assert np.flatnonzero(detection.verdict[:, 0] == Verdict.CONTACT).tolist() == [64]
    assert detection.work["skipped"] > 64


def test_bodies_at_rest_are_tested_in_the_first_frame_only():
    """499 of 500 frames reuse its answer, and share its set of faces."""
    bodies = bodies_of([plate(None), plate(None)])
    motion = unrotated_motion(np.zeros((500, 2, 3)))
    detection = create_detector("exact", bodies, **WITHOUT_CONTAINMENT).detect(motion, faces=True)
    assert detection.work["reused"] == 499 and detection.work["blocks"] == 1
    assert (detection.face_counts == detection.face_counts[0]).all() and detection.face_counts[0, 0] > 0
    assert len(detection.face_sets.faces) == detection.face_counts[0, 0]


def test_full_face_lists_lose_no_faces():
    """Two soups meet alike in eight frames, and are apart in a ninth; a plate is far from both.

    Of 1,200 draws this is one whose list of faces is full at the last leaves that meet.
    """
    rng, frames = np.random.default_rng(26), 8
    soups = [rng.normal(size=(80, 1, 3)) * 0.6 + rng.normal(size=(80, 3, 3)) * 0.8 for _ in range(2)]
    position = np.zeros((frames + 1, 3, 3))
    position[:, :, 1] = np.arange(frames + 1)[:, None]
    position[-1, 0, 2], position[:, 2, 2] = 10.0, 20.0
    motion = unrotated_motion(position)
    bodies = bodies_of([*soups, plate(None)])
    detection = create_detector("exact", bodies, **WITHOUT_CONTAINMENT).detect(motion, faces=True)
    assert np.array_equal(detection.faces(0, 0), meeting_faces(*soups))
    assert (detection.face_counts[:-1, 0] == len(detection.faces(0, 0))).all()
    assert not detection.face_counts[-1].any() and not detection.face_counts[:, 1:].any()


def test_boolean_query_of_coplanar_grids_lists_no_faces():
    """Two plates of 40 x 40 squares slide in one plane; without faces asked, memory stays below 2 MB.

    Fewer than 600 exact tests a frame are made, of all the pairs that touch.
    """
    bodies = bodies_of([plate(None, size=40), plate(None, size=40)])
    position = np.zeros((24, 2, 3))
    position[:, 0, 0] = np.arange(24) / 64
    motion = unrotated_motion(position)
    detector = create_detector("exact", bodies, **WITHOUT_CONTAINMENT)
    detector.detect(motion.frames(0, 1))
    tracemalloc.start()
    detection = detector.detect(motion)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert (detection.verdict == Verdict.CONTACT).all()
    assert peak < 2e6 and detection.work["exact_tests"] < 24 * 600
