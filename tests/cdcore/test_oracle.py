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
"""Detectors that promise every pair of faces that meet."""
WITHOUT_CONTAINMENT = {"containment": False}
"""Whether a body is inside another, without touching it, is not asked."""
FAR_AWAY_M = (1e7, 1e15, 1e60, 1e80, 1e160, 1e300)
"""Metres: from a pose that no room has to one whose square is no number."""
QUICK_WORLDS = [(shape, 5) for shape in SHAPES]
"""Shape of the first of three bodies, and seed of the others and of a motion of 13 frames."""
SLOW_WORLDS = [(shape, seed) for shape in SHAPES for seed in range(6, 30)]
FEW_WORLDS = [("soup", 5), ("plate", 6), ("ball", 7), ("corrupt", 1e15)]
"""Drifting, resting and sliding bodies, and one that is 1e15 m away in a frame."""


def quick_and_slow(quick, slow):
    """A mark that runs a test on few worlds, and slowly on many."""
    return pytest.mark.parametrize("worlds", [quick, pytest.param(slow, marks=pytest.mark.slow)], ids=len)


def corrupted(far):
    """Random bodies, 13 frames: body 0 is ``far`` metres away in frame 4, bodies 0 and 1 in frame 8; in 7 no poses."""
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


def compare_with_brute_force(key, name, frames):
    """Verdicts and faces of a detector that are not those of brute force, as texts; and how many face pairs met."""
    world = world_of(key)
    detection = create_detector(name, world.bodies, **WITHOUT_CONTAINMENT).detect(world.motion, faces=True)
    differences, meeting = [], 0
    for (frame, column), faces in faces_by_brute_force(key, frames).items():
        verdict, label = detection.verdict[frame, column], f"{key} {name} frame {frame} pair {column}"
        if faces is None:
            expected = Verdict.NO_POSE
        else:
            expected = Verdict.CONTACT if len(faces) else Verdict.CLEAR
            meeting += len(faces)
            if not np.array_equal(detection.faces(frame, column), faces):
                differences.append(f"{label}: other faces")
        if verdict != expected:
            differences.append(f"{label}: {Verdict(verdict).name} instead of {expected.name}")
    return differences, meeting


@quick_and_slow(QUICK_WORLDS, SLOW_WORLDS)
@pytest.mark.parametrize("name", COMPLETE_DETECTORS)
def test_complete_detectors_list_exactly_the_meeting_faces(name, worlds):
    """Worlds of three bodies; brute force tests every pair of faces in integers, in the last of 13 frames."""
    differences, meeting = [], 0
    for world in worlds:
        differences_here, meeting_here = compare_with_brute_force(world, name, frames=(12,))
        differences += differences_here
        meeting += meeting_here
    assert differences == []
    assert meeting > 50, "faces meet in these worlds"


@pytest.mark.sampled(2)
@pytest.mark.parametrize("name", ["exact", "aabb", "solid-style"])
@pytest.mark.parametrize("far", FAR_AWAY_M)
def test_a_corrupt_pose_changes_no_other_frame(name, far):
    """Bodies are ``far`` metres away in frames 4 and 8, and have no poses in frame 7; all other frames stay right.

    Truth is brute force over all pairs of faces.
    """
    frames = (0, 3, 4, 5, 7, 8, 9, 12)  # the first and the last, those frames, and their neighbours
    differences, meeting = compare_with_brute_force(("corrupt", far), name, frames)
    assert differences == []
    assert meeting > 0, "faces meet in some of these frames"


@quick_and_slow(FEW_WORLDS, [*QUICK_WORLDS, *SLOW_WORLDS, *(("corrupt", far) for far in FAR_AWAY_M)])
@pytest.mark.parametrize("name", COMPLETE_DETECTORS)
def test_detection_is_independent_of_blocks_and_pair_order(name, worlds):
    """The answer to a motion of 13 frames is the same frame by frame, in blocks of 5, and for pairs in another order.

    Digests hash verdicts (``digest``) and lists of faces (``faces_digest``), by the names of the bodies of a pair.
    """
    for key in worlds:
        world = world_of(key)
        detector, motion = create_detector(name, world.bodies, **WITHOUT_CONTAINMENT), world.motion
        whole = detector.detect(motion, faces=True)
        assert detect_live(detector, motion).digest == whole.digest, key
        joined = join(detector.stream(motion.blocks(5), faces=True))
        assert (joined.digest, joined.faces_digest) == (whole.digest, whole.faces_digest), key
        reordered_pairs = [(2, 1), (1, 0), (0, 2)]  # by default (0, 1), (0, 2), (1, 2)
        reordered = create_detector(name, world.bodies, pairs=reordered_pairs, **WITHOUT_CONTAINMENT)
        answer = reordered.detect(motion, faces=True)
        assert (answer.digest, answer.faces_digest) == (whole.digest, whole.faces_digest), key


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
    """A soup of triangles wanders beside a ball for 400 frames; in frame 200 it is ``far`` metres away.

    Tests of tree nodes, in a body's frame (``node_tests``) and in the world's (``world_tests``), are at most a fifth
    more, and 100 for that frame.
    """
    bodies, motion = long_motion(frames=400)
    position = motion.translations.copy()
    position[200, 0] = far
    corrupt_motion = Motion(motion.times, position, motion.rotations)
    detector = create_detector("exact", bodies, **WITHOUT_CONTAINMENT)
    work = detector.detect(motion, faces=True).work
    corrupt_work = create_detector("exact", bodies, **WITHOUT_CONTAINMENT).detect(corrupt_motion, faces=True).work
    for counter in ("node_tests", "world_tests"):
        assert corrupt_work[counter] <= 1.2 * work[counter] + 100, counter


