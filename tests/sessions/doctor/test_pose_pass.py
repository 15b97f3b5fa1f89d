import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support.planted_faults import FAULTS, clean_draft

from sessions import Frames, Session, Severity, Status, examine
from sessions.doctor import pose_pass
from sessions.doctor.pose_pass import run_pose_pass
from sessions.doctor.pose_spans import pose_spans, teleports
from sessions.doctor.runs import runs
from sessions.doctor.track_watch import Mark
from sessions.geometry.rotations import quaternion_product

# `clean_draft` makes a recording without faults: 900 frames at 90 Hz of a flask that moves (body 0), a hand that moves
# and rotates (body 1), and a tray at rest (body 2).
FLASK, HAND, TRAY = 0, 1, 2


def session_with_every_pose_fault():
    """A session of 900 frames with four kinds of wrong poses, and with lost and absent samples."""
    draft = clean_draft()
    for at, name in enumerate(("nan position", "zero quaternion", "non-unit quaternion", "identity while lost")):
        FAULTS[name](draft, 0, 100 + 100 * at)
    draft.arrays["status"][700:720, 1] = Status.LOST
    draft.arrays["status"][::3, 2] = Status.ABSENT
    return draft.session()


@pytest.mark.parametrize("size", [1, 7, 100, 899])
def test_the_marks_do_not_depend_on_blocks(size):
    """The doctor passes once over a recording and marks samples: of 900 frames whole, and in blocks of ``size``.

    Marks, lengths of steps, the worst lengths of quaternions and the digest of all poses are the same.
    """
    session = session_with_every_pose_fault()
    whole, pieces = run_pose_pass([session.frames]), run_pose_pass(session.frames.blocks(size))
    assert np.array_equal(whole.marks, pieces.marks)
    assert np.array_equal(whole.steps, pieces.steps, equal_nan=True)
    assert np.array_equal(whole.worst_norm, pieces.worst_norm)
    assert whole.digest == pieces.digest


def test_a_body_that_appears_later_gets_a_column():
    """The first 50 of 900 frames have the flask alone, the others three bodies: the hand is there from frame 50 on."""
    frames = clean_draft().session().frames
    flask_alone = Frames(
        frames.names[:1], frames.stamp_ns[:50], frames.log_ns[:50], frames.sample_ns[:50, :1],
        frames.position[:50, :1], frames.quaternion_xyzw[:50, :1], frames.status[:50, :1],
    )  # fmt: skip
    outcome = run_pose_pass([flask_alone, frames.segment(50, 900)])
    assert outcome.names == frames.names
    assert outcome.marks.shape == (900, 3)
    assert outcome.has(Mark.PRESENT)[:, HAND].tolist() == [False] * 50 + [True] * 850


def test_long_recording_keeps_fewer_poses_over_its_whole_length(monkeypatch):
    """900 frames come in blocks of 100, which are not joined to longer ones; room for 600 poses is full after six.

    From the seventh block on every second pose is dropped, also of those before: frames 0, 2, 4 ... stay.
    """
    monkeypatch.setattr(pose_pass, "MOST_SAMPLES", 600)
    monkeypatch.setattr(pose_pass, "JOINED_FRAMES", 100)
    frames = clean_draft().session().frames
    positions_kept = run_pose_pass(frames.blocks(100)).position[:, FLASK]
    all_positions = frames.position[:, FLASK].tolist()
    assert [all_positions.index(position) for position in positions_kept.tolist()] == [*range(0, 900, 2)]


@pytest.mark.parametrize(
    ("size", "samples"),
    [pytest.param(30, 80, id="seven of 120 and one of 60"), pytest.param(300, 30, id="three of 300")],
)
def test_small_blocks_are_joined_and_large_blocks_are_not(size, samples, monkeypatch):
    """900 frames come in blocks of ``size``, which are joined to at least 100 frames; ten poses of each block stay."""
    monkeypatch.setattr(pose_pass, "JOINED_FRAMES", 100)
    monkeypatch.setattr(pose_pass, "SAMPLES_PER_BLOCK", 10)
    positions = run_pose_pass(clean_draft().session().frames.blocks(size)).position
    assert len(positions) == samples
    assert np.isfinite(positions).all()


def findings_with_code(draft, code):
    """The doctor's findings of a code."""
    return [finding for finding in examine(draft.session()) if finding.code == code]


