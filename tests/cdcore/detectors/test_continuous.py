"""Row t speaks of the interval before frame t: contacts there are found, gaps are no intervals, CLEAR is proven."""

import numpy as np
import pytest
from support.shapes import ball_mesh, box_mesh, lab_bodies_and_motion

from cdcore import Body, Motion, TriangleMesh, Verdict, create_detector, join
from cdcore.detectors.continuous import GAP_BEFORE, LOST_BEFORE
from cdcore.narrow.continuous.motion_segments import legs_of, pose_at

BALL, PLATE = Body("ball", ball_mesh(0.01)), Body("plate", box_mesh((0.3, 0.3, 0.002)))
TOUCH = 0.011
"""Height of the ball at which it touches: its radius and half the plate."""
TOI_WIDTH = 1e-6
"""Seconds from the lower to the upper bound of a time of impact, as the detector promises."""


def ball_over_plate(z, valid=None, linked=None, bodies=(BALL, PLATE)):
    """A ball above a plate at these heights, frame by frame, 90 a second."""
    position = np.zeros((len(z), len(bodies), 3))
    position[:, 0, 2] = z
    rotation = np.tile(np.eye(3), (len(z), len(bodies), 1, 1))
    return Motion(np.arange(len(z)) / 90, position, rotation, valid, linked=linked)


def detect(motion, bodies=(BALL, PLATE), **settings):
    """The answer of ``continuous``, whose verdict of a frame is about the path since the frame before."""
    return create_detector("continuous", bodies, **settings).detect(motion)


def verdict_names(detection):
    """Names of the verdicts of the first pair, frame by frame."""
    return [Verdict(v).name for v in detection.verdict[:, 0]]


def test_tunnelling_ball_is_detected_with_its_time():
    """From 5 cm above to 5 cm below in the step to frame 2: it touches after (0.05 - TOUCH) / 0.1 of it."""
    motion = ball_over_plate([0.1, 0.05, -0.05, -0.1])
    detection = detect(motion)
    assert detection.covers == "intervals"
    assert verdict_names(detection) == ["CLEAR", "CLEAR", "CONTACT", "CLEAR"]
    assert (create_detector("exact", (BALL, PLATE)).detect(motion).verdict == Verdict.CLEAR).all()
    ((lower, upper),) = detection.toi.values()
    assert lower <= (1 + (0.05 - TOUCH) / 0.1) / 90 <= upper <= lower + TOI_WIDTH
    assert list(detection.toi) == [(2, 0)]


@pytest.mark.parametrize("away", [0.0, 1e4])
def test_slow_approach_far_out_gets_a_wider_true_bound(away):
    """10 km from the origin the detector leaves some nanometres to rounding: 2 microseconds of a fall of 1.8 mm/s."""
    fall = ball_over_plate([TOUCH + 1e-5, TOUCH - 1e-5])
    seconds_since_1970 = 1.7e9
    motion = Motion(seconds_since_1970 + fall.times, fall.translations + away, fall.rotations)
    ((lower, upper),) = detect(motion).toi.values()
    (first, plate), (last, _) = motion.translations[:, :, 2]
    touch = motion.times[0] + (first - plate - TOUCH) / (first - last) * (motion.times[1] - motion.times[0])
    assert lower <= touch + np.spacing(touch) and touch - np.spacing(touch) <= upper
    assert (upper - lower > TOI_WIDTH) == (away > 0.0)


def test_only_the_start_of_a_contact_has_a_time():
    """Times of impact by (frame, pair): contact begins at the end of the interval to frame 1, or in frame 0."""
    detection = detect(ball_over_plate([0.1, TOUCH, TOUCH, 0.1, 0.2]))
    assert verdict_names(detection) == ["CLEAR", "CONTACT", "CONTACT", "CONTACT", "CLEAR"]
    assert list(detection.toi) == [(1, 0)]
    _earliest, latest = detection.toi[1, 0]
    assert latest == 1 / 90, "frame 1, at 90 Hz"
    first = detect(ball_over_plate([0.0, 0.1, 0.2]))
    assert verdict_names(first) == ["CONTACT", "CONTACT", "CLEAR"]
    assert first.toi == {(0, 0): (0.0, 0.0)}


def test_lost_poses_and_gaps_have_no_interval_but_a_reason():
    """The ball has no pose in frame 2; the plate's poses of frames 4 and 5 belong to two takes.

    From frame 2 to 3 and 4 to 5 the ball would cross the plate. ``after``: it is in the plate when its pose comes back,
    which is a contact from the time of that frame on.
    """
    valid = np.ones((7, 2), dtype=bool)
    valid[2, 0] = False
    linked = np.ones((7, 2), dtype=bool)
    linked[5, 1] = False
    detection = detect(ball_over_plate([0.1, 0.1, 0.0, -0.1, -0.1, 0.1, 0.1], valid, linked))
    assert verdict_names(detection) == ["CLEAR", "CLEAR", "NO_POSE", "NO_POSE", "CLEAR", "NO_POSE", "CLEAR"]
    assert detection.reasons == {(3, 0): LOST_BEFORE, (5, 0): GAP_BEFORE}
    after = detect(ball_over_plate([0.1, 0.1, 0.1, 0.0, 0.0, 0.1, 0.1], valid, linked))
    assert verdict_names(after) == ["CLEAR", "CLEAR", "NO_POSE", "CONTACT", "CONTACT", "NO_POSE", "CLEAR"]
    assert after.toi == {(3, 0): (3 / 90, 3 / 90)}


