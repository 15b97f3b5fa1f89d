"""``discrete`` is right in the frames it samples and repeats its last answer in between; colliders answer for shapes.

``discrete`` tests meshes; ``collider`` tests shapes in their place. Both may sample at a rate of their own.
"""

import numpy as np
import pytest
from support.shapes import ball_mesh, box_mesh, lab_bodies_and_motion, revolved_mesh, unrotated_motion

from cdcore import Body, Motion, Verdict, create_detector, join
from cdcore.protocol import counts_as_contact, detect_live

BODIES = [Body("ball", ball_mesh(0.5)), Body("box", box_mesh())]


def ball_at_x(xs, times):
    """The ball on the x axis at these places, and the box at the origin."""
    positions = np.zeros((len(xs), 2, 3))
    positions[:, 0, 0] = xs
    return unrotated_motion(positions, times)


def contact_at_random(times):
    """Whether the ball meets the box in each frame, at random, and its motion: 0.9 m or 3 m from the box's middle.

    They meet below 1 m, the ball's radius and half the box.
    """
    meets = np.random.default_rng(3).random(len(times)) < 0.5
    return meets, ball_at_x(np.where(meets, 0.9, 3.0), times)


def assert_samples(detection, sampled_frames, meets):
    """Asserts that answers are right in these frames, and each is repeated until the next of them."""
    frames = np.arange(len(meets))
    last_sampled = np.asarray(sampled_frames)[np.searchsorted(sampled_frames, frames, side="right") - 1]
    assert detection.work["looks"] == len(sampled_frames)
    assert detection.work["held"] == len(meets) - len(sampled_frames)
    assert np.array_equal(counts_as_contact(detection.verdict[:, 0]), meets[last_sampled])


@pytest.mark.sampled(3)
@pytest.mark.parametrize("seed", range(3))
def test_discrete_without_a_rate_equals_hybrid(seed):
    """Five bodies in a laboratory, 70 frames: it samples every frame, so that it never repeats an old answer;
    ``hybrid`` tests the same meshes.
    """
    bodies, motion = lab_bodies_and_motion(frames=70, seed=seed)
    hybrid = create_detector("hybrid", bodies).detect(motion, faces=True)
    discrete = create_detector("discrete", bodies).detect(motion, faces=True)
    assert discrete.digest == hybrid.digest
    assert discrete.faces_digest == hybrid.faces_digest
    assert discrete.work["held"] == 0, "answers repeated"


def test_faces_queried_afterwards_equal_faces_of_detection():
    """Face pairs of contacts, asked after the detection (``faces_of``), are those that it lists when asked at once."""
    bodies, motion = lab_bodies_and_motion(frames=90)
    detector = create_detector("discrete", bodies)
    detection = detector.detect(motion, faces=True)
    afterwards, at_once = detector.faces_of(motion, detection.verdict == Verdict.CONTACT), detection.face_sets
    assert len(afterwards.faces) > 100
    assert np.array_equal(afterwards.frame, at_once.frame)
    assert np.array_equal(afterwards.pair, at_once.pair)
    for frame, pair in zip(afterwards.frame, afterwards.pair, strict=True):
        assert np.array_equal(afterwards.at(frame, pair), at_once.at(frame, pair)), (frame, pair)


def test_faces_of_repeated_contacts_are_unknown_afterwards():
    """With a sampling rate contacts are repeated between samples, whose faces only the whole work again tells: None."""
    bodies, motion = lab_bodies_and_motion(frames=90)
    detector = create_detector("discrete", bodies, rate_hz=30)
    contacts = detector.detect(motion).verdict == Verdict.CONTACT
    assert detector.faces_of(motion, contacts) is None


@pytest.mark.parametrize("decimals", [None, 9], ids=["exact stamps", "stamps in nanoseconds"])
def test_quarter_rate_samples_every_fourth_frame_despite_rounded_stamps(decimals):
    """A ball meets a box or not, at random from frame to frame, for a minute at 90 Hz; at 22.5 Hz answers are right in
    frames 0, 4, 8, ... and repeated until the next of them.
    """
    frames = 60 * 90
    times = np.arange(frames) / 90
    times = times if decimals is None else np.round(times, decimals)
    meets, motion = contact_at_random(times)
    detection = create_detector("discrete", BODIES, rate_hz=90 / 4).detect(motion)
    assert_samples(detection, range(0, frames, 4), meets)