@pytest.mark.parametrize(
    ("degrees", "frames", "is_reported"),
    [
        pytest.param(95.0, 1, True, id="one frame, far"),
        pytest.param(20.0, 1, False, id="one frame, not far"),
        pytest.param(95.0, 2, False, id="two frames"),
    ],
)
def test_single_frame_rotation_outlier_is_reported_and_rotation_is_not(degrees, frames, is_reported):
    """From frame 400 on, so many frames of the hand are rotated by so many degrees about X, and then no longer.

    Over 50 rad/s, 32 degrees in a step at 90 Hz, and undone in the next step is no motion.
    """
    draft = clean_draft()
    half = np.radians(degrees) / 2.0
    rotations = draft.arrays["quaternion_xyzw"][400 : 400 + frames, HAND]
    rotations[:] = quaternion_product(rotations, (np.sin(half), 0.0, 0.0, np.cos(half)))
    outliers = findings_with_code(draft, "turn-outlier")
    assert len(outliers) == is_reported
    for outlier in outliers:
        assert (outlier.body, outlier.count, outlier.severity) == ("hand-left", 1, Severity.WARNING)
        assert round(outlier.start * 90) == 400  # seconds at 90 Hz


def spans_of_draft(draft):
    """Findings on poses: (code, column of the body, first frame, last frame)."""
    return [
        (item.code, item.column, item.first, item.last) for item in pose_spans(run_pose_pass([draft.session().frames]))
    ]


def test_bodies_at_origin_or_rotating_are_neither_lost_nor_frozen():
    """The tray stays at the origin; the flask stays elsewhere and rotates; the hand starts at the origin.

    It rests there for 100 frames without rotation, and then walks 0.1 mm a frame. None of it is a fault.
    """
    draft = clean_draft()
    draft.arrays["position"][:, TRAY] = 0.0
    draft.arrays["position"][:, FLASK] = [0.2, 1.0, 0.1]
    slow_walk = 1e-4 * np.maximum(0, np.arange(900) - 100)
    draft.arrays["position"][:, HAND] = slow_walk[:, None] * [1.0, 0.0, 0.0]
    draft.arrays["quaternion_xyzw"][:, HAND] = [0.0, 0.0, 0.0, 1.0]
    assert spans_of_draft(draft) == []


@pytest.mark.parametrize(
    "x",
    [
        pytest.param(np.maximum(0, np.arange(900) - 30) * 10 / 90, id="starts at 10 m/s"),
        pytest.param(np.abs(np.arange(900) - 30) * 4 / 90, id="reverses at 4 m/s"),
    ],
)
def test_sudden_start_or_reversal_of_motion_is_no_teleport(x):
    """The hand's velocity along X changes in frame 30, at 90 Hz, from 0 to 10 or from -4 to 4 m/s, without a jump."""
    draft = clean_draft()
    draft.arrays["position"][:, HAND] = x[:, None] * [1.0, 0.0, 0.0]
    assert "teleport" not in {code for code, *_ in spans_of_draft(draft)}


def test_close_stamps_cause_no_jump():
    """A body moves 1.1 cm a frame at 90 Hz; frame 100 is stamped 0.1 ms after frame 99, which would be 110 m/s.

    So short a step is one of the clock: no frame is marked as a jump (TELEPORT).
    """
    times, position = 10**9 + 11_111_111 * np.arange(200), np.zeros((200, 3))
    position[:, 0] = 0.011 * np.arange(200)
    times[100] = times[99] + 100_000
    session = Session.from_arrays(times, {"a": (position, np.tile([0.0, 0.0, 0.0, 1.0], (200, 1)))})
    assert not (run_pose_pass([session.frames]).marks & Mark.TELEPORT).any()


