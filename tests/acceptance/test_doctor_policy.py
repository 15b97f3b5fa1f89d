"""No verdict changes in silence: under every policy a run differs only in flagged spans, and its summary says how."""

import json
from functools import cache

import numpy as np
import pyarrow.parquet as pq
import pytest
from support.planted_faults import FAULTS, clean_draft

from cdcore import Verdict
from replay.cli.console import EXIT_DATA_LOSS, EXIT_FAILURE, EXIT_OK
from replay.cli.main import main
from replay.prepare.policy import ACTIONS_BY_KIND
from replay.running.runner import run

FAULTY = {
    "not-finite": ("nan position", 100),
    "zero-quaternion": ("zero quaternion", 200),
    "non-unit-quaternion": ("non-unit quaternion", 250),
    "identity-while-lost": ("identity while lost", 300),
    "out-of-space": ("out of space", 550),
    "frozen": ("frozen pose", 400),
    "teleport": ("teleport", 700),
}
"""Kind of finding -> name of the planted fault that makes one, and its first frame."""
STAND_INS = [(kind, action) for kind in FAULTY for action in ACTIONS_BY_KIND[kind] if action != "refuse"]
"""Every way to go on after a finding: keep or drop the poses, hold the last one, interpolate."""

FLASK, HAND = 0, 1
"""Numbers of the bodies of ``touching_session``; the third is a tray."""

FLASK_HAND, FLASK_TRAY, HAND_TRAY = 0, 1, 2
"""Columns of its pairs."""


def touching_session():
    """900 frames of a flask, a hand and a tray, in which the hand passes the flask, so that verdicts may change."""
    draft = clean_draft()
    flask_position = draft.arrays["position"][:, FLASK]
    draft.arrays["position"][:, HAND] = flask_position + 0.02 * np.sin(np.arange(900) / 9)[:, None]
    return draft


def run_of_hybrid(draft, **how):
    """The run of the detector ``hybrid`` over a session, without a reference."""
    return run(draft.session(), detectors="hybrid", oracle="none", **how)


@pytest.fixture(scope="module")
def sound_verdicts():
    """Verdicts (frames, pairs) over the session without a fault."""
    return run_of_hybrid(touching_session()).detections["hybrid"].verdict


@pytest.fixture(scope="module")
def run_with_fault():
    """Returns the run over a session in which the hand has a fault of a kind, under an action, and the planted fault.

    Each is run once for all tests.
    """

    @cache
    def faulty_run(kind, action):
        draft = touching_session()
        name, frame = FAULTY[kind]
        planted = FAULTS[name](draft, body=HAND, frame=frame)
        return run_of_hybrid(draft, policy=[f"{kind}={action_text(action)}"]), planted

    return faulty_run


def action_text(action):
    """The action with its limit in seconds, where it has one."""
    return f"{action}:2" if action in ("hold", "interpolate") else action


@pytest.mark.sampled(5)
@pytest.mark.parametrize(("kind", "action"), STAND_INS)
def test_policy_changes_verdicts_in_the_flagged_interval_only(kind, action, sound_verdicts, run_with_fault):
    """The hand has a fault: its pairs, with flask and tray, are flagged in the faulty frames, and no other pair is.

    Verdicts that are not flagged are those without the fault. Dropped poses have no verdict, all others have one.
    """
    result, planted = run_with_fault(kind, action)
    verdict, flag = result.detections["hybrid"].verdict, result.flags.of_pairs(result.assembly.pairs)
    first, last = planted.rows
    assert (flag[first : last + 1, [FLASK_HAND, HAND_TRAY]] > 0).all()
    assert (flag[:, FLASK_TRAY] == 0).all()
    if kind != "teleport":  # which moves the body for good
        assert np.array_equal(verdict[flag == 0], sound_verdicts[flag == 0])
    if action == "drop":
        assert (verdict[first : last + 1, FLASK_HAND] == Verdict.NO_POSE).all()
    else:
        assert not (verdict[:, FLASK_HAND] == Verdict.NO_POSE).any()


