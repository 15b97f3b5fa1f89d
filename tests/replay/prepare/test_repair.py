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


def test_losses_flagged_by_the_tracker_need_no_repair():
    """Frames 100 to 109 of the left hand are lost by the tracker's own word."""
    draft = clean_draft()
    draft.arrays["status"][100:110, 1] = Status.LOST
    session = draft.session()
    repair = repair_session(session, parse_policy())
    assert repair.session is session
    (span,) = repair.spans
    assert (span.kind, span.body, span.samples, span.dropped) == ("tracking-lost", "hand-left", 10, 10)


def test_repair_reports_held_and_dropped_samples_per_interval():
    """20 lost samples at 90 Hz: 9 lie within the 0.1 s to hold, 11 are dropped."""
    repair = repair_session(lost_hand().session(), parse_policy(["identity-while-lost=hold:0.1"]))
    span = next(item for item in repair.spans if item.kind == "identity-while-lost")
    assert (span.samples, span.held, span.dropped, span.action) == (20, 9, 11, "hold:0.1")
    assert json.loads(json.dumps(repair.as_json(), allow_nan=False))["policy"]["identity-while-lost"] == "hold:0.1"


def test_the_frame_after_a_gap_is_flagged():
    """A gap of 1 s is planted before frame 400."""
    draft = clean_draft()
    FAULTS["1 s gap"](draft, body=1, frame=400)
    (span,) = (item for item in repair_session(draft.session(), parse_policy()).spans if item.kind == "gap")
    assert (span.start_ns, span.end_ns) == (draft.arrays["stamp_ns"][400],) * 2


@pytest.mark.sampled(5)
@pytest.mark.parametrize("name", ["frozen pose", "1 s gap", "time backwards", "mirrored mesh", "millimetres"])
def test_refusal_of_the_policy_stops_the_run_with_a_sentence(name):
    """A fault planted at frame 400 of the second body is only found by default; with ``refuse`` it ends the run."""
    draft = clean_draft()
    planted = FAULTS[name](draft, body=1, frame=400)
    assert repair_session(draft.session(), parse_policy()).findings
    with pytest.raises(RefusedError, match=rf"^the session: {planted.code}.*--policy {planted.code}="):
        repair_session(draft.session(), parse_policy([f"{planted.code}=refuse"]))


def test_path_is_known_where_used_poses_do_not_teleport():
    """The hand is at the origin in frames 400 to 419: it jumps there and back; interpolated it does not."""
    jumps = {"keep": [400, 420], "interpolate:1": [], "drop": [*range(400, 421)]}
    for action, broken in jumps.items():
        result = compute(
            lost_hand().session(), detectors="sphere", oracle="none", policy=[f"identity-while-lost={action}"]
        )
        assert np.flatnonzero(~result.assembly.motion.linked[:, 1]).tolist() == [0, *broken]


def test_teleport_through_a_wall_is_no_contact_between_frames():
    """A jump of 0.15 m in one frame through a wall of 4 mm."""
    draft = clean_draft()
    draft.arrays["position"][:, 1] = draft.arrays["position"][:, 2] + [0.0, 0.0, 0.2]
    draft.arrays["position"][450:, 1, 2] -= 0.15
    draft.meshes["tray"] = MeshData(cube().vertices * [1.0, 1.0, 0.004] + [0.0, 0.0, 0.125], cube().faces)
    draft.meshes["hand-left"] = cube(edge=0.01)
    result = compute(draft.session(), detectors="exact", oracle="continuous", pairs=[("hand-left", "tray")])
    assert "teleport" in {item.code for item in result.repaired.findings}
    assert result.episodes == {"exact": (), "continuous": ()} and result.misses == {"exact": ()}


def lost_hand():
    """A hand that jumps to the origin for 20 frames of 11 ms."""
    draft = clean_draft()
    FAULTS["identity while lost"](draft, body=1, frame=400)
    return draft


def repaired_session(draft, *words):
    """The session of a draft after repairs by this policy."""
    return repair_session(draft.session(), parse_policy(words)).session


@pytest.mark.sampled(4)
@pytest.mark.parametrize("size", [1, 7, 64, 900])
def test_the_frames_do_not_depend_on_blocks(size):
    """A repaired session is read in blocks of ``size`` frames and whole."""
    session = repaired_session(lost_hand(), "identity-while-lost=interpolate:1")
    assert_same_frames(Frames.join([*session.blocks(size)]), Frames.join([*session.blocks(10_000)]))