def test_distant_bodies_are_skipped_while_paths_allow():
    """Two bodies stay some 100 m apart, while one of them wanders: no frame of 8,192 needs its trees searched.

    It moves by at most 64, 78 and 90 64ths of a metre along x, y and z, 2.1 m a frame: a distance that was measured
    lasts for 30 frames and more.
    """
    frames = 8_192
    bodies, motion = long_motion(frames=frames, away=100.0)
    work = create_detector("exact", bodies, **WITHOUT_CONTAINMENT).detect(motion).work
    assert work["skipped"] == frames
    assert work["blocks"] == 0, "blocks of frames whose trees are searched"
    assert work["gap_tests"] < frames / 30


def test_small_fast_bodies_meet_in_the_right_frame():
    """A plate falls through a parallel one by 1/1024 m a frame and is level with it in frame 64 of 129.

    More than half of the frames are skipped: their bodies cannot have come together since the last test.
    """
    frames, level = 129, 64
    plates = bodies_of([plate(None) / 512, plate(None) / 512])  # squares of 3/512 m
    position = np.zeros((frames, 2, 3))
    position[:, 0, 2] = (np.arange(frames) - level) / 1024
    detection = create_detector("exact", plates, **WITHOUT_CONTAINMENT).detect(unrotated_motion(position))
    assert np.flatnonzero(detection.verdict[:, 0] == Verdict.CONTACT).tolist() == [level]
    assert detection.work["skipped"] > frames / 2


def test_bodies_at_rest_are_tested_in_the_first_frame_only():
    """Two plates lie in each other for 500 frames: 499 frames reuse the answer of the first, and share its set of
    faces.
    """
    plates = bodies_of([plate(None), plate(None)])
    detector = create_detector("exact", plates, **WITHOUT_CONTAINMENT)
    detection = detector.detect(unrotated_motion(np.zeros((500, 2, 3))), faces=True)
    assert detection.work["reused"] == 499
    assert detection.work["blocks"] == 1, "blocks of frames whose trees are searched"
    (first_count, *later_counts) = detection.face_counts[:, 0].tolist()
    assert first_count > 0
    assert set(later_counts) == {first_count}
    assert len(detection.face_sets.faces) == first_count, "stored once for all frames"


def test_full_face_lists_lose_no_faces():
    """Two soups of 80 triangles meet alike in 8 frames, shifted as a whole, and are apart in a ninth.

    A plate 20 m off meets neither. Of 1,200 seeds 26 is one whose list of faces is full at the last leaves that meet.
    """
    rng, frames = np.random.default_rng(26), 8
    soups = [rng.normal(size=(80, 1, 3)) * 0.6 + rng.normal(size=(80, 3, 3)) * 0.8 for _ in range(2)]
    position = np.zeros((frames + 1, 3, 3))
    position[:, :, 1] = np.arange(frames + 1)[:, None]
    position[-1, 0, 2], position[:, 2, 2] = 10.0, 20.0
    bodies = bodies_of([*soups, plate(None)])
    detection = create_detector("exact", bodies, **WITHOUT_CONTAINMENT).detect(unrotated_motion(position), faces=True)
    meeting = meeting_faces(*soups)
    assert np.array_equal(detection.faces(frame=0, pair=0), meeting)
    of_both_soups, with_the_plate = detection.face_counts[:, 0], detection.face_counts[:, 1:]
    assert of_both_soups.tolist() == frames * [len(meeting)] + [0]
    assert not with_the_plate.any()


def test_boolean_query_of_coplanar_grids_lists_no_faces():
    """Two plates of 40 x 40 squares slide in one plane; only verdicts are asked, and memory stays below 2 MB.

    Over 20,000 face pairs touch in each of 24 frames: a list of all, at 8 bytes each, would take 4 MB. Fewer than 600 a
    frame are tested exactly.
    """
    frames = 24
    bodies = bodies_of([plate(None, size=40), plate(None, size=40)])
    position = np.zeros((frames, 2, 3))
    position[:, 0, 0] = np.arange(frames) / 64
    motion = unrotated_motion(position)
    detector = create_detector("exact", bodies, **WITHOUT_CONTAINMENT)
    detector.detect(motion.frames(0, 1))  # what is compiled or built once does not count
    tracemalloc.start()
    detection = detector.detect(motion)
    _, peak_bytes = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert (detection.verdict == Verdict.CONTACT).all()
    assert peak_bytes < 2e6
    assert detection.work["exact_tests"] < 600 * frames
