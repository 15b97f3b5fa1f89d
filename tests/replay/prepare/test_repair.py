import json
from dataclasses import replace

import numpy as np
import pytest
from support.planted_faults import FAULTS, clean_draft
from support.session_files import assert_same_frames
from support.small_worlds import cube

from replay.engine import compute
from replay.errors import RefusedError
from replay.prepare.policy import parse_policy
from replay.prepare.repair import repair_session
from sessions import Frames, MeshData, ScalarTrack, Status

FLASK, HAND, TRAY = 0, 1, 2
"""Numbers of the bodies of ``clean_draft``: 900 frames of 11.1 ms in which flask and hand move and the tray rests."""


def test_losses_flagged_by_the_tracker_need_no_repair():
    """The tracker itself flags frames 100 to 109 of the left hand as lost: the session is given back as it is.

    An interval says so; all ten samples are dropped, as nothing stands in for them.
    """
    draft = clean_draft()
    draft.arrays["status"][100:110, HAND] = Status.LOST
    session = draft.session()
    repair = repair_session(session, parse_policy())
    assert repair.session is session
    (span,) = repair.spans
    assert (span.kind, span.body, span.samples, span.dropped) == ("tracking-lost", "hand-left", 10, 10)


def test_repair_reports_held_and_dropped_samples_per_interval():
    """20 lost samples 11.1 ms apart: 9 lie within the 0.1 s for which the last pose stands in, 11 are dropped."""
    repair = repair_session(hand_lost_from_frame_400().session(), parse_policy(["identity-while-lost=hold:0.1"]))
    span = next(item for item in repair.spans if item.kind == "identity-while-lost")
    assert (span.samples, span.held, span.dropped, span.action) == (20, 9, 11, "hold:0.1")


def test_repair_as_json_has_the_text_of_its_policy():
    """The repair is written as strict JSON and read again; its policy says the action and the limit in seconds."""
    repair = repair_session(hand_lost_from_frame_400().session(), parse_policy(["identity-while-lost=hold:0.1"]))
    document = json.loads(json.dumps(repair.as_json(), allow_nan=False))
    assert document["policy"]["identity-while-lost"] == "hold:0.1"


def test_the_frame_after_a_gap_is_flagged():
    """A second without frames comes before frame 400, which alone is flagged: its interval begins and ends there."""
    draft = clean_draft()
    FAULTS["1 s gap"](draft, body=HAND, frame=400)
    (span,) = (item for item in repair_session(draft.session(), parse_policy()).spans if item.kind == "gap")
    stamp_of_frame_400 = draft.arrays["stamp_ns"][400]
    assert (span.start_ns, span.end_ns) == (stamp_of_frame_400, stamp_of_frame_400)


@pytest.mark.sampled(5)
@pytest.mark.parametrize("name", ["frozen pose", "1 s gap", "time backwards", "mirrored mesh", "millimetres"])
def test_refusal_of_the_policy_stops_the_run_with_a_sentence(name):
    """The named fault is planted at frame 400, in the left hand where it is of a body.

    By default it is a finding; where the policy refuses its kind an error says so and which option allows it.
    """
    draft = clean_draft()
    planted = FAULTS[name](draft, body=HAND, frame=400)
    assert planted.code in {item.code for item in repair_session(draft.session(), parse_policy()).findings}
    with pytest.raises(RefusedError, match=rf"^the session: {planted.code}.*--policy {planted.code}="):
        repair_session(draft.session(), parse_policy([f"{planted.code}=refuse"]))


@pytest.mark.parametrize(
    ("action", "broken"),
    [
        pytest.param("keep", [400, 420], id="used as they are: it jumps there and back"),
        pytest.param("interpolate:1", [], id="interpolated: it never jumps"),
        pytest.param("drop", [*range(400, 421)], id="dropped: no pose, no path"),
    ],
)
def test_path_is_known_where_used_poses_do_not_teleport(action, broken):
    """A lost hand is recorded at the origin in frames 400 to 419. ``action``: what the policy makes of these poses.

    ``broken``: frames to which the path from the frame before is unknown; the first frame, 0, always is.
    """
    session, policy = hand_lost_from_frame_400().session(), [f"identity-while-lost={action}"]
    motion = compute(session, detectors="sphere", oracle="none", policy=policy).assembly.motion
    assert np.flatnonzero(~motion.linked[:, HAND]).tolist() == [0, *broken]


