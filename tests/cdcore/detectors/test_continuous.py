"""Row t speaks of the interval before frame t: contacts there are found, gaps are no intervals, CLEAR is proven."""

import numpy as np
import pytest
from support.shapes import ball_mesh, box_mesh, lab_bodies_and_motion

from cdcore import Body, Motion, TriangleMesh, Verdict, create_detector, join
from cdcore.detectors.continuous import GAP_BEFORE, LOST_BEFORE
from cdcore.narrow.continuous.motion_segments import legs_of, pose_at

BALL, PLATE = Body("ball", ball_mesh(0.01)), Body("plate", box_mesh((0.3, 0.3, 0.002)))
TOUCH = 0.010 + 0.001
"""Height in metres at which the ball touches the plate: its radius, 1 cm, and half the plate's 2 mm."""
TOI_WIDTH = 1e-6
"""Seconds from the lower to the upper bound of a time of impact, as the detector promises."""


def ball_over_plate(z, valid=None, linked=None, bodies=(BALL, PLATE)):
    """A ball at these heights over a plate at rest at 0, frame by frame, 90 a second."""
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
    """A ball of radius 1 cm falls from 5 cm above to 5 cm below a plate, in the step from frame 1 to 2, at 90 Hz: no
    frame has contact.

    The ball touches at a height of 1.1 cm (TOUCH), after (5 - 1.1) of 10 cm of that step.
    """
    motion = ball_over_plate([0.1, 0.05, -0.05, -0.1])
    assert (create_detector("exact", (BALL, PLATE)).detect(motion).verdict == Verdict.CLEAR).all()
    detection = detect(motion)
    assert detection.covers == "intervals"
    assert verdict_names(detection) == ["CLEAR", "CLEAR", "CONTACT", "CLEAR"]
    assert list(detection.toi) == [(2, 0)], "(frame, pair)"
    lower, upper = detection.toi[2, 0]
    assert lower <= (1 + (0.05 - TOUCH) / 0.1) / 90 <= upper <= lower + TOI_WIDTH


@pytest.mark.parametrize("away", [0.0, 1e4], ids="{:g} m from the origin".format)
def test_slow_approach_far_out_gets_a_wider_true_bound(away):
    """A ball sinks by 20 micrometres between two frames at 90 Hz, 1.8 mm/s, and touches in the middle of them.

    10 km from the origin the detector leaves some nanometres to rounding: 2 microseconds of that fall. Times are
    seconds since 1970, which are rounded too.
    """
    fall = ball_over_plate([TOUCH + 1e-5, TOUCH - 1e-5])
    motion = Motion(1.7e9 + fall.times, fall.translations + away, fall.rotations)
    ((lower, upper),) = detect(motion).toi.values()
    (first, plate), (last, _plate) = motion.translations[:, :, 2]
    start, end = motion.times
    touch = start + (first - plate - TOUCH) / (first - last) * (end - start)
    rounding = np.spacing(touch)
    assert lower - rounding <= touch <= upper + rounding
    assert (upper - lower > TOI_WIDTH) == (away > 0.0)


def test_only_the_start_of_a_contact_has_a_time():
    """A ball touches a plate in frames 1 and 2 of 5, at 90 Hz (at the height TOUCH), and leaves it on its path to frame
    3.

    The time of impact of the pair, by frame and pair, is the end of the interval to frame 1.
    """
    detection = detect(ball_over_plate([0.1, TOUCH, TOUCH, 0.1, 0.2]))
    assert verdict_names(detection) == ["CLEAR", "CONTACT", "CONTACT", "CONTACT", "CLEAR"]
    assert list(detection.toi) == [(1, 0)]
    _earliest, latest = detection.toi[1, 0]
    assert latest == 1 / 90


def test_contact_in_the_first_frame_begins_at_its_time():
    """A ball is in a plate in frame 0, at 0 s, and leaves it on its path to frame 1."""
    detection = detect(ball_over_plate([0.0, 0.1, 0.2]))
    assert verdict_names(detection) == ["CONTACT", "CONTACT", "CLEAR"]
    assert detection.toi == {(0, 0): (0.0, 0.0)}