def test_samples_are_first_frames_at_or_after_ticks():
    """A ball meets a box or not, at random in 300 frames 2 to 130 ms apart; ticks are 10 a second, and the first frame
    at or after a tick is sampled.

    A stream in blocks of seven frames gives the same answers.
    """
    rate_hz, block = 10.0, 7
    times = 7.3 + np.cumsum(np.random.default_rng(0).uniform(0.002, 0.13, 300))
    ticks = np.floor(times * rate_hz)
    first_frames = [0, *(np.flatnonzero(np.diff(ticks) > 0) + 1).tolist()]
    meets, motion = contact_at_random(times)
    detector = create_detector("discrete", BODIES, rate_hz=rate_hz)
    assert_samples(detector.detect(motion), first_frames, meets)
    assert_samples(join(detector.stream(motion.blocks(block))), first_frames, meets)


def ball_leaves_in_frame_4_without_a_pose(lost):
    """12 frames at 90 Hz: a ball meets a box in frames 0 to 3 and is 3 m away from frame 4 on; no pose where lost."""
    times, valid = np.arange(12) / 90, np.ones((12, 2), dtype=bool)
    valid[lost, 0] = False
    motion = ball_at_x([0.9] * 4 + [3.0] * 8, times)
    return Motion(times, motion.translations, motion.rotations, valid)


@pytest.mark.parametrize("name", ["discrete", "collider"])
def test_sample_without_a_pose_leaves_the_last_answer(name):
    """Samples at 22.5 of 90 Hz, frames 0, 4 and 8; the ball left in frame 4, but has no pose in frames 4 and 5.

    Frames 6 and 7 repeat the contact of frame 0.
    """
    motion = ball_leaves_in_frame_4_without_a_pose(lost=[4, 5])
    detection = create_detector(name, BODIES, rate_hz=22.5).detect(motion)
    expected = 4 * [Verdict.CONTACT] + 2 * [Verdict.NO_POSE] + 2 * [Verdict.CONTACT] + 4 * [Verdict.CLEAR]
    assert detection.verdict[:, 0].tolist() == expected


def test_faces_after_a_sample_without_a_pose_are_the_last():
    """A ball meets a box in frame 0, which is sampled; in frames 4 and 5 it has no pose, so that the sample of frame 4
    fails: frame 6 repeats the face pairs of frame 0.
    """
    motion = ball_leaves_in_frame_4_without_a_pose(lost=[4, 5])
    detection = create_detector("discrete", BODIES, rate_hz=22.5).detect(motion, faces=True)
    in_frame_0, in_frame_6 = (detection.faces(frame, pair=0).tolist() for frame in (0, 6))
    assert in_frame_0
    assert in_frame_6 == in_frame_0


@pytest.mark.parametrize("name", ["discrete", "collider"])
def test_frames_before_the_first_answered_sample_have_no_answer(name):
    """Samples at 22.5 of 90 Hz, frames 0, 4 and 8; a ball beside a box has no pose up to frame 5: frames 6 and 7 have
    no answer to repeat, NOT_FOUND.
    """
    motion = ball_leaves_in_frame_4_without_a_pose(lost=[0, 1, 2, 3, 4, 5])
    detection = create_detector(name, BODIES, rate_hz=22.5).detect(motion)
    expected = 6 * [Verdict.NO_POSE] + 2 * [Verdict.NOT_FOUND] + 4 * [Verdict.CLEAR]
    assert detection.verdict[:, 0].tolist() == expected


@pytest.mark.parametrize("block", [None, 3], ids=["whole motion", "blocks of 3 frames"])
def test_faces_and_sections_stay_with_their_sampled_verdict(block):
    """A ball of 0.5 m moves in the wall of a box at 90 Hz; samples at 22.5 Hz are frames 0 and 4 of eight.

    Frames 1 to 3 repeat the face pairs of frame 0 and its section, the segments in which surfaces cross.
    """
    times = np.arange(8) / 90
    motion = ball_at_x([0.9, 0.91, 0.92, 0.93, 0.8, 0.81, 0.82, 0.83], times)
    detector = create_detector("discrete", BODIES, rate_hz=22.5)
    if block is None:
        detection = detector.detect(motion, faces=True)
    else:
        detection = join(detector.stream(motion.blocks(block), faces=True))
    faces = [detection.faces(frame, pair=0).tolist() for frame in range(8)]
    sections = [detection.section(frame, pair=0).tolist() for frame in range(8)]
    assert faces[:4] == 4 * [faces[0]]
    assert sections[:4] == 4 * [sections[0]]
    assert faces[4] != faces[0]
    assert len(sections[5]) > 0