def test_teleport_through_a_wall_is_no_contact_between_frames():
    """The hand rests 0.2 m before the tray, a wall of 4 mm at 0.125 m; in frame 450 it jumps 0.15 m, through the wall.

    That is a teleport, not a motion: even the detector that tests the way between frames reports no contact.
    """
    draft = clean_draft()
    position = draft.arrays["position"]
    position[:, HAND] = position[:, TRAY] + [0.0, 0.0, 0.2]
    position[450:, HAND, 2] -= 0.15
    draft.meshes["tray"] = MeshData(cube().vertices * [1.0, 1.0, 0.004] + [0.0, 0.0, 0.125], cube().faces)
    draft.meshes["hand-left"] = cube(edge=0.01)
    result = compute(draft.session(), detectors="exact", oracle="continuous", pairs=[("hand-left", "tray")])
    assert "teleport" in {item.code for item in result.repaired.findings}
    assert result.episodes == {"exact": (), "continuous": ()}
    assert result.misses == {"exact": ()}


def hand_lost_from_frame_400():
    """A session of 900 frames of 11.1 ms whose left hand is recorded at the origin, lost, in frames 400 to 419."""
    draft = clean_draft()
    FAULTS["identity while lost"](draft, body=HAND, frame=400)
    return draft


def repaired_session(draft, *words):
    """The session of a draft after repairs by this policy."""
    return repair_session(draft.session(), parse_policy(words)).session


@pytest.mark.sampled(4)
@pytest.mark.parametrize("size", [1, 7, 64, 900])
def test_the_frames_do_not_depend_on_blocks(size):
    """A repaired session of 900 frames is read in blocks of ``size`` frames and whole."""
    session = repaired_session(hand_lost_from_frame_400(), "identity-while-lost=interpolate:1")
    more_than_all = 10_000
    assert_same_frames(Frames.join([*session.blocks(size)]), Frames.join([*session.blocks(more_than_all)]))


LOST, LAST_POSE, INTERPOLATED = Status.LOST, Status.HELD, Status.INTERPOLATED


