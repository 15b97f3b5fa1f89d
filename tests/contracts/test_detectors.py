"""Every row of the table of detectors keeps these promises."""

from functools import cache

import numpy as np
import pytest
from support.optional import DATA, ROWS, needs_data
from support.shapes import box_mesh, lab_bodies_and_motion, random_rotations, unrotated_motion

from cdcore import Body, Motion, TriangleMesh, Verdict, create_detector, join
from cdcore.errors import CollisionCoreError, InvalidPairError, InvalidPoseError, InvalidSettingError, NotRecordedError
from cdcore.poses import rotation_from_quaternion
from cdcore.protocol import PARTLY_DECIDED, Detector, counts_as_contact, detect_live
from cdcore.protocol.detection import NO_REASON
from replay.prepare.assemble import assemble
from sessions.importers import import_session

FRAMES = 24
LIVE = [
    ("exact", {}), ("exact", {"containment": False}), ("hybrid", {}), ("obb", {}),
    ("obb", {"budget": 300}), ("rapid-style", {}), ("solid-style", {}), ("solid-style", {"budget": 40}), ("aabb", {}),
    ("collider", {"shape": "mesh"}), ("collider", {"shape": "hull", "rate_hz": 30}), ("collider", {"skin_m": 0.005}),
    ("collider", {"shape": "mesh", "skin_m": 0.01}), ("static", {}), ("sphere", {}),
    ("static", {"epsilon": 0.001}), ("static", {"epsilon": 0.02}),
    ("discrete", {"rate_hz": 50}), ("discrete", {}), ("qaco", {"budget": 200}),
    ("hybrid-qaco", {"budget": 200}), ("hybrid-qaco", {"decide": "mesh", "budget": 200}),
]  # fmt: skip
"""Detectors and settings that a live session answers on a path of its own, or must leave to the usual one."""


@pytest.fixture(params=ROWS)
def name(request):
    """Each row of the table of detectors."""
    return request.param


@pytest.fixture(scope="module")
def scene():
    """Bodies and motion of the laboratory."""
    return lab_bodies_and_motion(frames=FRAMES)


@cache
def detection_of_whole_motion(name):
    """The answer of a detector for the whole motion of the laboratory, with faces."""
    bodies, motion = lab_bodies_and_motion(frames=FRAMES)
    return create_detector(name, bodies).detect(motion, faces=True)


def has_faces(detection):
    """Whether a detection lists faces."""
    return detection.face_sets is not None


def test_detector_has_the_methods_of_the_protocol(name, scene):
    bodies, _ = scene
    detector = create_detector(name, bodies)
    assert isinstance(detector, Detector)
    assert detector.name == detection_of_whole_motion(name).detector == name
    assert isinstance(detector.settings, detector.Settings)


def test_repeated_queries_give_the_same_answer(name, scene):
    """A query with poses of two of five bodies is refused in between; a new detector says the same as well."""
    bodies, motion = scene
    detector = create_detector(name, bodies)
    first = detector.detect(motion, faces=True)
    with pytest.raises(CollisionCoreError):
        detector.detect(Motion(motion.times, motion.translations[:, :2], motion.rotations[:, :2]))
    assert first.digest == detector.detect(motion).digest == detection_of_whole_motion(name).digest
    if has_faces(first):
        assert first.faces_digest == detection_of_whole_motion(name).faces_digest


@pytest.mark.parametrize("block", [7, *(pytest.param(size, marks=pytest.mark.slow) for size in (1, 64))])
def test_detector_in_blocks_of_frames_equals_the_whole_motion(name, block, scene):
    """Blocks of 1, 7 and 64 frames."""
    bodies, motion = scene
    joined = join(create_detector(name, bodies).stream(motion.blocks(block), faces=True))
    assert joined.digest == detection_of_whole_motion(name).digest
    assert joined.verdict.shape == detection_of_whole_motion(name).verdict.shape
    if has_faces(joined):
        assert joined.faces_digest == detection_of_whole_motion(name).faces_digest


def test_live_detection_equals_offline_and_times_every_frame(name, scene):
    """Verdicts and what is said of containment; each stage has seconds for each of 24 frames."""
    bodies, motion = scene
    answer = detect_live(create_detector(name, bodies), motion)
    assert answer.digest == detection_of_whole_motion(name).digest
    assert np.array_equal(answer.verdict, detection_of_whole_motion(name).verdict)
    assert answer.containment == detection_of_whole_motion(name).containment
    assert all(spent.shape == (FRAMES,) for spent in answer.seconds.values())
    assert (sum(answer.seconds.values()) > 0).all()