RIM, INNER = 0.1, 0.033
BEAKER = Body("beaker", revolved_mesh([(0, 0), (0.035, 0), (0.035, RIM), (INNER, RIM), (INNER, 0.002), (0, 0.002)], 40))
ROD = Body("rod", box_mesh((0.006, 0.006, 0.2), (0.0, 0.0, 0.1)))


def stirring(rate=90.0, seconds=8.0):
    """The rod's foot goes up and down through the rim: height of the foot over time, and the motion."""
    times = np.arange(int(seconds * rate)) / rate
    foot = RIM + 0.05 * np.cos(2 * np.pi * 0.35 * times + 0.2)
    positions = np.zeros((len(times), 2, 3))
    positions[:, 1, 2] = foot
    return foot, Motion(times, positions, np.broadcast_to(np.eye(3), (len(times), 2, 3, 3)))


def test_beaker_hull_is_false_while_the_rod_is_below_rim():
    """A rod's foot goes up and down between 0.05 and 0.15 m in the hollow of a beaker and touches no wall.

    The beaker's convex hull fills the hollow up to the rim at 0.1 m: there the hulls meet.
    """
    foot, motion = stirring()
    exact = create_detector("exact", [BEAKER, ROD]).detect(motion)
    assert not counts_as_contact(exact.verdict).any()
    hulls = create_detector("collider", [BEAKER, ROD], shape="hull").detect(motion)
    below_rim = foot <= RIM
    assert 0 < below_rim.sum() < len(below_rim)
    assert np.array_equal(counts_as_contact(hulls.verdict[:, 0]), below_rim)


def test_sphere_explains_a_missed_corner_by_its_shape():
    """A cube of 1 m rotated by 45 degrees reaches 0.71 m and meets a pin of 0.1 m whose middle is at 0.65 m.

    Their spheres, of radius 0.5 and 0.05 m, do not meet, which the detector explains of this contact, though it looked.
    """
    bodies = [Body("cube", box_mesh()), Body("pin", box_mesh((0.1, 0.1, 0.1)))]
    rotation, half = np.tile(np.eye(3), (1, 2, 1, 1)), np.sqrt(0.5)
    rotation[0, 0, :2, :2] = [[half, -half], [half, half]]
    motion = Motion([0.0], np.array([[[0, 0, 0], [0.65, 0, 0]]]), rotation)
    assert create_detector("exact", bodies).detect(motion).verdict.tolist() == [[Verdict.CONTACT]]
    detector = create_detector("collider", bodies, shape="sphere")
    assert detector.detect(motion).verdict.tolist() == [[Verdict.CLEAR]]
    any_faces = np.zeros((1, 2), dtype=np.int64)
    explanation = detector.explain(motion, frame=0, pair=0, faces=any_faces)
    assert explanation.shapes_meet is False
    assert explanation.looked is True


@pytest.mark.sampled(4)
@pytest.mark.parametrize("shape", ["mesh", "hull", "box", "sphere", "capsule"])
@pytest.mark.parametrize("names", [("cube", "wall"), ("wall", "cube")], ids=["cube first", "wall first"])
def test_contact_starts_at_the_sum_of_both_skins(shape, names):
    """A cube of 2 cm beside a wall, a cube of 10 cm, at gaps of -1 to 4 mm; without skins contact is below a gap of 0.

    With a skin of 1 mm on both it is below 2 mm, frame by frame (live) too. A sphere or a capsule in place of a cube
    has half its edge as radius, so that gaps along x stay the same.
    """
    cube, wall = Body("cube", box_mesh((0.02, 0.02, 0.02))), Body("wall", box_mesh((0.1, 0.1, 0.1)))
    gaps = np.array([-0.001, 0.0005, 0.0019, 0.0021, 0.004, 0.0019])
    positions = np.zeros((len(gaps), 2, 3))
    positions[:, 0, 0] = 0.01 + gaps + 0.05  # half the cube, the gap, half the wall
    motion = unrotated_motion(positions, np.arange(len(gaps)) / 90)
    bare = create_detector("collider", [cube, wall], pairs=[names], shape=shape, skin_m=0.0).detect(motion)
    assert np.array_equal(bare.verdict[:, 0], np.where(gaps < 0.0, Verdict.CONTACT, Verdict.CLEAR))
    detector = create_detector("collider", [cube, wall], pairs=[names], shape=shape, skin_m=0.001)
    skinned = detector.detect(motion)
    assert np.array_equal(skinned.verdict[:, 0], np.where(gaps < 0.002, Verdict.CONTACT, Verdict.CLEAR))
    assert detect_live(detector, motion).digest == skinned.digest
