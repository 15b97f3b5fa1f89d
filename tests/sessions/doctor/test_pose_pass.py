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


def session_with_every_pose_fault():
    """A session with four kinds of wrong poses, and with lost and absent samples."""
    draft = clean_draft()
    for at, name in enumerate(("nan position", "zero quaternion", "non-unit quaternion", "identity while lost")):
        FAULTS[name](draft, 0, 100 + 100 * at)
    draft.arrays["status"][700:720, 1] = Status.LOST
    draft.arrays["status"][::3, 2] = Status.ABSENT
    return draft.session()


@pytest.mark.parametrize("size", [1, 7, 100, 899])
def test_the_marks_do_not_depend_on_blocks(size):
    """900 frames whole, and in blocks of ``size``."""
    session = session_with_every_pose_fault()
    whole, pieces = run_pose_pass([session.frames]), run_pose_pass(session.frames.blocks(size))
    assert np.array_equal(whole.marks, pieces.marks)
    assert np.array_equal(whole.steps, pieces.steps, equal_nan=True)
    assert np.array_equal(whole.worst_norm, pieces.worst_norm)
    assert whole.digest == pieces.digest


def test_a_body_that_appears_later_gets_a_column():
    """The first 50 of 900 frames have one body, the others three."""
    frames = clean_draft().session().frames
    few = Frames(
        frames.names[:1], frames.stamp_ns[:50], frames.log_ns[:50], frames.sample_ns[:50, :1],
        frames.position[:50, :1], frames.quaternion_xyzw[:50, :1], frames.status[:50, :1],
    )  # fmt: skip
    outcome = run_pose_pass([few, frames.segment(50, 900)])
    assert outcome.names == frames.names and outcome.marks.shape == (900, 3)
    assert not outcome.has(Mark.PRESENT)[:50, 1].any() and outcome.has(Mark.PRESENT)[50:, 1].all()


def test_long_recording_keeps_fewer_poses_over_its_whole_length(monkeypatch):
    """900 frames come in blocks of 100, with room for 600 poses.

    From the seventh on every second one is dropped, also of those before.
    """
    monkeypatch.setattr(pose_pass, "MOST_SAMPLES", 600)
    monkeypatch.setattr(pose_pass, "JOINED_FRAMES", 100)
    frames = clean_draft().session().frames
    long = run_pose_pass(frames.blocks(100))
    at = [int(np.flatnonzero((frames.position[:, 0] == place).all(axis=1))[0]) for place in long.position[:, 0]]
    assert at == list(range(0, 900, 2))


@pytest.mark.parametrize(("size", "samples"), [(30, 80), (300, 30)])
def test_small_blocks_are_joined_and_large_blocks_are_not(size, samples, monkeypatch):
    """Ten samples of each joined block of 900 frames: of seven blocks of 120 and one of 60, or of three of 300."""
    monkeypatch.setattr(pose_pass, "JOINED_FRAMES", 100)
    monkeypatch.setattr(pose_pass, "SAMPLES_PER_BLOCK", 10)
    assert len(run_pose_pass(clean_draft().session().frames.blocks(size)).position) == samples


def findings_with_code(draft, code):
    """The doctor's findings of a code."""
    return [item for item in examine(draft.session()) if item.code == code]


@pytest.mark.parametrize(("degrees", "frames", "expected_at"), [(95.0, 1, [400]), (20.0, 1, []), (95.0, 2, [])])
def test_single_frame_rotation_outlier_is_reported_and_rotation_is_not(degrees, frames, expected_at):
    """From frame 400 on, so many frames are rotated by so many degrees."""
    draft = clean_draft()
    half = np.radians(degrees) / 2.0
    rotations = draft.arrays["quaternion_xyzw"][400 : 400 + frames, 1]
    rotations[:] = quaternion_product(rotations, (np.sin(half), 0.0, 0.0, np.cos(half)))
    result = findings_with_code(draft, "turn-outlier")
    assert all((item.body, item.count, item.severity) == ("hand-left", 1, Severity.WARNING) for item in result)
    assert [round(item.start * 90) for item in result] == expected_at


def spans_of_draft(draft):
    """Findings on poses: (code, column of the body, first frame, last frame)."""
    return [
        (item.code, item.column, item.first, item.last) for item in pose_spans(run_pose_pass([draft.session().frames]))
    ]