@cache
def restless():
    """Bodies in one heap that jump for 15 frames, then drift, stand still now and then, and lose their pose."""
    bodies, rng = lab_bodies_and_motion(frames=2)[0], np.random.default_rng(8)
    count = 48
    positions, rotations = rng.normal(scale=0.12, size=(count, 5, 3)), random_rotations(rng, count, 5)
    little = rotation_from_quaternion(np.array([0, 0, 0, 1]) + rng.normal(scale=0.004, size=(count, 5, 4)))
    stays = rng.random((count, 5)) < 0.3
    for frame in range(1, count):
        if frame >= 15:
            positions[frame] = positions[frame - 1] + rng.normal(scale=0.003, size=(5, 3))
            rotations[frame] = little[frame] @ rotations[frame - 1]
        positions[frame, stays[frame]] = positions[frame - 1, stays[frame]]
        rotations[frame, stays[frame]] = rotations[frame - 1, stays[frame]]
    return bodies, Motion(np.arange(count) / 90, positions, rotations, rng.random((count, 5)) < 0.95)


@pytest.mark.sampled(2)
@pytest.mark.parametrize("settings", LIVE, ids=str)
def test_all_query_modes_agree_on_jumping_resting_and_lost_bodies(settings):
    """Whole, one frame at a time, in blocks of seven, and with each pair the other way round.

    Clear, contact and lost poses occur, but for ``sphere``, which reports candidates in place of contacts.
    """
    name, chosen = settings
    detector, motion = create_detector(name, restless()[0], **chosen), restless()[1]
    result = detector.detect(motion, faces=True)
    assert {Verdict.CLEAR, Verdict.CONTACT, Verdict.NO_POSE} <= set(result.verdict.ravel().tolist()) or name == "sphere"
    assert np.array_equal(detect_live(detector, motion).verdict, result.verdict)
    joined = join(detector.stream(motion.blocks(7), faces=True))
    assert np.array_equal(joined.verdict, result.verdict)
    assert not has_faces(result) or joined.faces_digest == result.faces_digest
    rotated = create_detector(name, restless()[0], pairs=result.pairs[:, ::-1], **chosen)
    assert rotated.detect(motion).digest == result.digest


@cache
def wands(recording):
    """Two controllers as a person moved them in a recording of A-Frame."""
    wand = DATA / "webxr-vive-controller" / "htc-vive-none.glb"
    file = DATA / "aframe-motion-capture" / f"{recording}.json"
    return assemble(import_session("aframe", file, meshes={"left": wand, "right": wand}))


