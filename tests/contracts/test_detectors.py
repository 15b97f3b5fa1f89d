"""Every row of the table of detectors keeps these promises."""

from functools import cache

import numpy as np
import pytest
from support.optional import DATA, ROWS, needs_data
from support.shapes import box_mesh, lab_bodies_and_motion, random_rotations, unrotated_motion

from cdcore import Body, Motion, TriangleMesh, Verdict, create_detector, join
from cdcore.errors import InvalidPairError, InvalidPoseError, InvalidSettingError, NotRecordedError
from cdcore.poses import rotation_from_quaternion
from cdcore.protocol import PARTLY_DECIDED, Detector, counts_as_contact, detect_live
from cdcore.protocol.detection import NO_REASON
from replay.prepare.assemble import assemble
from sessions.importers import import_session

FRAMES = 16
"""Frames of ``scene``: five bodies, three of which move through the others, with poses missing now and then."""
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
    """Its name is that of its row, also in its answers; its settings are of the class that it declares."""
    bodies, _ = scene
    detector = create_detector(name, bodies)
    assert isinstance(detector, Detector)
    assert detector.name == detection_of_whole_motion(name).detector == name
    assert isinstance(detector.settings, detector.Settings)


def test_repeated_queries_give_the_same_answer_and_change_nothing(name, scene):
    """A detector is asked twice; in between it refuses a motion of two of its five bodies, which changes nothing.

    A new detector answers the same as well: verdicts, and faces where it lists some. The motion has the same bytes
    afterwards, and the verdicts refuse to be written.
    """
    bodies, motion = scene
    before = motion.translations.tobytes(), motion.rotations.tobytes()
    detector = create_detector(name, bodies)
    first = detector.detect(motion, faces=True)
    of_two_bodies = Motion(motion.times, motion.translations[:, :2], motion.rotations[:, :2])
    with pytest.raises(InvalidPoseError, match="the motion has poses of 2 bodies, the detector has 5"):
        detector.detect(of_two_bodies)
    assert first.digest == detector.detect(motion).digest == detection_of_whole_motion(name).digest
    if has_faces(first):
        assert first.faces_digest == detection_of_whole_motion(name).faces_digest
    assert (motion.translations.tobytes(), motion.rotations.tobytes()) == before
    with pytest.raises(ValueError, match="read-only"):
        first.verdict[0, 0] = 1


@pytest.mark.parametrize("block", [7, *(pytest.param(size, marks=pytest.mark.slow) for size in (1, 64))])
def test_detector_in_blocks_of_frames_equals_the_whole_motion(name, block, scene):
    """16 frames are read in blocks of 7, of a single frame, and of 64, more than there are."""
    bodies, motion = scene
    joined = join(create_detector(name, bodies).stream(motion.blocks(block), faces=True))
    assert joined.digest == detection_of_whole_motion(name).digest
    assert joined.verdict.shape == detection_of_whole_motion(name).verdict.shape
    if has_faces(joined):
        assert joined.faces_digest == detection_of_whole_motion(name).faces_digest


def test_live_detection_equals_offline_and_times_every_frame(name, scene):
    """Asked frame by frame, as in a live session: verdicts, and what is said of bodies inside others, are the same.

    Each stage has seconds for each of 16 frames, and together they are more than 0.
    """
    bodies, motion = scene
    live, offline = detect_live(create_detector(name, bodies), motion), detection_of_whole_motion(name)
    assert live.digest == offline.digest
    assert np.array_equal(live.verdict, offline.verdict)
    assert live.containment == offline.containment
    assert all(seconds.shape == (FRAMES,) for seconds in live.seconds.values())
    assert (sum(live.seconds.values()) > 0).all()


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
    """Five bodies jump for 15 of 48 frames, then drift, rest now and then, and lose their poses.

    The answer is the same for all frames at once, live, in blocks of seven, and with the bodies of each pair exchanged.
    Clear, contact and lost poses occur, but for ``sphere``, which reports candidates in place of contacts.
    """
    name, own_settings = settings
    bodies, motion = restless()
    detector = create_detector(name, bodies, **own_settings)
    at_once = detector.detect(motion, faces=True)
    verdicts = set(at_once.verdict.ravel().tolist())
    assert {Verdict.CLEAR, Verdict.CONTACT, Verdict.NO_POSE} <= verdicts or name == "sphere"
    assert np.array_equal(detect_live(detector, motion).verdict, at_once.verdict)
    in_blocks = join(detector.stream(motion.blocks(7), faces=True))
    assert np.array_equal(in_blocks.verdict, at_once.verdict)
    assert not has_faces(at_once) or in_blocks.faces_digest == at_once.faces_digest
    exchanged = create_detector(name, bodies, pairs=at_once.pairs[:, ::-1], **own_settings)
    assert exchanged.detect(motion).digest == at_once.digest