def test_bodies_at_origin_or_rotating_are_neither_lost_nor_frozen():
    """Body 2 moves in the plane y = 0; 0 stays and rotates; 1 walks 0.1 mm a frame from frame 100 on."""
    draft = clean_draft()
    draft.arrays["position"][:, 2] = 0.0
    draft.arrays["position"][:, 0] = [0.2, 1.0, 0.1]
    slow = 1e-4 * np.maximum(0, np.arange(900) - 100)
    draft.arrays["position"][:, 1] = slow[:, None] * [1.0, 0.0, 0.0]
    draft.arrays["quaternion_xyzw"][:, 1] = [0.0, 0.0, 0.0, 1.0]
    assert spans_of_draft(draft) == []


@pytest.mark.parametrize(
    "position", [np.maximum(0, np.arange(900) - 30) * 10 / 90, np.abs(np.arange(900) - 30) * 4 / 90]
)
def test_sudden_start_or_reversal_of_motion_is_no_teleport(position):
    """A body starts at 10 m/s, or reverses at 4 m/s, without a jump in position."""
    draft = clean_draft()
    draft.arrays["position"][:, 1] = position[:, None] * [1.0, 0.0, 0.0]
    assert "teleport" not in {code for code, *_ in spans_of_draft(draft)}


def test_close_stamps_cause_no_jump():
    """1.1 cm a frame at 90 Hz; one frame's stamp is 0.1 ms after the one before."""
    times, position = 10**9 + 11_111_111 * np.arange(200), np.zeros((200, 3))
    position[:, 0] = 0.011 * np.arange(200)
    times[100] = times[99] + 100_000
    session = Session.from_arrays(times, {"a": (position, np.tile([0.0, 0.0, 0.0, 1.0], (200, 1)))})
    assert not (run_pose_pass([session.frames]).marks & Mark.TELEPORT).any()


def test_position_still_after_jump_is_frozen_despite_rotation():
    """Spans: (code, body, first, last frame); body 1 stops in 500 to 559, body 0 in 300 to 329 and 600 to 629."""
    draft = clean_draft()
    rng = np.random.default_rng(3)
    draft.arrays["position"][:, 1] = rng.normal([0.2, 1.0, 0.1], 1e-4, (900, 3))
    draft.arrays["position"][500:560, 1] = draft.arrays["position"][499, 1]
    draft.arrays["position"][300:330, 0] = [2.0, 2.0, 2.0]
    draft.arrays["position"][600:630, 0] = 0.0  # nowhere, and for all but two of the frames as if never turned
    draft.arrays["quaternion_xyzw"][600:628, 0] = [0.0, 0.0, 0.0, 1.0]
    assert {("frozen", 1, 500, 559), ("frozen", 0, 300, 329), ("frozen", 0, 600, 629)} <= {*spans_of_draft(draft)}


def test_jump_is_detected_in_a_recording_of_three_frames():
    """The cup is at rest and then jumps 1 m in 11 ms, to the third frame."""
    poses = np.array([[0, 1, 0], [0, 1, 0], [1, 1, 0]]), np.tile([0.0, 0.0, 0.0, 1.0], (3, 1))
    session = Session.from_arrays(np.arange(3) * 11_111_111, {"cup": poses})
    assert run_pose_pass([session.frames]).has(Mark.TELEPORT)[:, 0].tolist() == [False, False, True]


@given(st.lists(st.booleans(), max_size=40))
def test_the_runs_of_a_mask_make_the_mask_again(mask):
    """Runs are (first, last index) of True; between two of them there is a False."""
    again = np.zeros(len(mask), dtype=bool)
    result = runs(np.array(mask, dtype=bool))
    for first, last in result.tolist():
        assert not again[first : last + 1].any()
        again[first : last + 1] = True
    assert again.tolist() == mask
    assert (result[1:, 0] > result[:-1, 1] + 1).all()


def test_worst_quaternion_norm_deviates_most_from_unit_length():
    """Norms of 0.1 and 1.5 deviate from 1 by 0.9 and 0.5."""
    draft = clean_draft()
    draft.arrays["quaternion_xyzw"][200, 0] *= 0.1
    draft.arrays["quaternion_xyzw"][201, 0] *= 1.5
    assert run_pose_pass([draft.session().frames]).worst_norm[0] == pytest.approx(0.1)


def spans_on_a_line(x, quaternions=None, step_ms=11):
    """Spans of a cup at these places of the X axis, metres, with a sample every ``step_ms``."""
    if quaternions is None:
        quaternions = np.tile([0.0, 0.0, 0.0, 1.0], (len(x), 1))
    poses = {"cup": (np.asarray(x)[:, None] * [1.0, 0.0, 0.0], quaternions)}
    session = Session.from_arrays(np.arange(len(x)) * step_ms * 1_000_000, poses)
    return pose_spans(run_pose_pass([session.frames]))


