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


ROWS = tomllib.loads(Path(__file__).with_name("letters.toml").read_text("utf-8"))["outcome"]


def outcome_letters(subject, oracle, **more):
    """Outcomes of the first pair, a letter a frame."""
    return "".join(LETTER[Outcome(value)] for value in compare(subject, oracle, **more).outcome[:, 0])


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row["why"])
def test_coded_frames_have_their_outcomes(row):
    """A row of letters.toml: verdicts of subject and oracle and their outcomes (LETTER), a letter a frame."""
    kinds = row.get("covers", ["instants"] * 2)
    sides = [verdict_column(row[name], covers=kind) for name, kind in zip(("subject", "oracle"), kinds, strict=True)]
    assert outcome_letters(*sides, within=lambda frames, _: np.isin(frames, row.get("within", []))) == row["outcome"]


def test_blocks_of_frames_change_no_outcome(monkeypatch):
    """A contact of intervals that begins in one block, and stretches held across the ends of others."""
    subject, oracle = verdict_column("CC.C.CCCC.."), verdict_column(".CCCC.CCCC.", covers="intervals")
    more = {
        "within": lambda frames, _: frames == 5,
        "holdings": [Episode(0, *span, 0.0, 0.0) for span in ((3, 3), (6, 8))],
    }
    whole = outcome_letters(subject, oracle, **more)
    assert whole == "IBBhBthhhB."
    monkeypatch.setattr("replay.auditing.compare.VERDICT_FRAMES", 3)
    assert outcome_letters(subject, oracle, **more) == whole


def test_other_frames_or_pairs_are_refused():
    """Two frames beside three, frames 10 and 20 ms apart, and two pairs beside one."""
    with pytest.raises(AuditError, match=r"different frames \(2 and 3\)"):
        compare(verdict_column(".."), verdict_column("..."))
    with pytest.raises(AuditError, match="different frames"):
        compare(verdict_column(".."), verdict_column("..", step=0.02))
    with pytest.raises(AuditError, match="different pairs"):
        compare(verdicts(["..", ".."]), verdict_column(".."))