@pytest.mark.sampled(7)
@pytest.mark.parametrize(
    ("arguments", "status"),
    [
        pytest.param(["identity-while-lost=drop"], [LOST] * 20, id="drop"),
        # A pose stands in for its limit and no longer, and a bridge does not lead beyond its own.
        pytest.param(["identity-while-lost=hold:0.1"], [LAST_POSE] * 9 + [LOST] * 11, id="hold for 0.1 s"),
        pytest.param(["identity-while-lost=interpolate:0.3"], [INTERPOLATED] * 20, id="a bridge of up to 0.3 s"),
        pytest.param(["identity-while-lost=interpolate:0.2"], [LOST] * 20, id="a bridge of up to 0.2 s is too short"),
        # Sample 10, from 0 on, has two faults: the stricter action counts, and of equal ones the first sets the limit.
        pytest.param(
            ["identity-while-lost=interpolate:1", "not-finite=drop"],
            [INTERPOLATED] * 10 + [LOST] + [INTERPOLATED] * 9,
            id="drop is stricter than interpolate",
        ),
        pytest.param(
            ["identity-while-lost=hold:1", "not-finite=hold:0.05"], [LAST_POSE] * 20, id="first limit is long"
        ),
        pytest.param(
            ["identity-while-lost=hold:0.05", "not-finite=hold:1"],
            [LAST_POSE] * 4 + [LOST] * 16,
            id="first limit is short",
        ),
    ],
)
def test_policy_decides_the_pose_of_a_lost_hand(arguments, status):
    """20 samples 11 ms apart are lost from frame 400 on, 0.22 s; limits of actions are in seconds.

    ``status``: of each of them after the repair. With two arguments sample 10 is not finite as well. Poses are those
    that the status says: recorded, that of frame 399, or within 2 cm of the true path; all others keep their bits.
    """
    draft = hand_lost_from_frame_400()
    if len(arguments) > 1:
        draft.arrays["position"][410, HAND] = np.nan
    before, after = draft.session().frames, repaired_session(draft, *arguments).frames
    assert after.status[400:420, HAND].tolist() == status

    is_lost = np.zeros(before.status.shape, dtype=bool)
    is_lost[400:420, HAND] = True
    for name in ("position", "quaternion_xyzw", "status", "sample_ns"):
        assert np.array_equal(getattr(before, name)[~is_lost], getattr(after, name)[~is_lost]), name

    dropped, last_pose, between = (
        400 + np.flatnonzero(np.equal(status, item)) for item in (LOST, LAST_POSE, INTERPOLATED)
    )
    assert np.array_equal(before.position[dropped, HAND], after.position[dropped, HAND], equal_nan=True)
    assert (after.position[last_pose, HAND] == after.position[399, HAND]).all()
    true_position = clean_draft().arrays["position"][:, HAND]
    assert np.abs(after.position[between, HAND] - true_position[between]).max(initial=0.0) < 0.02
    quaternion_lengths = np.linalg.norm(after.quaternion_xyzw[between, HAND], axis=1)
    assert np.abs(quaternion_lengths - 1).max(initial=0.0) < 1e-12


@pytest.mark.parametrize("action", ["hold:9", "interpolate:9"])
def test_losses_before_the_first_good_sample_stay_lost(action):
    """The flask is lost in frames 0 to 19: no pose comes before them to stand in or to begin a bridge of up to 9 s."""
    draft = clean_draft()
    FAULTS["identity while lost"](draft, body=FLASK, frame=0)
    status = repaired_session(draft, f"identity-while-lost={action}").frames.status[:, FLASK]
    assert (status[:20] == LOST).all() and (status[20:] == Status.VALID).all()


def test_no_bridge_leads_beyond_the_last_good_sample():
    """The flask is lost from frame 880 to the last, 899: there is no pose to end a bridge of up to 9 s."""
    draft = clean_draft()
    FAULTS["identity while lost"](draft, body=FLASK, frame=880)
    status = repaired_session(draft, "identity-while-lost=interpolate:9").frames.status[:, FLASK]
    assert (status[:880] == Status.VALID).all() and (status[880:] == LOST).all()


def test_findings_of_a_window_use_seconds_of_the_recording():
    """The hand is lost in frames 400 to 419: finding and interval say the seconds from frame 0, also of a window.

    A window of frames 300 to 600 has the same findings but that of a stream of numbers, which lies 60 s later.
    """
    draft = hand_lost_from_frame_400()
    stamps = draft.arrays["stamp_ns"]
    later_stream = ScalarTrack([int(stamps[0]) + 60 * 10**9, int(stamps[0]) + 61 * 10**9], [1, 2])
    whole = replace(draft.session(), scalars={"late": later_stream})
    window = whole.between(int(stamps[300]), int(stamps[600]))
    expected_seconds = pytest.approx((stamps[[400, 419]] - stamps[0]) / 1e9)
    repairs = [repair_session(session, parse_policy()) for session in (whole, window)]
    for repair in repairs:
        (finding,) = (item for item in repair.findings if item.code == "identity-while-lost")
        (span,) = (item for item in repair.spans if item.kind == "identity-while-lost")
        assert (finding.start, finding.end) == expected_seconds
        assert (span.start, span.end) == expected_seconds
    codes_of_whole, codes_of_window = ({item.code for item in repair.findings} for repair in repairs)
    assert codes_of_whole - codes_of_window == {"stream-apart"}