def test_position_still_after_jump_is_frozen_despite_rotation():
    """The hand trembles by 0.1 mm and stops in frames 500 to 559, rotating on, as a tracker's last position repeats.

    The flask, which moves, jumps to a point in frames 300 to 329, and to the origin in 600 to 629, where its rotation
    is the identity in all but two frames.
    """
    draft = clean_draft()
    rng = np.random.default_rng(3)
    draft.arrays["position"][:, HAND] = rng.normal([0.2, 1.0, 0.1], 1e-4, (900, 3))
    draft.arrays["position"][500:560, HAND] = draft.arrays["position"][499, HAND]
    draft.arrays["position"][300:330, FLASK] = [2.0, 2.0, 2.0]
    draft.arrays["position"][600:630, FLASK] = 0.0
    draft.arrays["quaternion_xyzw"][600:628, FLASK] = [0.0, 0.0, 0.0, 1.0]
    frozen = [span for span in spans_of_draft(draft) if "frozen" in span]
    assert {*frozen} >= {("frozen", HAND, 500, 559), ("frozen", FLASK, 300, 329), ("frozen", FLASK, 600, 629)}


def test_jump_is_detected_in_a_recording_of_three_frames():
    """The cup is at rest and then jumps 1 m in 11 ms, to the third frame, which is marked."""
    poses = np.array([[0, 1, 0], [0, 1, 0], [1, 1, 0]]), np.tile([0.0, 0.0, 0.0, 1.0], (3, 1))
    session = Session.from_arrays(np.arange(3) * 11_111_111, {"cup": poses})
    assert run_pose_pass([session.frames]).has(Mark.TELEPORT)[:, 0].tolist() == [False, False, True]


@given(st.lists(st.booleans(), max_size=40))
def test_the_runs_of_a_mask_make_the_mask_again(mask):
    """Runs are (first, last index) of True in a random mask; they do not overlap, and between two of them is False."""
    mask_of_runs = np.zeros(len(mask), dtype=bool)
    result = runs(np.array(mask, dtype=bool))
    for first, last in result.tolist():
        assert not mask_of_runs[first : last + 1].any()
        mask_of_runs[first : last + 1] = True
    assert mask_of_runs.tolist() == mask
    firsts, lasts = result.T
    assert (firsts[1:] > lasts[:-1] + 1).all()


def test_worst_quaternion_norm_deviates_most_from_unit_length():
    """Two of the flask's quaternions have norms of 0.1 and 1.5, which deviate from 1 by 0.9 and 0.5."""
    draft = clean_draft()
    draft.arrays["quaternion_xyzw"][200, FLASK] *= 0.1
    draft.arrays["quaternion_xyzw"][201, FLASK] *= 1.5
    assert run_pose_pass([draft.session().frames]).worst_norm[FLASK] == pytest.approx(0.1)


def spans_on_a_line(x, quaternions=None, step_ms=11):
    """Findings about a cup at these positions of the X axis, metres, with a sample every ``step_ms``."""
    if quaternions is None:
        quaternions = np.tile([0.0, 0.0, 0.0, 1.0], (len(x), 1))
    poses = {"cup": (np.asarray(x)[:, None] * [1.0, 0.0, 0.0], quaternions)}
    session = Session.from_arrays(np.arange(len(x)) * step_ms * 1_000_000, poses)
    return pose_spans(run_pose_pass([session.frames]))


@pytest.mark.parametrize(
    ("step_ms", "repeats", "codes"), [(40, 4, []), (40, 5, ["frozen"]), (11, 8, []), (11, 9, ["frozen"])]
)
def test_position_is_frozen_after_5_repeats_and_80_ms(step_ms, repeats, codes):
    """The cup walks 1 mm a sample, repeats the position of sample 49 so often, and then steps 10 mm.

    Four repeats are too few, though they last 3 * 40 ms; eight at 11 ms are too short: 7 * 11 = 77 ms.
    """
    steps_m = np.full(100, 0.001)
    steps_m[50 : 50 + repeats], steps_m[50 + repeats] = 0.0, 0.01
    spans = spans_on_a_line(np.cumsum(steps_m), step_ms=step_ms)
    assert [span.code for span in spans] == codes
    for span in spans:
        assert (span.first, span.last, span.count) == (50, 49 + repeats, repeats)
        assert span.size == pytest.approx(0.01)  # of the step behind, in metres


@pytest.mark.parametrize(("before_mm", "after_mm", "codes"), [(1, 1, ["frozen"]), (5, 1, []), (1, 5, [])])
def test_frozen_cup_catches_up_faster_than_it_moves_around(before_mm, after_mm, codes):
    """The cup moves by so many mm a sample, repeats a position 20 times, steps by 10 mm, and moves on.

    A step over 3 times as large as those around it, and 2 mm more, says that it had been frozen: over 5 mm among steps
    of 1 mm, but over 17 mm among steps of 5 mm.
    """
    steps_mm = [before_mm] * 50 + [0] * 20 + [10] + [after_mm] * 50
    assert [span.code for span in spans_on_a_line(0.001 * np.cumsum(steps_mm))] == codes


