import numpy as np
import pytest
from support.small_worlds import verdict_column, verdicts

from cdcore import Verdict
from replay.comparison.compare import compare
from replay.comparison.outcome import Episode, Outcome
from replay.errors import AuditError

LETTER = {
    Outcome.NEITHER: ".", Outcome.BOTH: "B", Outcome.MISSED: "M", Outcome.INVENTED: "I",
    Outcome.WITHIN_TOLERANCE: "t", Outcome.BETWEEN_FRAMES: "b", Outcome.LEFT_OUT: "-", Outcome.HELD: "h",
}  # fmt: skip


def words(subject, oracle, **more):
    return "".join(LETTER[Outcome(value)] for value in compare(subject, oracle, **more).outcome[:, 0])


def test_every_verdict_counts_as_the_glossary_says():
    for letter, counts in {".": False, "C": True, "I": True, "?": True, "n": False}.items():
        assert words(verdict_column(letter), verdict_column("C")) == ("B" if counts else "M")
        assert words(verdict_column(letter), verdict_column(".")) == ("I" if counts else ".")
    for letter in "u-":
        for other in ".CI?nu-":
            assert words(verdict_column(letter), verdict_column(other)) == "-"
            assert words(verdict_column(other), verdict_column(letter)) == "-"
    invalid = verdict_column("C")
    invalid = type(invalid)(**{**vars(invalid), "verdict": np.array([[Verdict.INVALID]], dtype=np.uint8)})
    assert words(invalid, verdict_column("C")) == "-"


@pytest.mark.parametrize(
    ("subject", "oracle", "covers", "expected"),
    [
        # What intervals find beyond instants is between frames, never invented.
        ("..CCC.", "...C..", ("intervals", "instants"), "..bBb."),
        # Against intervals a contact found at either end is found, whatever is said at its second.
        (".CC....", ".CCC.C.", ("instants", "intervals"), ".BBB.M."),
        (".Cu..", "..C..", ("instants", "intervals"), ".IB.."),
    ],
)
def test_instants_and_intervals_are_held_to_what_they_say(subject, oracle, covers, expected):
    sides = (verdict_column(letters, covers=one) for letters, one in zip((subject, oracle), covers, strict=True))
    assert words(*sides) == expected


def test_blocks_of_frames_change_no_outcome(monkeypatch):
    """A contact of intervals that begins in one block, and stretches held across the ends of others."""
    subject, oracle = verdict_column("CC.C.CCC.CC"), verdict_column(".CCCC.CCCC.", covers="intervals")
    more = {
        "within": lambda frames, _: frames == 10,
        "holdings": [Episode(0, *span, 0.0, 0.0) for span in ((3, 3), (6, 8))],
    }
    whole = words(subject, oracle, **more)
    assert whole.count("h") == 4
    monkeypatch.setattr("replay.comparison.compare.VERDICT_FRAMES", 3)
    assert words(subject, oracle, **more) == whole


def test_within_tolerance_only_disagreement_is_excused():
    subject, oracle = verdict_column("..CC"), verdict_column(".C.C")
    assert words(subject, oracle, within=lambda frames, _: frames >= 0) == ".ttB"
    assert words(subject, oracle, within=lambda frames, _: frames < 0) == ".MIB"


def test_other_frames_or_pairs_are_refused():
    with pytest.raises(AuditError, match=r"different frames \(2 and 3\)"):
        compare(verdict_column(".."), verdict_column("..."))
    with pytest.raises(AuditError, match="different frames"):
        compare(verdict_column(".."), verdict_column("..", step=0.02))
    with pytest.raises(AuditError, match="different pairs"):
        compare(verdicts(["..", ".."]), verdict_column(".."))
