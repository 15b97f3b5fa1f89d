import tomllib
from pathlib import Path

import numpy as np
import pytest
from support.small_worlds import verdict_column, verdicts

from replay.auditing.compare import compare
from replay.auditing.outcome import Episode, Outcome
from replay.errors import AuditError

LETTER = {
    Outcome.NEITHER: ".", Outcome.BOTH: "B", Outcome.MISSED: "M", Outcome.FALSE_CONTACT: "I",
    Outcome.WITHIN_TOLERANCE: "t", Outcome.BETWEEN_FRAMES: "b", Outcome.LEFT_OUT: "-", Outcome.GRASPED: "h",
}  # fmt: skip
"""Outcomes as letters: both report contact, the detector missed it, it invented one, a hand holds the body, ..."""


ROWS = tomllib.loads(Path(__file__).with_name("letters.toml").read_text("utf-8"))["outcome"]


def outcome_letters(subject, oracle, **more):
    """Outcomes of the first pair, a letter of LETTER a frame."""
    return "".join(LETTER[Outcome(value)] for value in compare(subject, oracle, **more).outcome[:, 0])


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row["why"])
def test_coded_frames_have_their_outcomes(row):
    """A row of letters.toml: what detector (subject) and reference (oracle) say, a letter a frame, and the outcomes.

    They say C contact, I inside, ? candidate, n not found, u undecided, - no pose. Outcomes: B both, M missed, I false,
    t within tolerance (frames ``within``), b between frames, - not counted. ``covers``: whether each side speaks of
    instants or of the intervals that end at its frames.
    """
    kinds = row.get("covers", ["instants"] * 2)
    sides = [verdict_column(row[name], covers=kind) for name, kind in zip(("subject", "oracle"), kinds, strict=True)]
    frames_within_tolerance = row.get("within", [])
    outcomes = outcome_letters(*sides, within=lambda frames, _: np.isin(frames, frames_within_tolerance))
    assert outcomes == row["outcome"]


def test_blocks_of_frames_change_no_outcome(monkeypatch):
    """11 frames are compared at once, then in blocks of three, with the same outcomes.

    The contact of intervals from frame 1 on goes across the ends of blocks, as do the frames 3 and 6 to 8 in which a
    hand holds the body; frame 5 is within tolerance.
    """
    subject, oracle = verdict_column("CC.C.CCCC.."), verdict_column(".CCCC.CCCC.", covers="intervals")
    grasps = [Episode(pair=0, first=first, last=last, start=0.0, end=0.0) for first, last in ((3, 3), (6, 8))]
    more = {"within": lambda frames, _: frames == 5, "holdings": grasps}
    at_once = outcome_letters(subject, oracle, **more)
    assert at_once == "IBBhBthhhB."
    monkeypatch.setattr("replay.auditing.compare.VERDICT_FRAMES", 3)
    assert outcome_letters(subject, oracle, **more) == at_once


TWO_FRAMES = verdict_column("..")
"""A detection of one pair in two frames, 10 ms apart."""


@pytest.mark.parametrize(
    ("other", "message"),
    [
        pytest.param(verdict_column("..."), r"different frames \(2 and 3\)", id="three frames"),
        pytest.param(verdict_column("..", step=0.02), "different frames", id="frames 20 ms apart"),
        pytest.param(verdicts(["..", ".."]), "different pairs", id="two pairs"),
    ],
)
def test_other_frames_or_pairs_are_refused(other, message):
    """A reference of other frames or pairs than the detector's."""
    with pytest.raises(AuditError, match=message):
        compare(TWO_FRAMES, other)