@cache
def wands(recording):
    """Two controllers as a person moved them in a recording of A-Frame."""
    wand = DATA / "webxr-vive-controller" / "htc-vive-none.glb"
    file = DATA / "aframe-motion-capture" / f"{recording}.json"
    return assemble(import_session("aframe", file, meshes={"left": wand, "right": wand}))


@needs_data
@pytest.mark.slow
def test_live_is_offline_in_a_real_recording_with_wands(name):
    """Two controllers that a person moved, in a recording of A-Frame: all of its frames, asked at once and one by one.

    Only 60 frames, in its middle, are asked of ``qaco``, ``physx`` and detectors that are not made to be asked live
    (``online``): these take milliseconds a frame.
    """
    assembly = wands("grabLeft")
    detector = create_detector(name, assembly.bodies, pairs=assembly.pairs)
    is_fast = detector.online and name not in ("qaco", "physx")
    frames = len(assembly.motion) if is_fast else 60
    middle = len(assembly.motion) // 2
    motion = assembly.motion.frames(max(0, middle - frames // 2), middle + -(-frames // 2))
    live, offline = detect_live(detector, motion), detector.detect(motion)
    assert live.digest == offline.digest
    assert np.array_equal(live.verdict, offline.verdict)


@pytest.mark.sampled(4)
def test_pairs_written_in_another_order_give_the_same_digests(name, scene):
    """Four pairs of bodies; then the last pair comes first, and in each pair the second body."""
    bodies, motion = scene
    pairs = [("ball", "beaker"), ("rod", "beaker"), ("wand", "rod"), ("table", "ball")]
    forward = create_detector(name, bodies, pairs=pairs).detect(motion, faces=True)
    exchanged = [(second, first) for first, second in reversed(pairs)]
    backward = create_detector(name, bodies, pairs=exchanged).detect(motion, faces=True)
    assert forward.digest == backward.digest
    assert np.array_equal(forward.verdict, backward.verdict[:, ::-1])
    if has_faces(forward):
        assert forward.faces_digest == backward.faces_digest


@pytest.mark.sampled(4)
def test_digest_is_independent_of_the_order_of_bodies(name, scene):
    """Five bodies in another order: the digests of verdicts and of faces are those of bodies in their order."""
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
    """A detector of instants says so there alone; one of intervals also where the frame before has no pose."""
    (_, motion), detection = scene, detection_of_whole_motion(name)
    first, second = detection.pairs.T
    lacks_a_pose = ~(motion.valid[:, first] & motion.valid[:, second])
    assert lacks_a_pose.any()
    assert (detection.verdict[lacks_a_pose] == Verdict.NO_POSE).all()
    if detection.covers == "instants":
        assert (detection.verdict[~lacks_a_pose] != Verdict.NO_POSE).all()


def test_numbers_of_an_invalid_pose_are_ignored(name, scene):
    """Poses that the motion marks as invalid become NaN and infinity; the answer stays that of the motion as it was."""
    bodies, motion = scene
    translations, rotations = motion.translations.copy(), motion.rotations.copy()
    translations[~motion.valid], rotations[~motion.valid] = np.nan, np.inf
    poisoned = Motion(motion.times, translations, rotations, motion.valid)
    assert create_detector(name, bodies).detect(poisoned).digest == detection_of_whole_motion(name).digest


def test_an_empty_motion_gives_an_empty_answer(name, scene):
    """The motion has no frames, its five bodies ten pairs; the answer has a digest all the same."""
    bodies, motion = scene
    detection = create_detector(name, bodies).detect(motion.frames(0, 0), faces=True)
    assert detection.verdict.shape == (0, 10)
    assert isinstance(detection.digest, str)
    if has_faces(detection):
        assert detection.face_counts.shape == (0, 10)


def test_single_body_has_no_pairs_and_no_verdicts(name, scene):
    """16 frames of one body, all at once and frame by frame: verdicts of 16 frames and 0 pairs."""
    bodies, motion = scene
    alone = Motion(motion.times, motion.translations[:, :1], motion.rotations[:, :1])
    detector = create_detector(name, bodies[:1])
    assert detector.detect(alone).verdict.shape == (FRAMES, 0)
    assert detect_live(detector, alone).verdict.shape == (FRAMES, 0)


def test_detection_keeps_times_and_names_with_work_and_seconds(name, scene):
    """Seconds of a stage are one number, or one for each of 16 frames; counters of work are not negative."""
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
    """A detector of instants lists pairs of faces where it reports contact, and only there; one of intervals may.

    A detector without lists of faces says so when they are read.
    """
    detection = detection_of_whole_motion(name)
    if not has_faces(detection):
        with pytest.raises(NotRecordedError, match="holds no face pairs"):
            _ = detection.face_counts
        return
    if detection.covers == "instants":
        assert np.array_equal(detection.face_counts > 0, detection.verdict == Verdict.CONTACT)
    for frame, pair in np.argwhere(detection.face_counts > 0).tolist():
        face_pairs = [tuple(faces) for faces in detection.faces(frame, pair).tolist()]
        assert face_pairs == sorted(set(face_pairs)), (frame, pair)


def test_bad_input_is_refused_by_a_named_error(name, scene):
    """Detectors of five bodies, the fourth of which is the ball; the motion has poses of all five."""
    bodies, motion = scene
    ball = bodies[3]
    with pytest.raises(InvalidPoseError, match="poses of 5 bodies, the detector has 2"):
        create_detector(name, bodies[:2]).detect(motion)
    with pytest.raises(InvalidPairError, match="no body 'spoon'"):
        create_detector(name, bodies, pairs=[("ball", "spoon")])
    with pytest.raises(InvalidPairError, match="paired with itself"):
        create_detector(name, bodies, pairs=[("ball", "ball")])
    with pytest.raises(InvalidPairError, match="no bodies"):
        create_detector(name, [])
    with pytest.raises(InvalidSettingError, match="has no setting 'nonsense'"):
        create_detector(name, bodies, nonsense=1)
    with pytest.raises(InvalidPairError, match="used twice: ball"):
        create_detector(name, [ball, ball])
    later_block_first = [motion.frames(5, 9), motion.frames(0, 5)]
    with pytest.raises(InvalidPoseError, match="stream the blocks in order"):
        list(create_detector(name, bodies).stream(later_block_first))


def test_detectors_accept_meshes_of_a_single_triangle(name):
    """Frame 0: two triangles cross, which detectors of solids may not report; frame 1: they are far apart.

    A detector of intervals may report the way between the two frames.
    """
    triangle = TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    upright = TriangleMesh([[0.25, 0.25, -1], [0.25, 0.25, 1], [0.3, 0.9, 1]], [[0, 1, 2]])
    at_the_origin, far_away = [0, 0, 0], [9, 9, 9]
    motion = unrotated_motion([[at_the_origin, at_the_origin], [at_the_origin, far_away]])
    detection = create_detector(name, [Body("a", triangle), Body("b", upright)]).detect(motion)
    assert detection.verdict.shape == (2, 1)
    if detection.covers == "instants":
        assert not counts_as_contact(detection.verdict[1, 0])


def test_the_scene_of_these_tests_has_every_verdict_that_counts():
    """``hybrid`` reports clear, contact and lost poses: without any of them the tests above would prove less."""
    verdicts = set(np.unique(detection_of_whole_motion("hybrid").verdict).tolist())
    assert {Verdict.CLEAR, Verdict.CONTACT, Verdict.NO_POSE} <= verdicts


@cache
def undecided_scene():
    """A cup, a box of 0.2 m that lacks its lid, a block beside it, and a probe of 2 cm, in 16 frames.

    The probe goes down into the cup, then through its wall and into the block.
    """
    box = box_mesh([0.2] * 3)
    cup = TriangleMesh(box.vertices, box.faces[~(box.triangles[:, :, 2] == 0.1).all(axis=1)])
    bodies = [Body("cup", cup), Body("block", box_mesh([0.2] * 3)), Body("probe", box_mesh([0.02] * 3))]
    positions = np.zeros((16, 3, 3))
    positions[:, 1] = [0.5, 0.0, 0.0]
    positions[:, 2, 2] = np.linspace(0.2, -0.2, 16)
    positions[8:, 2, 0] = np.linspace(0.0, 0.5, 8)
    return bodies, unrotated_motion(positions)


def test_every_undecided_verdict_carries_a_reason(name):
    """Whether a probe is inside a cup without its lid may be undecided; all frames, frame by frame, or seven a block.

    A detector that says that it decides containment only partly leaves a verdict undecided there.
    """
    bodies, motion = undecided_scene()
    detector = create_detector(name, bodies)
    detections = {
        "at once": detector.detect(motion),
        "live": detect_live(detector, motion),
        "in blocks": join(detector.stream(motion.blocks(7))),
    }
    for mode, detection in detections.items():
        is_undecided = (detection.verdict == Verdict.UNRESOLVED) | (detection.verdict == Verdict.INVALID)
        for frame, pair in np.argwhere(is_undecided).tolist():
            assert detection.reasons[frame, pair] not in ("", NO_REASON), (mode, frame)
        if any(text.startswith(PARTLY_DECIDED) for text in detection.containment):
            assert (detection.verdict == Verdict.UNRESOLVED).any(), mode