def test_ball_in_a_box_is_contained_until_it_leaves():
    """The box reaches up to 0.5 m: the ball of 1 cm passes its wall between 0.2 and 0.9 m, on its path to frame 4.

    Without containment a ball inside is clear, and the answer says that it was refused.
    """
    bodies = BALL, Body("room", box_mesh((1, 1, 1)))
    detection = detect(ball_over_plate([0, 0.1, 0.2, 0.2, 0.9, 1.2], bodies=bodies), bodies)
    assert verdict_names(detection) == ["CONTAINED"] * 4 + ["CONTACT", "CLEAR"]
    refused = detect(ball_over_plate([0, 0.1], bodies=bodies), bodies, containment=False)
    assert verdict_names(refused) == ["CLEAR", "CLEAR"]
    assert refused.containment == ("refused: containment=False",)


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_dense_sampling_confirms_contacts_and_clear_intervals(seed):
    """Eight poses within each step: none of a step that is clear has contact."""
    bodies, motion = lab_bodies_and_motion(frames=90, seed=seed)
    detection = detect(motion, bodies)
    exact = create_detector("exact", bodies)
    at_frames = exact.detect(motion).verdict
    contact = at_frames == Verdict.CONTACT
    assert (detection.verdict[contact] == Verdict.CONTACT).all()
    finer = poses_within_intervals(motion, instants=8)
    dense = exact.detect(finer).verdict.reshape(len(motion) - 1, 8, -1) == Verdict.CONTACT
    clear = np.isin(detection.verdict[1:], [Verdict.CLEAR, Verdict.CONTAINED])
    assert clear.sum() > 300, "of 890 intervals many are clear"
    assert not dense.any(axis=1)[clear].any()
    begins = [position for position in detection.toi if position[0]]
    assert len(begins) > 4
    assert all(upper - lower <= TOI_WIDTH for lower, upper in detection.toi.values())
    assert (detection.verdict != Verdict.UNRESOLVED).all()


def poses_within_intervals(motion, instants):
    """The motion at so many ``instants`` within each interval, ends included."""
    frames, bodies = motion.valid.shape
    rotation, position = np.empty((frames - 1, instants, bodies, 3, 3)), np.empty((frames - 1, instants, bodies, 3))
    pose = np.empty(12)
    for k in range(bodies):
        legs = legs_of(motion.rotations[:, k], motion.translations[:, k], np.arange(1, frames))
        for t, leg in enumerate(legs.T):
            for n, fraction in enumerate(np.linspace(0, 1, instants)):
                pose_at(leg, fraction, pose)
                rotation[t, n, k], position[t, n, k] = pose[:9].reshape(3, 3), pose[9:]
    valid = np.repeat(motion.valid[1:] & motion.valid[:-1], instants, axis=0)
    count = (frames - 1) * instants
    return Motion(np.arange(count), position.reshape(count, bodies, 3), rotation.reshape(count, bodies, 3, 3), valid)


@pytest.mark.sampled(3)
@pytest.mark.parametrize("block", [1, 3, 40])
def test_continuous_detector_in_blocks_equals_the_whole_motion(block):
    """Times of impact (``toi``), reasons, verdicts and the number of searches."""
    bodies, motion = lab_bodies_and_motion(frames=30, seed=2)
    whole = detect(motion, bodies)
    joined = join(create_detector("continuous", bodies).stream(motion.blocks(block)))
    assert joined.toi == whole.toi
    assert joined.reasons == whole.reasons
    assert joined.digest == whole.digest
    assert joined.work["searched"] == whole.work["searched"]


def test_resting_or_distant_bodies_cost_no_search():
    """At rest no interval is examined; 1 m away nine are and none is searched; 9 mm away all are."""
    still = detect(ball_over_plate([0.02] * 10))
    assert still.work["searched"] == still.work["intervals"] == 0
    far = detect(ball_over_plate(np.linspace(1, 2, 10)))
    assert (far.work["searched"], far.work["intervals"]) == (0, 9)
    near = detect(ball_over_plate(np.linspace(0.02, 0.03, 10)))
    assert near.work["searched"] == 9


def test_undecidable_pairs_are_unresolved_counted_and_explained():
    """A millimetre above the plate, the ball turns by half a turn: which way, two poses do not say."""
    bodies, motion = (BALL, PLATE), ball_over_plate([TOUCH + 0.001] * 2)
    rotation = motion.rotations.copy()
    rotation[1, 0] = np.diag([1.0, -1.0, -1.0])
    detection = detect(Motion(motion.times, motion.translations, rotation), bodies)
    assert verdict_names(detection) == ["CLEAR", "UNRESOLVED"]
    assert detection.work["unresolved"] == 1
    assert "half a turn" in detection.reasons[1, 0]


@pytest.mark.parametrize(
    ("missing_faces", "interval_labels"),
    [
        (1, ["CONTAINED", "CONTAINED", "CONTACT", "CLEAR"]),  # a lost face: the ball passes through the other half
        (2, ["UNRESOLVED", "UNRESOLVED", "UNRESOLVED", "CLEAR"]),  # no top
    ],
)
def test_path_out_of_a_box_depends_on_its_top(missing_faces, interval_labels):
    """The ball leaves the box between frames 1 and 2, whose end alone would say CLEAR."""
    closed = box_mesh((1.0, 1.0, 1.0))
    top_faces = np.flatnonzero(closed.triangles.mean(axis=1)[:, 2] > 0.49)
    box = Body("box", TriangleMesh(closed.vertices, np.delete(closed.faces, top_faces[:missing_faces], axis=0)))
    detection = detect(ball_over_plate([0.0, 0.0, 2.0, 2.0]), (BALL, box))
    assert verdict_names(detection) == interval_labels
