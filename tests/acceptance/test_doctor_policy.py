"""No verdict changes in silence: under every policy a run differs only in flagged spans, and its summary says how."""

import json

import numpy as np
import pyarrow.parquet as pq
import pytest
from support.planted_faults import FAULTS, clean_draft

from cdcore import Verdict
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
STAND_INS = [(kind, action) for kind in FAULTY for action in ACTIONS_BY_KIND[kind] if action != "refuse"]


def touching_session():
    """A session in which the hand passes the flask's place, so that verdicts have something to lose."""
    draft = clean_draft()
    draft.arrays["position"][:, 1] = draft.arrays["position"][:, 0] + 0.02 * np.sin(np.arange(900) / 9)[:, None]
    return draft


def verdicts(draft, **how):
    """A run of ``hybrid`` over a draft, without a reference."""
    return run(draft.session(), detectors="hybrid", oracle="none", **how)


@pytest.fixture(scope="module")
def sound():
    """Verdicts over the session without a fault."""
    return verdicts(touching_session()).detections["hybrid"].verdict


@pytest.mark.sampled(5)
@pytest.mark.parametrize(("kind", "action"), STAND_INS)
def test_policy_changes_verdicts_in_the_flagged_interval_only(kind, action, sound):
    """A fault of hand-left, body 1, which is in the pairs 0 and 2; dropped poses have no verdict, others have one.

    The document says what was done to how many samples, and how many verdicts are flagged.
    """
    draft = touching_session()
    name, at = FAULTY[kind]
    planted = FAULTS[name](draft, body=1, frame=at)
    text = f"{action}:2" if action in ("hold", "interpolate") else action
    result = verdicts(draft, policy=[f"{kind}={text}"])
    verdict, flag = result.detections["hybrid"].verdict, result.flags.of_pairs(result.assembly.pairs)
    first, last = planted.rows
    assert (flag[first : last + 1, [0, 2]] > 0).all() and (flag[:, 1] == 0).all()
    if kind != "teleport":  # which moves the body for good
        assert np.array_equal(verdict[flag == 0], sound[flag == 0])
    if action == "drop":
        assert (verdict[first : last + 1, 0] == Verdict.NO_POSE).all()
    else:
        assert not (verdict[:, 0] == Verdict.NO_POSE).any()
    reported = next(item for item in result.document.flagged if item.kind == kind)
    assert (reported.body, reported.action, result.document.policy[kind]) == ("hand-left", text, text)
    done = {"drop": "dropped", "hold": "held", "interpolate": "interpolated"}.get(action)
    counts = {key: getattr(reported, key) for key in ("dropped", "held", "interpolated")}
    assert counts == {key: reported.samples if key == done else 0 for key in counts}
    stated = sum(result.document.flagged_verdicts["hybrid"].values())
    assert stated == int(((flag > 0) & (verdict != Verdict.NO_POSE)).sum())


@pytest.mark.slow
def test_run_folder_flags_every_verdict_on_a_doubtful_pose(tmp_path, capsys):
    """The hand's pose is frozen for 60 frames from 400 on, and kept by the policy."""
    draft = touching_session()
    FAULTS["frozen pose"](draft, body=1, frame=400)
    file = draft.write(tmp_path / "frozen.mcap")
    out = tmp_path / "run"
    assert main(["run", str(file), "--out", str(out), "--detector", "hybrid", "--oracle", "none", "--no-picture"]) == 0
    output = capsys.readouterr().err
    assert "frozen of hand-left: 60 samples, keep" in output
    rows = pq.read_table(out / "frames.parquet").to_pylist()
    doubt = [row for row in rows if row["flag"] is not None and "frozen" in row["flag"]]
    assert {row["frame"] for row in doubt} == set(range(400, 460))
    assert {row["verdict/hybrid"] for row in doubt} >= {"CLEAR"}
    assert all("hand-left" in (row["body_a"], row["body_b"]) for row in doubt)
    episodes = pq.read_table(out / "episodes.parquet").to_pylist()
    for row in episodes:
        touched = row["first"] <= 459 and row["last"] >= 400 and "hand-left" in (row["body_a"], row["body_b"])
        assert ("frozen" in (row["flag"] or "")) == touched
    summary = json.loads((out / "summary.json").read_text())
    assert summary["policy"]["frozen"] == "keep" and summary["flagged"] and summary["findings"]


def test_dropped_poses_are_data_loss_and_refusals_are_sentences(tmp_path, capsys):
    """The exit code is 3, data loss, where NaN is dropped; 1 without a policy for it, or with an unknown action."""
    draft = touching_session()
    FAULTS["nan position"](draft, body=1, frame=400)
    file = draft.write(tmp_path / "nan.mcap")
    usual = ["run", str(file), "--detector", "hybrid", "--oracle", "none", "--no-picture", "--out"]
    assert main([*usual, str(tmp_path / "a"), "--policy", "not-finite=drop"]) == 3
    assert "not-finite of hand-left: 3 samples, drop" in capsys.readouterr().err
    assert main([*usual, str(tmp_path / "b")]) == 1
    assert "frame 400 (4.444444 s), body hand-left" in capsys.readouterr().err
    assert not (tmp_path / "b").exists()
    assert main([*usual, str(tmp_path / "c"), "--policy", "not-finite=melt"]) == 1
    assert "it can with: refuse, drop" in capsys.readouterr().err
