import json

import numpy as np
import pytest
from support.mcap_samples import assert_same_frames
from support.planted_faults import FAULTS, clean
from support.small_worlds import cube

from replay.errors import RefusedError
from replay.pipeline.engine import compute
from replay.prepare.policy import parse_policy
from replay.prepare.repair import repair_session
from sessions import Frames, MeshData, Status


def test_losses_that_the_tracker_flagged_need_no_treatment():
    draft = clean()
    draft.arrays["status"][100:110, 1] = 2
    session = draft.session()
    treatment = repair_session(session, parse_policy())
    assert treatment.session is session
    (span,) = treatment.spans
    assert (span.kind, span.body, span.samples, span.dropped) == ("tracking-lost", "hand-left", 10, 10)


def test_what_was_done_is_told_per_span():
    draft = clean()
    FAULTS["identity while lost"](draft, 1, 400)
    treatment = repair_session(draft.session(), parse_policy(["identity-while-lost=hold:0.1"]))
    span = next(one for one in treatment.spans if one.kind == "identity-while-lost")
    assert (span.samples, span.held, span.dropped, span.action) == (20, 9, 11, "hold:0.1")
    assert json.loads(json.dumps(treatment.as_json(), allow_nan=False))["policy"]["identity-while-lost"] == "hold:0.1"


@pytest.mark.parametrize("name", ["frozen pose", "1 s gap", "time backwards", "mirrored mesh", "millimetres"])
def test_what_the_policy_refuses_stops_the_run_with_one_sentence(name):
    draft = clean()
    planted = FAULTS[name](draft, 1, 400)
    assert repair_session(draft.session(), parse_policy()).findings
    with pytest.raises(RefusedError, match=rf"{planted.code}.*--policy {planted.code}="):
        repair_session(draft.session(), parse_policy([f"{planted.code}=refuse"]))


def test_a_path_is_known_where_the_poses_used_do_not_teleport():
    """As recorded the hand jumps to the origin and back; bridged it does not."""
    draft = clean()
    FAULTS["identity while lost"](draft, 1, 400)
    jumps = {"keep": [400, 420], "interpolate:1": [], "drop": [*range(400, 421)]}
    for action, broken in jumps.items():
        result = compute(draft.session(), detectors="sphere", oracle="none", policy=[f"identity-while-lost={action}"])
        assert np.flatnonzero(~result.assembly.motion.linked[:, 1]).tolist() == [0, *broken]


def test_what_the_doctor_calls_a_teleport_is_no_contact_between_frames():
    """A jump of 0.15 m in one frame through a wall of 4 mm."""
    draft = clean()
    draft.arrays["position"][:, 1] = draft.arrays["position"][:, 2] + [0.0, 0.0, 0.2]
    draft.arrays["position"][450:, 1, 2] -= 0.15
    draft.meshes["tray"] = MeshData(cube().vertices * [1.0, 1.0, 0.004] + [0.0, 0.0, 0.125], cube().faces)
    draft.meshes["hand-left"] = cube(0.01)
    result = compute(draft.session(), detectors="exact", oracle="continuous", pairs=[("hand-left", "tray")])
    assert "teleport" in {one.code for one in result.treatment.findings}
    assert result.episodes == {"exact": (), "continuous": ()} and result.misses == {"exact": ()}


def repaired(draft, *words):
    return repair_session(draft.session(), parse_policy(words)).session


def lost_hand():
    draft = clean()
    planted = FAULTS["identity while lost"](draft, 1, 400)
    return draft, planted


@pytest.mark.parametrize("size", [1, 7, 64, 900])
def test_the_frames_do_not_depend_on_blocks(size):
    draft, _ = lost_hand()
    session = repaired(draft, "identity-while-lost=interpolate:1")
    assert_same_frames(Frames.join([*session.blocks(size)]), Frames.join([*session.blocks(10_000)]))


def test_dropped_samples_are_lost_and_all_others_keep_their_bits():
    draft, _ = lost_hand()
    before, after = draft.session().frames, repaired(draft).frames
    assert (after.status[400:420, 1] == Status.LOST).all()
    changed = np.argwhere(before.status != after.status)
    assert len(changed) == 20 and set(changed[:, 1]) == {1}
    assert np.array_equal(before.position, after.position) and np.array_equal(before.sample_ns, after.sample_ns)


def test_a_pose_is_held_for_its_limit_and_no_longer():
    draft, _ = lost_hand()
    frames = repaired(draft, "identity-while-lost=hold:0.1").frames
    assert frames.status[400:420, 1].tolist() == [Status.HELD] * 9 + [Status.LOST] * 11
    assert (frames.position[400:409, 1] == frames.position[399, 1]).all()


def test_a_bridge_leads_from_the_last_good_pose_to_the_next_and_not_beyond_its_limit():
    draft, _ = lost_hand()
    truth = clean().arrays["position"][400:420, 1]
    frames = repaired(draft, "identity-while-lost=interpolate:0.3").frames
    assert (frames.status[400:420, 1] == Status.INTERPOLATED).all()
    assert np.abs(frames.position[400:420, 1] - truth).max() < 0.02
    assert np.abs(np.linalg.norm(frames.quaternion_xyzw[400:420, 1], axis=1) - 1).max() < 1e-12
    short = repaired(draft, "identity-while-lost=interpolate:0.2").frames
    assert (short.status[400:420, 1] == Status.LOST).all()


def test_a_sample_with_two_faults_meets_the_stricter_action():
    draft, _ = lost_hand()
    draft.arrays["position"][410, 1] = np.nan
    frames = repaired(draft, "identity-while-lost=interpolate:1", "not-finite=drop").frames
    assert frames.status[410, 1] == Status.LOST
    assert (frames.status[[400, 409, 411, 419], 1] == Status.INTERPOLATED).all()


@pytest.mark.parametrize(("first", "second", "status"), [(1, 0.05, Status.HELD), (0.05, 1, Status.LOST)])
def test_of_two_faults_with_one_action_the_first_sets_the_limit(first, second, status):
    draft, _ = lost_hand()
    draft.arrays["position"][410, 1] = np.nan
    frames = repaired(draft, f"identity-while-lost=hold:{first}", f"not-finite=hold:{second}").frames
    assert frames.status[410, 1] == status


def test_nothing_stands_in_before_the_first_good_sample():
    draft = clean()
    FAULTS["identity while lost"](draft, 0, 0)
    for words in ("identity-while-lost=hold:9", "identity-while-lost=interpolate:9"):
        assert (repaired(draft, words).frames.status[:20, 0] == Status.LOST).all()