@needs_data
@pytest.mark.slow
def test_live_is_offline_in_a_real_recording_with_wands(name):
    """Two controllers that a person moved; slow detectors answer for 60 frames in the middle of the recording."""
    assembly = wands("grabLeft")
    detector = create_detector(name, assembly.bodies, pairs=assembly.pairs)
    # Detectors that take milliseconds a frame answer for 60 frames.
    frames = len(assembly.motion) if detector.online and name not in ("qaco", "physx") else 60
    middle = len(assembly.motion) // 2
    motion = assembly.motion.frames(max(0, middle - frames // 2), middle + -(-frames // 2))
    live, offline = detect_live(detector, motion), detector.detect(motion)
    assert live.digest == offline.digest and np.array_equal(live.verdict, offline.verdict)


@pytest.mark.sampled(4)
def test_pairs_written_in_another_order_give_the_same_digests(name, scene):
    """Four pairs; then the last first, and in each the second body first."""
    bodies, motion = scene
    pairs = [("ball", "beaker"), ("rod", "beaker"), ("wand", "rod"), ("table", "ball")]
    forward = create_detector(name, bodies, pairs=pairs).detect(motion, faces=True)
    rotated = [pair[::-1] for pair in pairs[::-1]]
    backward = create_detector(name, bodies, pairs=rotated).detect(motion, faces=True)
    assert forward.digest == backward.digest
    assert np.array_equal(forward.verdict, backward.verdict[:, ::-1])
    if has_faces(forward):
        assert forward.faces_digest == backward.faces_digest


@pytest.mark.sampled(4)
def test_digest_is_independent_of_the_order_of_bodies(name, scene):
    """Five bodies in another order; the digest of verdicts is that of bodies in their order, and that of faces too."""
    bodies, motion = scene
    order = [3, 0, 4, 2, 1]
    # Not [:, order], which lays out the flags column by column: for that kernels are compiled once more.
    shuffled = Motion(
        motion.times, *(part.take(order, axis=1) for part in (motion.translations, motion.rotations, motion.valid))
    )
    detection = create_detector(name, [bodies[k] for k in order]).detect(shuffled, faces=True)
    assert detection.digest == detection_of_whole_motion(name).digest
    if has_faces(detection):
        assert detection.faces_digest == detection_of_whole_motion(name).faces_digest


def test_pair_without_both_poses_gets_verdict_no_pose(name, scene):
    """A verdict of an instant with both poses is another; one of an interval may lack the pose before."""
    (_, motion), detection = scene, detection_of_whole_motion(name)
    lacks_a_pose = ~(motion.valid[:, detection.pairs[:, 0]] & motion.valid[:, detection.pairs[:, 1]])
    assert lacks_a_pose.any()
    assert (detection.verdict[lacks_a_pose] == Verdict.NO_POSE).all()
    if detection.covers == "instants":
        assert (detection.verdict[~lacks_a_pose] != Verdict.NO_POSE).all()


def test_numbers_of_an_invalid_pose_are_ignored(name, scene):
    """Invalid poses become NaN and infinity; the answer stays that of the motion as it was."""
    bodies, motion = scene
    translations, rotations = motion.translations.copy(), motion.rotations.copy()
    translations[~motion.valid], rotations[~motion.valid] = np.nan, np.inf
    poisoned = Motion(motion.times, translations, rotations, motion.valid)
    assert create_detector(name, bodies).detect(poisoned).digest == detection_of_whole_motion(name).digest


def test_an_empty_motion_gives_an_empty_answer(name, scene):
    """No frames, and the ten pairs of five bodies."""
    bodies, motion = scene
    detection = create_detector(name, bodies).detect(motion.frames(0, 0), faces=True)
    assert detection.verdict.shape == (0, 10)
    assert isinstance(detection.digest, str)
    if has_faces(detection):
        assert detection.face_counts.shape == (0, 10)


def test_single_body_has_no_pairs_and_no_verdicts(name, scene):
    """24 frames of one body, whole and live."""
    bodies, motion = scene
    alone = Motion(motion.times, motion.translations[:, :1], motion.rotations[:, :1])
    detector = create_detector(name, bodies[:1])
    assert detector.detect(alone).verdict.shape == (FRAMES, 0)
    assert detect_live(detector, alone).verdict.shape == (FRAMES, 0)


def test_verdicts_are_read_only_and_the_motion_is_not_changed(name, scene):
    bodies, motion = scene
    before = motion.translations.tobytes(), motion.rotations.tobytes()
    detection = create_detector(name, bodies).detect(motion)
    assert (motion.translations.tobytes(), motion.rotations.tobytes()) == before
    with pytest.raises(ValueError, match="read-only"):
        detection.verdict[0, 0] = 1


def test_detection_keeps_times_and_names_with_work_and_seconds(name, scene):
    """Seconds of a stage are one number, or one for each of 24 frames; counters of work are not negative."""
    bodies, motion = scene
    detection = detection_of_whole_motion(name)
    assert np.array_equal(detection.times, motion.times)
    assert detection.names == tuple(body.name for body in bodies)
    assert detection.verdict.dtype == np.uint8
    assert len(detection.containment) == len(detection.pairs)
    assert detection.work and all(np.min(value) >= 0 for value in detection.work.values())
    assert detection.seconds
    for seconds in detection.seconds.values():
        assert np.shape(seconds) in ((FRAMES,), ())
        assert np.min(seconds) >= 0


def test_faces_belong_to_contact_and_are_unique_and_sorted(name):
    """A detector without lists of faces says so; one of instants lists some where it reports contact, only there."""
    detection = detection_of_whole_motion(name)
    if not has_faces(detection):
        with pytest.raises(NotRecordedError, match="holds no face pairs"):
            _ = detection.face_counts
        return
    contact = detection.verdict == Verdict.CONTACT
    if detection.covers == "instants":
        assert np.array_equal(detection.face_counts > 0, contact)
    for frame, pair in np.argwhere(detection.face_counts > 0).tolist():
        rows = [tuple(row) for row in detection.faces(frame, pair).tolist()]
        assert rows == sorted(set(rows))


def test_bad_input_is_refused_by_a_named_error(name, scene):
    """Wrong numbers of bodies, unknown names, pairs of a body with itself, unknown settings, blocks out of order."""
    bodies, motion = scene
    with pytest.raises(InvalidPoseError, match="poses of 5 bodies, the detector has 2"):
        create_detector(name, bodies[:2]).detect(motion)
    with pytest.raises(InvalidPairError, match="no body 'spoon'"):
        create_detector(name, bodies, pairs=[("ball", "spoon")])
    with pytest.raises(InvalidPairError, match="paired with itself"):
        create_detector(name, bodies, pairs=[(1, 1)])
    with pytest.raises(InvalidPairError, match="no bodies"):
        create_detector(name, [])
    with pytest.raises(InvalidSettingError, match="has no setting 'nonsense'"):
        create_detector(name, bodies, nonsense=1)
    with pytest.raises(InvalidPairError, match="used twice: ball"):
        create_detector(name, [bodies[3], bodies[3]])
    with pytest.raises(InvalidPoseError, match="stream the blocks in order"):
        list(create_detector(name, bodies).stream([motion.frames(5, 9), motion.frames(0, 5)]))


def test_detectors_accept_meshes_of_a_single_triangle(name):
    """Frame 0: the triangles cross, which detectors of solids may not report; frame 1: they are far apart."""
    triangle = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    upright = TriangleMesh([[0.25, 0.25, -1], [0.25, 0.25, 1], [0.3, 0.9, 1]], [[0, 1, 2]])
    bodies = [Body("a", triangle), Body("b", upright)]
    motion = unrotated_motion([[[0, 0, 0], [0, 0, 0]], [[0, 0, 0], [9, 9, 9]]])
    verdict = create_detector(name, bodies).detect(motion).verdict[:, 0]
    if create_detector(name, bodies).detect(motion).covers == "instants":
        assert counts_as_contact(verdict).tolist() in ([True, False], [False, False])


def test_the_scene_of_these_tests_has_every_verdict_that_counts():
    """By ``hybrid``: a scene without contacts, or without lost poses, would test nothing above."""
    assert {Verdict.CLEAR, Verdict.CONTACT, Verdict.NO_POSE} <= set(
        np.unique(detection_of_whole_motion("hybrid").verdict).tolist()
    )


@cache
def undecided_scene():
    """A cup that lacks its lid, an open sheet beside a block, and small bodies that go into and past them."""
    box = box_mesh([0.2] * 3)
    cup = TriangleMesh(box.vertices, box.faces[~(box.triangles[:, :, 2] == 0.1).all(axis=1)])
    bodies = [Body("cup", cup), Body("block", box_mesh([0.2] * 3)), Body("probe", box_mesh([0.02] * 3))]
    positions = np.zeros((30, 3, 3))
    positions[:, 1] = [0.5, 0.0, 0.0]
    positions[:, 2, 2] = np.linspace(0.2, -0.2, 30)
    positions[15:, 2, 0] = np.linspace(0.0, 0.5, 15)
    return bodies, unrotated_motion(positions)


def test_every_undecided_verdict_carries_a_reason(name):
    """A cup without its lid and a probe that goes into it, whole, frame by frame and in blocks of seven frames.

    A detector that decides containment only partly leaves a verdict UNRESOLVED there.
    """
    bodies, motion = undecided_scene()
    detector = create_detector(name, bodies)
    offline, live = detector.detect(motion), detect_live(detector, motion)
    for result in (offline, live, join(detector.stream(motion.blocks(7)))):
        undecided = np.argwhere((result.verdict == Verdict.UNRESOLVED) | (result.verdict == Verdict.INVALID))
        assert {(frame, pair) for frame, pair in undecided.tolist()} <= set(result.reasons)
        reasons = [result.reasons[frame, pair] for frame, pair in undecided.tolist()]
        assert all(reason and reason != NO_REASON for reason in reasons)
        if any(word.startswith(PARTLY_DECIDED) for word in result.containment):
            assert (result.verdict == Verdict.UNRESOLVED).any()