@pytest.mark.sampled(5)
@pytest.mark.parametrize(("kind", "action"), STAND_INS)
def test_document_reports_what_a_policy_did_to_samples(kind, action, run_with_fault):
    """A hand has a fault of this kind, and the policy this action for it.

    The document has the action, the samples that were dropped, held or interpolated, and the verdicts flagged.
    """
    result, _ = run_with_fault(kind, action)
    reported = next(item for item in result.document.flagged if item.kind == kind)
    assert (reported.body, reported.action) == ("hand-left", action_text(action))
    assert result.document.policy[kind] == action_text(action)
    counts = {"drop": reported.dropped, "hold": reported.held, "interpolate": reported.interpolated}
    assert counts == {name: reported.samples if name == action else 0 for name in counts}

    verdict, flag = result.detections["hybrid"].verdict, result.flags.of_pairs(result.assembly.pairs)
    flagged_verdicts = np.count_nonzero((flag > 0) & (verdict != Verdict.NO_POSE))
    assert sum(result.document.flagged_verdicts["hybrid"].values()) == flagged_verdicts


@pytest.mark.slow
def test_run_folder_flags_every_verdict_on_a_doubtful_pose(tmp_path, capsys):
    """The hand's pose is frozen for 60 frames, 400 to 459, and kept by the default policy, which the command says.

    In the table of frames these rows, all of the hand, are flagged; in that of contacts those of the hand that overlap
    these frames. The summary has policy, flags and findings.
    """
    draft = touching_session()
    FAULTS["frozen pose"](draft, body=HAND, frame=400)
    file = draft.write(tmp_path / "frozen.mcap")
    out = tmp_path / "run"
    command = ["run", str(file), "--out", str(out), "--detector", "hybrid", "--oracle", "none", "--no-picture"]
    assert main(command) == EXIT_OK
    assert "frozen of hand-left: 60 samples, keep" in capsys.readouterr().err

    rows = pq.read_table(out / "frames.parquet").to_pylist()
    flagged = [row for row in rows if row["flag"] is not None and "frozen" in row["flag"]]
    assert {row["frame"] for row in flagged} == set(range(400, 460))
    assert "CLEAR" in {row["verdict/hybrid"] for row in flagged}
    assert all("hand-left" in (row["body_a"], row["body_b"]) for row in flagged)

    episodes = pq.read_table(out / "episodes.parquet").to_pylist()
    assert episodes
    for row in episodes:
        overlaps = row["first"] <= 459 and row["last"] >= 400 and "hand-left" in (row["body_a"], row["body_b"])
        assert ("frozen" in (row["flag"] or "")) == overlaps

    summary = json.loads((out / "summary.json").read_text())
    assert summary["policy"]["frozen"] == "keep" and summary["flagged"] and summary["findings"]


@pytest.fixture
def run_with_nan(tmp_path, capsys):
    """Returns exit code, error output and run folder of ``replay run``, with options, where a hand has a NaN position.

    It has one in frames 400 to 402.
    """
    draft = touching_session()
    FAULTS["nan position"](draft, body=HAND, frame=400)
    file = draft.write(tmp_path / "nan.mcap")

    def run_command(*options):
        out = tmp_path / "run"
        command = ["run", str(file), "--detector", "hybrid", "--oracle", "none", "--no-picture", "--out", str(out)]
        return main([*command, *options]), capsys.readouterr().err, out

    return run_command


def test_dropped_poses_are_data_loss(run_with_nan):
    """The hand's position is NaN in frames 400 to 402, and the policy drops them: the exit code is data loss."""
    code, errors, _ = run_with_nan("--policy", "not-finite=drop")
    assert code == EXIT_DATA_LOSS
    assert "not-finite of hand-left: 3 samples, drop" in errors


def test_poses_that_are_no_numbers_are_refused_without_a_policy(run_with_nan):
    """A position is NaN from frame 400 on: the error names that, 400 / 90 Hz = 4.444444 s, and the body.

    No folder is made.
    """
    code, errors, out = run_with_nan()
    assert code == EXIT_FAILURE
    assert "frame 400 (4.444444 s), body hand-left" in errors
    assert not out.exists()


def test_unknown_action_of_a_policy_is_refused_with_those_known(run_with_nan):
    """A policy says that poses which are no numbers are to be melted; the error lists what can be done with them."""
    code, errors, _ = run_with_nan("--policy", "not-finite=melt")
    assert code == EXIT_FAILURE
    assert "it can with: refuse, drop" in errors