LOST, LAST_POSE, INTERPOLATED = Status.LOST, Status.HELD, Status.INTERPOLATED


@pytest.mark.sampled(7)
@pytest.mark.parametrize(
    ("arguments", "status"),
    [
        (["identity-while-lost=drop"], [LOST] * 20),
        # A pose is held for its limit and no longer, and a bridge does not lead beyond its own.
        (["identity-while-lost=hold:0.1"], [LAST_POSE] * 9 + [LOST] * 11),
        (["identity-while-lost=interpolate:0.3"], [INTERPOLATED] * 20),
        (["identity-while-lost=interpolate:0.2"], [LOST] * 20),
        # Sample 10, from 0 on, has two faults: the stricter action holds, and of equal ones the first sets the limit.
        (["identity-while-lost=interpolate:1", "not-finite=drop"], [INTERPOLATED] * 10 + [LOST] + [INTERPOLATED] * 9),
        (["identity-while-lost=hold:1", "not-finite=hold:0.05"], [LAST_POSE] * 20),
        (["identity-while-lost=hold:0.05", "not-finite=hold:1"], [LAST_POSE] * 4 + [LOST] * 16),
    ],
)
def test_policy_decides_the_pose_of_a_lost_hand(arguments, status):
    """20 samples 11 ms apart from frame 400 on, 0.22 s; limits of actions are in seconds.

    ``status``: of each of them after the repair. With two arguments sample 10 is not finite as well.
    """
    draft = lost_hand()
    if len(arguments) > 1:
        draft.arrays["position"][410, 1] = np.nan
    before, truth, after = (
        draft.session().frames,
        clean_draft().arrays["position"][:, 1],
        repaired_session(draft, *arguments).frames,
    )
    assert after.status[400:420, 1].tolist() == status
    dropped, kept, between = (400 + np.flatnonzero(np.equal(status, item)) for item in (LOST, LAST_POSE, INTERPOLATED))
    stand_in = np.zeros(before.status.shape, dtype=bool)
    stand_in[400:420, 1] = True
    for name in ("position", "quaternion_xyzw", "status", "sample_ns"):
        old, new = getattr(before, name), getattr(after, name)
        assert np.array_equal(old[~stand_in], new[~stand_in]), "all others keep their bits"
    assert np.array_equal(before.position[dropped, 1], after.position[dropped, 1], equal_nan=True)
    assert (after.position[kept, 1] == after.position[399, 1]).all()
    assert np.abs(after.position[between, 1] - truth[between]).max(initial=0.0) < 0.02
    assert np.abs(np.linalg.norm(after.quaternion_xyzw[between, 1], axis=1) - 1).max(initial=0.0) < 1e-12


@pytest.mark.parametrize("action", ["hold:9", "interpolate:9"])
def test_losses_before_the_first_good_sample_stay_lost(action):
    """The body is lost in frames 0 to 19: nothing comes before to hold or to begin a bridge."""
    draft = clean_draft()
    FAULTS["identity while lost"](draft, body=0, frame=0)
    assert (repaired_session(draft, f"identity-while-lost={action}").frames.status[:20, 0] == LOST).all()


def test_no_bridge_leads_beyond_the_last_good_sample():
    """The body is lost from frame 880 to the last, 899."""
    draft = clean_draft()
    FAULTS["identity while lost"](draft, body=0, frame=880)
    assert (repaired_session(draft, "identity-while-lost=interpolate:9").frames.status[880:, 0] == LOST).all()


def test_findings_of_a_window_use_seconds_of_the_recording():
    """The hand is lost in frames 400 to 419; a stream 60 s later is not in the window of frames 300 to 600."""
    draft = lost_hand()
    stamps = draft.arrays["stamp_ns"]
    separate = ScalarTrack([int(stamps[0]) + 60 * 10**9, int(stamps[0]) + 61 * 10**9], [1, 2])
    session = replace(draft.session(), scalars={"late": separate})
    codes = []
    for item in (session, session.between(int(stamps[300]), int(stamps[600]))):
        repair = repair_session(item, parse_policy())
        (result,) = (item for item in repair.findings if item.code == "identity-while-lost")
        (span,) = (item for item in repair.spans if item.kind == "identity-while-lost")
        seconds = (stamps[[400, 419]] - stamps[0]) / 1e9
        assert (result.start, result.end) == pytest.approx(seconds) and (span.start, span.end) == pytest.approx(seconds)
        codes.append({item.code for item in repair.findings})
    assert codes[0] - codes[1] == {"stream-apart"}