@pytest.mark.parametrize(
    ("step_ms", "repeats", "codes"), [(40, 4, []), (40, 5, ["frozen"]), (11, 8, []), (11, 9, ["frozen"])]
)
def test_position_is_frozen_after_5_repeats_and_80_ms(step_ms, repeats, codes):
    """The cup walks 1 mm a sample, repeats a position and then steps 10 mm."""
    steps = np.full(100, 0.001)
    steps[50 : 50 + repeats], steps[50 + repeats] = 0.0, 0.01
    result = spans_on_a_line(np.cumsum(steps), step_ms=step_ms)
    assert [item.code for item in result] == codes
    assert all((item.first, item.last, item.count) == (50, 49 + repeats, repeats) for item in result)
    assert all(item.size == pytest.approx(0.01) for item in result)


@pytest.mark.parametrize(("before", "after", "codes"), [(1, 1, ["frozen"]), (5, 1, []), (1, 5, [])])
def test_frozen_cup_catches_up_faster_than_it_moves_around(before, after, codes):
    """Steps in mm before and after 20 repeats and a step of 10 mm."""
    steps = 0.001 * np.array([before] * 50 + [0] * 20 + [10] + [after] * 50)
    assert [item.code for item in spans_on_a_line(np.cumsum(steps))] == codes


@pytest.mark.parametrize(("repeated_rotation", "codes"), [([], ["frozen"]), ([119], []), ([100], [])])
def test_position_that_repeats_while_turning_is_frozen(repeated_rotation, codes):
    """The position repeats in frames 100 to 119; in a frame whose rotation repeats as well, the body may rest."""
    steps, angles = np.full(330, 0.001), np.full(330, 0.01)
    steps[100:120] = 0.0
    angles[repeated_rotation] = 0.0
    half, zeros = np.cumsum(angles) / 2.0, np.zeros(330)
    quaternions = np.stack([zeros, np.sin(half), zeros, np.cos(half)], axis=1)
    assert [item.code for item in spans_on_a_line(np.cumsum(steps), quaternions)] == codes


WALK = 0.001 * np.arange(50)
AT_ORIGIN = np.zeros(20)
IDENTITY_POSES = {
    "from the start": ([AT_ORIGIN, 0.5 + WALK], ["identity-while-lost"]),
    "to the end": ([0.5 + WALK, AT_ORIGIN], ["identity-while-lost"]),
    "entered by a jump, left by 8 mm": ([0.5 + WALK, AT_ORIGIN, 0.008 + WALK], ["identity-while-lost"]),
    "entered by 8 mm, left by a jump": ([WALK - 0.057, AT_ORIGIN, 0.5 + WALK], ["identity-while-lost"]),
    "passed through by steps of 12 mm": ([0.012 * np.arange(-50, 50)], []),
}


@pytest.mark.parametrize("case", IDENTITY_POSES)
def test_identity_pose_beside_a_jump_is_a_lost_pose(case):
    """A row of IDENTITY_POSES: places on X in m. No body ever turns, so a place of 0 is the identity pose."""
    pieces, codes = IDENTITY_POSES[case]
    assert [item.code for item in spans_on_a_line(np.concatenate(pieces)) if item.code != "teleport"] == codes


def test_jump_lasts_from_the_last_pose_before_it():
    """Body 1 jumps 1 m in frame 400, lost in 399; body 2 jumps as far, but is in millimetres."""
    draft = clean_draft()
    draft.arrays["position"][400:, 1] += 1.0
    draft.arrays["status"][399, 1] = Status.LOST
    draft.arrays["position"][:, 2] *= 1000.0
    draft.arrays["position"][500:, 2] += 1000.0
    before, after = draft.arrays["stamp_ns"][[398, 400]].tolist()
    jumps = teleports(run_pose_pass([draft.session().frames]))
    assert {name: stamps.tolist() for name, stamps in jumps.items()} == {"hand-left": [[before, after]]}


def test_body_in_millimetres_is_not_out_of_space():
    """Positions of 1,000 are a metre; the only finding is the planted NaN: (code, body, first, last)."""
    draft = clean_draft()
    draft.arrays["position"][:, 2] = [1000.0, 900.0, 1200.0]
    draft.arrays["position"][100, 2] = np.nan
    assert spans_of_draft(draft) == [("not-finite", 2, 100, 100)]
