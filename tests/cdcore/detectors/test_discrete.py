"""Discrete is right where it looks and holds its last look in between; colliders answer for their shapes."""

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


def samples_exactly(frames, times, rate, block=None):
    """Whether its answers are those of these frames, each held until the next; contact comes and goes at random."""
    meets = np.random.default_rng(3).random(len(times)) < 0.5
    detector = create_detector("discrete", BODIES, rate_hz=rate)
    motion = ball_at_x(np.where(meets, 0.9, 3.0), times)
    detection = detector.detect(motion) if block is None else join(detector.stream(motion.blocks(block)))
    last = np.asarray(frames)[np.searchsorted(frames, np.arange(len(times)), side="right") - 1]
    kept = {key: detection.work[key] for key in ("looks", "held")}
    assert kept == {"looks": len(frames), "held": len(times) - len(frames)}
    return np.array_equal(counts_as_contact(detection.verdict[:, 0]), meets[last])


@pytest.mark.sampled(3)
@pytest.mark.parametrize("seed", range(3))
def test_discrete_without_a_rate_equals_hybrid(seed):
    """Sampling every frame, it never repeats an old answer (``held`` is 0)."""
    bodies, motion = lab_bodies_and_motion(frames=70, seed=seed)
    hybrid = create_detector("hybrid", bodies).detect(motion, faces=True)
    discrete = create_detector("discrete", bodies).detect(motion, faces=True)
    assert discrete.digest == hybrid.digest
    assert discrete.faces_digest == hybrid.faces_digest
    assert discrete.work["held"] == 0


def test_faces_queried_afterwards_equal_faces_of_detection():
    """Faces of contacts, asked for after the detection, are those that it lists itself.

    With a sampling rate contacts are repeated between samples, so their faces are not known.
    """
    bodies, motion = lab_bodies_and_motion(frames=90)
    detector = create_detector("discrete", bodies)
    whole = detector.detect(motion, faces=True)
    again = detector.faces_of(motion, whole.verdict == Verdict.CONTACT)
    assert len(again.faces) > 100
    for item in ("frame", "pair"):
        assert np.array_equal(getattr(again, item), getattr(whole.face_sets, item))
    for frame, pair in zip(again.frame, again.pair, strict=True):
        assert np.array_equal(again.at(frame, pair), whole.face_sets.at(frame, pair))
    assert create_detector("discrete", bodies, rate_hz=30).faces_of(motion, whole.verdict == Verdict.CONTACT) is None


def test_quarter_rate_samples_every_fourth_frame_despite_rounded_stamps():
    """A minute at 90 Hz, exact and rounded to nanoseconds; a quarter of 90 Hz is 22.5 Hz."""
    every = list(range(0, 5400, 4))
    for times in (np.arange(5400) / 90, np.round(np.arange(5400) / 90 * 1e9) / 1e9):
        assert samples_exactly(every, times, rate=22.5)


def test_samples_are_first_frames_at_or_after_ticks():
    """Frames 2 to 130 ms apart, ticks of 10 Hz; ``block=7``: the same as a stream of seven frames at a time."""
    rng = np.random.default_rng(0)
    times = 7.3 + np.cumsum(rng.uniform(0.002, 0.13, 300))
    rate = 10.0
    expected, tick = [0], np.floor(times[0] * rate)
    for frame in range(1, 300):
        if np.floor(times[frame] * rate) > tick:
            expected.append(frame)
            tick = np.floor(times[frame] * rate)
    assert samples_exactly(expected, times, rate)
    assert samples_exactly(expected, times, rate, block=7)


@pytest.mark.parametrize("name", ["discrete", "collider"])
def test_query_without_a_pose_changes_no_state(name):
    """Samples in frames 0, 4 and 8; bodies part in frame 4, whose sample finds no pose: the contact of frame 0 stays.

    Where frame 0 has no pose either, there is no answer to repeat in frames 6 and 7: NOT_FOUND.
    """
    times = np.arange(12) / 90
    motion = ball_at_x([0.9] * 4 + [3.0] * 8, times)
    valid = np.ones((12, 2), dtype=bool)
    valid[4:6, 0] = False
    blind = Motion(times, motion.translations, motion.rotations, valid)
    detector = create_detector(name, BODIES, rate_hz=22.5)
    detection = detector.detect(blind, faces=True)
    assert (
        detection.verdict[:, 0].tolist()
        == [Verdict.CONTACT] * 4 + [Verdict.NO_POSE] * 2 + [Verdict.CONTACT] * 2 + [Verdict.CLEAR] * 4
    )
    assert name == "collider" or detection.faces(6, 0).tolist() == detection.faces(0, 0).tolist()
    valid[:5] = False
    blind = Motion(times, motion.translations, motion.rotations, valid)
    assert (
        detector.detect(blind).verdict[:, 0].tolist()
        == [Verdict.NO_POSE] * 6 + [Verdict.NOT_FOUND] * 2 + [Verdict.CLEAR] * 4
    )