def test_lost_poses_and_gaps_have_no_interval_but_a_reason():
    """A ball at these heights over a plate has no pose in frame 2; the plate's poses of frames 4 and 5 are not linked:
    they belong to two takes.

    From frame 1 to 3 and from 4 to 5 the ball would cross the plate; nothing says that it did.
    """
    motion = ball_over_plate([0.1, 0.1, 0.0, -0.1, -0.1, 0.1, 0.1], *lost_in_frame_2_cut_before_frame_5())
    detection = detect(motion)
    assert verdict_names(detection) == ["CLEAR", "CLEAR", "NO_POSE", "NO_POSE", "CLEAR", "NO_POSE", "CLEAR"]
    assert detection.reasons == {(3, 0): LOST_BEFORE, (5, 0): GAP_BEFORE}


def test_contact_at_the_end_of_a_loss_begins_then():
    """A ball at these heights over a plate, seven frames at 90 Hz: it has no pose in frame 2, and comes back in the
    plate in frame 3.

    The plate's poses of frames 4 and 5 are not linked, as of two takes: the interval between them is NO_POSE.
    """
    detection = detect(ball_over_plate([0.1, 0.1, 0.1, 0.0, 0.0, 0.1, 0.1], *lost_in_frame_2_cut_before_frame_5()))
    assert verdict_names(detection) == ["CLEAR", "CLEAR", "NO_POSE", "CONTACT", "CONTACT", "NO_POSE", "CLEAR"]
    assert detection.toi == {(3, 0): (3 / 90, 3 / 90)}


def lost_in_frame_2_cut_before_frame_5():
    """Seven frames: which poses are valid, not the ball's in frame 2, and linked to the last, not the plate's in 5."""
    valid, linked = np.ones((7, 2), dtype=bool), np.ones((7, 2), dtype=bool)
    valid[2, 0] = False
    linked[5, 1] = False
    return valid, linked


def test_ball_in_a_box_is_contained_until_it_leaves():
    """A ball of 1 cm moves from the middle of a box of 1 m, which reaches up to 0.5 m: it passes its wall on its path
    from 0.2 to 0.9 m, to frame 4.
    """
    bodies = BALL, Body("room", box_mesh((1, 1, 1)))
    detection = detect(ball_over_plate([0, 0.1, 0.2, 0.2, 0.9, 1.2], bodies=bodies), bodies)
    assert verdict_names(detection) == ["CONTAINED"] * 4 + ["CONTACT", "CLEAR"]


def test_ball_in_a_box_is_clear_where_containment_is_off():
    """A ball in the middle of a box of 1 m; the answer says that the question was refused."""
    bodies = BALL, Body("room", box_mesh((1, 1, 1)))
    detection = detect(ball_over_plate([0, 0.1], bodies=bodies), bodies, containment=False)
    assert verdict_names(detection) == ["CLEAR", "CLEAR"]
    assert detection.containment == ("refused: containment=False",)


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_dense_sampling_confirms_contacts_and_clear_intervals(seed):
    """Five bodies in a laboratory, 90 frames: a contact at a frame is in the interval to it, and none is undecided.

    At eight poses within an interval that is clear ``exact`` sees no contact.
    """
    bodies, motion = lab_bodies_and_motion(frames=90, seed=seed)
    exact, instants = create_detector("exact", bodies), 8
    detection = detect(motion, bodies)
    assert (detection.verdict != Verdict.UNRESOLVED).all()
    at_frames = exact.detect(motion).verdict == Verdict.CONTACT
    assert (detection.verdict[at_frames] == Verdict.CONTACT).all()
    within = exact.detect(poses_within_intervals(motion, instants)).verdict == Verdict.CONTACT
    contact_within = within.reshape(len(motion) - 1, instants, -1).any(axis=1)
    clear = np.isin(detection.verdict[1:], [Verdict.CLEAR, Verdict.CONTAINED])
    assert clear.sum() > 300, "of 890 intervals many are clear"
    assert not contact_within[clear].any()


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
def test_times_of_impact_are_a_microsecond_wide(seed):
    """Five bodies in a laboratory, 90 frames, in which contacts begin; those of frame 0 have its time."""
    bodies, motion = lab_bodies_and_motion(frames=90, seed=seed)
    toi = detect(motion, bodies).toi
    contacts_that_begin = [(frame, pair) for frame, pair in toi if frame > 0]
    assert len(contacts_that_begin) > 4
    assert all(upper - lower <= TOI_WIDTH for lower, upper in toi.values())


