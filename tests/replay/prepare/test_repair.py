import json

import pytest
from support.planted_faults import FAULTS, clean

from cdcore.errors import InvalidPoseError
from replay.errors import RefusedError
from replay.pipeline.engine import compute
from replay.prepare.policy import parse_policy
from replay.prepare.repair import repair_session


def test_a_clean_session_goes_on_as_it_is():
    session = clean().session()
    treatment = repair_session(session, parse_policy())
    assert treatment.session is session and treatment.spans == ()
    assert [finding.code for finding in treatment.findings] == ["at-rest"]


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


def test_a_sample_that_is_no_pose_is_refused_by_default_with_its_frame():
    draft = clean()
    FAULTS["nan position"](draft, 1, 400)
    with pytest.raises(InvalidPoseError, match=r"frame 400 .*body hand-left.*--policy"):
        compute(draft.session(), detectors="sphere", oracle="none")


@pytest.mark.parametrize("name", ["frozen pose", "1 s gap", "time backwards", "mirrored mesh", "millimetres"])
def test_what_the_policy_refuses_stops_the_run_with_one_sentence(name):
    draft = clean()
    planted = FAULTS[name](draft, 1, 400)
    assert repair_session(draft.session(), parse_policy()).findings
    with pytest.raises(RefusedError, match=rf"{planted.code}.*--policy {planted.code}="):
        repair_session(draft.session(), parse_policy([f"{planted.code}=refuse"]))