def test_faces_and_sections_stay_with_their_sampled_verdict():
    """22.5 Hz of 90: samples in frames 0 and 4; frames 1 to 3 repeat the faces of frame 0."""
    times = np.arange(8) / 90
    motion = ball_at_x([0.9, 0.91, 0.92, 0.93, 0.8, 0.81, 0.82, 0.83], times)
    detector = create_detector("discrete", BODIES, rate_hz=22.5)
    for detection in (detector.detect(motion, faces=True), join(detector.stream(motion.blocks(3), faces=True))):
        for frame in range(4):
            assert detection.faces(frame, 0).tolist() == detection.faces(0, 0).tolist()
            assert np.array_equal(detection.section(frame, 0), detection.section(0, 0))
        assert detection.faces(4, 0).tolist() != detection.faces(0, 0).tolist()
        assert len(detection.section(5, 0)) > 0


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
    """The rod's foot moves between 0.05 and 0.15 m in the hollow and touches no wall; the rim is at 0.1 m."""
    foot, motion = stirring()
    exact = create_detector("exact", [BEAKER, ROD]).detect(motion)
    assert not counts_as_contact(exact.verdict).any()
    hull = counts_as_contact(create_detector("collider", [BEAKER, ROD]).detect(motion).verdict)[:, 0]
    assert np.array_equal(hull, foot <= RIM) and 0 < hull.sum() < len(hull)


def test_sphere_explains_a_missed_corner_by_its_shape():
    """A unit cube rotated by 45 degrees reaches 0.71 m and meets a pin of 0.1 m whose middle is at 0.65 m.

    Their spheres, of 0.5 and 0.05 m, do not: the shape is the reason, as the detector looked.
    """
    bodies = [Body("box", box_mesh()), Body("pin", box_mesh((0.1, 0.1, 0.1)))]
    rotation, half = np.tile(np.eye(3), (1, 2, 1, 1)), np.sqrt(0.5)
    rotation[0, 0, :2, :2] = [[half, -half], [half, half]]
    near = Motion([0.0], np.array([[[0, 0, 0], [0.65, 0, 0]]]), rotation)
    assert create_detector("exact", bodies).detect(near).verdict[0, 0] != Verdict.CLEAR
    detector = create_detector("collider", bodies, shape="sphere")
    assert detector.detect(near).verdict[0, 0] == Verdict.CLEAR
    reported = detector.explain(near, frame=0, pair=0, faces=np.zeros((1, 2), dtype=np.int64))
    assert reported.shapes_meet is False and reported.looked is True


@pytest.mark.sampled(3)
@pytest.mark.parametrize("shape", ["mesh", "hull", "box", "sphere", "capsule"])
def test_contact_starts_at_the_sum_of_both_skins(shape):
    """Skins of 1 mm each: gaps below 2 mm are contact. The cube's middle is 6 cm from the wall's at a gap of 0."""
    cube, wall = Body("cube", box_mesh((0.02, 0.02, 0.02))), Body("wall", box_mesh((0.1, 0.1, 0.1)))
    gaps = np.array([-0.001, 0.0005, 0.0019, 0.0021, 0.004, 0.0019])
    positions = np.zeros((len(gaps), 2, 3))
    positions[:, 0, 0] = gaps + 0.06
    motion = unrotated_motion(positions, np.arange(len(gaps)) / 90)
    for names in (("cube", "wall"), ("wall", "cube")):
        bare, skinned = (
            create_detector("collider", [cube, wall], pairs=[names], shape=shape, skin_m=skin) for skin in (0.0, 0.001)
        )
        assert np.array_equal(bare.detect(motion).verdict[:, 0], np.where(gaps < 0.0, Verdict.CONTACT, Verdict.CLEAR))
        of_skins = np.where(gaps < 0.002, Verdict.CONTACT, Verdict.CLEAR)
        assert np.array_equal(skinned.detect(motion).verdict[:, 0], of_skins)
        assert detect_live(skinned, motion).digest == skinned.detect(motion).digest