@pytest.mark.parametrize(
    ("frames_without_rotation", "codes"),
    [
        pytest.param([], ["frozen"], id="rotates on"),
        pytest.param([119], [], id="rests in the last frame"),
        pytest.param([100], [], id="rests in the first frame"),
    ],
)
def test_position_that_repeats_while_turning_is_frozen(frames_without_rotation, codes):
    """A cup moves 1 mm and rotates 0.01 rad a frame; its position repeats in frames 100 to 119, without a jump behind.

    That is a frozen position, unless in a frame of them its rotation repeats too: then the body may rest.
    """
    steps, angles = np.full(330, 0.001), np.full(330, 0.01)  # 300 other frames are enough to know that it moves
    steps[100:120] = 0.0
    angles[frames_without_rotation] = 0.0
    half, zeros = np.cumsum(angles) / 2.0, np.zeros(330)
    quaternions = np.stack([zeros, np.sin(half), zeros, np.cos(half)], axis=1)
    assert [item.code for item in spans_on_a_line(np.cumsum(steps), quaternions)] == codes


WALK = 0.001 * np.arange(50)
AT_ORIGIN = np.zeros(20)
IDENTITY_POSES = {
    # case: (x of a cup in metres, codes of what is reported)
    "from the start": ([AT_ORIGIN, 0.5 + WALK], ["identity-while-lost"]),
    "to the end": ([0.5 + WALK, AT_ORIGIN], ["identity-while-lost"]),
    "entered by a jump, left by 8 mm": ([0.5 + WALK, AT_ORIGIN, 0.008 + WALK], ["identity-while-lost"]),
    "entered by 8 mm, left by a jump": ([WALK - 0.057, AT_ORIGIN, 0.5 + WALK], ["identity-while-lost"]),
    "passed through by steps of 12 mm": ([0.012 * np.arange(-50, 50)], []),
}


@pytest.mark.parametrize("case", IDENTITY_POSES)
def test_identity_pose_beside_a_jump_is_a_lost_pose(case):
    """A cup that never rotates walks along X by 1 mm a frame, and is at x = 0, the identity pose, for 20 frames.

    Where it jumps there or away, by 0.5 m, it was lost, though the other step be small. The last cup walks by 12 mm a
    frame and is at 0 once: a step over 1 cm, but not over five of its ordinary steps, is no jump.
    """
    pieces, codes = IDENTITY_POSES[case]
    spans = spans_on_a_line(np.concatenate(pieces))
    assert [span.code for span in spans if span.code != "teleport"] == codes


def test_jump_lasts_from_the_last_pose_before_it():
    """The hand jumps 1 m in frame 400 and is lost in 399: the jump is from frame 398 to 400."""
    draft = clean_draft()
    draft.arrays["position"][400:, HAND] += 1.0
    draft.arrays["status"][399, HAND] = Status.LOST
    before, after = draft.arrays["stamp_ns"][[398, 400]].tolist()
    jumps = teleports(run_pose_pass([draft.session().frames]))
    assert {name: stamps.tolist() for name, stamps in jumps.items()} == {"hand-left": [[before, after]]}


def test_body_in_millimetres_has_no_jumps():
    """The tray's positions are in millimetres, and it jumps by 1 m; the doctor reports its unit instead."""
    draft = clean_draft()
    draft.arrays["position"][:, TRAY] *= 1000.0
    draft.arrays["position"][500:, TRAY] += 1000.0
    assert teleports(run_pose_pass([draft.session().frames])) == {}


def test_body_in_millimetres_is_not_out_of_space():
    """The tray is at (1000, 900, 1200), which would be beyond 1 km, where no pose counts; one position is no number.

    They are taken for millimetres: the only finding is that number, (code, body, first frame, last frame).
    """
    draft = clean_draft()
    draft.arrays["position"][:, TRAY] = [1000.0, 900.0, 1200.0]
    draft.arrays["position"][100, TRAY] = np.nan
    assert spans_of_draft(draft) == [("not-finite", TRAY, 100, 100)]