def poses_within_intervals(motion, instants):
    """The motion at so many ``instants`` within each interval, ends included, on lines and with a constant rotation."""
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
@pytest.mark.parametrize("block", [1, 3, 40], ids="blocks of {} frames".format)
def test_continuous_detector_in_blocks_equals_the_whole_motion(block):
    """Five bodies in a laboratory, 30 frames: times of impact, reasons, verdicts (their digest), and the number of
    searches.
    """
    bodies, motion = lab_bodies_and_motion(frames=30, seed=2)
    whole = detect(motion, bodies)
    joined = join(create_detector("continuous", bodies).stream(motion.blocks(block)))
    assert joined.toi == whole.toi
    assert joined.reasons == whole.reasons
    assert joined.digest == whole.digest
    assert joined.work["searched"] == whole.work["searched"]


@pytest.mark.parametrize(
    ("heights_m", "examined", "searched"),
    [
        pytest.param([0.02] * 10, 0, 0, id="at rest, 9 mm above"),
        pytest.param(np.linspace(1, 2, 10), 9, 0, id="moves, 1 m above"),
        pytest.param(np.linspace(0.02, 0.03, 10), 9, 9, id="moves, 9 mm above"),
    ],
)
def test_resting_or_distant_bodies_cost_no_search(heights_m, examined, searched):
    """A ball of 1 cm over a plate for ten frames, nine intervals: what rests is not examined, volumes clear what is
    far, and what is near is searched.
    """
    work = detect(ball_over_plate(heights_m)).work
    assert work["intervals"] == examined
    assert work["searched"] == searched


def test_undecidable_pairs_are_unresolved_counted_and_explained():
    """A ball of 1 cm, a millimetre above a plate, turns by half a turn between two frames: poses do not say which way
    round.
    """
    bodies, motion = (BALL, PLATE), ball_over_plate([TOUCH + 0.001] * 2)
    rotation = motion.rotations.copy()
    rotation[1, 0] = np.diag([1.0, -1.0, -1.0])
    detection = detect(Motion(motion.times, motion.translations, rotation), bodies)
    assert verdict_names(detection) == ["CLEAR", "UNRESOLVED"]
    assert detection.work["unresolved"] == 1
    assert "half a turn" in detection.reasons[1, 0]


@pytest.mark.parametrize(
    ("missing_faces", "interval_verdicts"),
    [
        pytest.param(1, ["CONTAINED", "CONTAINED", "CONTACT", "CLEAR"], id="a triangle of the top is missing"),
        pytest.param(2, ["UNRESOLVED", "UNRESOLVED", "UNRESOLVED", "CLEAR"], id="the top is missing"),
    ],
)
def test_path_out_of_a_box_depends_on_its_top(missing_faces, interval_verdicts):
    """A ball leaves a box of 1 m between frames 1 and 2, through the other half of its top or where that is missing.

    At both ends of the interval it touches nothing, and at the second it is outside, clear of the box.
    """
    closed = box_mesh((1.0, 1.0, 1.0))
    top_faces = np.flatnonzero(closed.triangles.mean(axis=1)[:, 2] > 0.49)
    box = Body("box", TriangleMesh(closed.vertices, np.delete(closed.faces, top_faces[:missing_faces], axis=0)))
    detection = detect(ball_over_plate([0.0, 0.0, 2.0, 2.0], bodies=(BALL, box)), (BALL, box))
    assert verdict_names(detection) == interval_verdicts
