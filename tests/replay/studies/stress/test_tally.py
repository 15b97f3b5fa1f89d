"""An answer is missed, invented, within tolerance, refused or unconfirmed, beside the true verdict."""

import numpy as np
import pytest

from cdcore import Verdict
from replay.studies.stress.tally import StressResult, Tally, judge_answers

CLEAR, CONTACT, CONTAINED = Verdict.CLEAR, Verdict.CONTACT, Verdict.CONTAINED
CANDIDATE, NOT_FOUND = Verdict.CANDIDATE, Verdict.NOT_FOUND
"""Bounding volumes meet, of surfaces nothing is known; a search has found nothing."""


def judged(answer, truth, *, is_undecided=False, is_excused=False):
    """Names of the counts of a tally under which one answer falls; ``is_excused``: it is wrong by less than tau."""
    answers, truths = np.array([answer], dtype=np.uint8), np.array([truth], dtype=np.uint8)
    counts = judge_answers(answers, truths, np.array([is_undecided]), np.ones_like if is_excused else np.zeros_like)
    return [name for name, marks in counts.items() if marks[0]]


ANSWERS = [
    (CLEAR, CLEAR, "right"), (CLEAR, CONTACT, "missed"), (CLEAR, CONTAINED, "missed"),
    (CONTACT, CLEAR, "invented"), (CONTACT, CONTACT, "right"), (CONTACT, CONTAINED, "invented"),
    (CONTAINED, CLEAR, "invented"), (CONTAINED, CONTACT, "missed"), (CONTAINED, CONTAINED, "right"),
    (CANDIDATE, CLEAR, "unconfirmed"), (CANDIDATE, CONTACT, "right"), (CANDIDATE, CONTAINED, "unconfirmed"),
    (NOT_FOUND, CLEAR, "right"), (NOT_FOUND, CONTACT, "missed"), (NOT_FOUND, CONTAINED, "missed"),
]  # fmt: skip
"""Answer of a detector, true verdict, and the count that the answer adds to; "right" adds to none."""


def test_answer_is_judged_by_the_true_verdict():
    """A row of ANSWERS is the detector's answer, the truth, and the count of the tally that it falls under, if wrong.

    ``invented``: false. Contact in place of containment is no miss but invented: a contact, with the wrong verdict.
    """
    for answer, truth, count in ANSWERS:
        assert judged(answer, truth) == ([] if count == "right" else [count]), (answer, truth)


def test_wrong_answer_within_tolerance_is_counted_apart():
    """A depth or gap below tau excuses a missed or invented contact, which is ``within``; unconfirmed ones stay so."""
    expected = {"right": [], "unconfirmed": ["unconfirmed"], "missed": ["within"], "invented": ["within"]}
    for answer, truth, count in ANSWERS:
        assert judged(answer, truth, is_excused=True) == expected[count], (answer, truth)


def test_undecided_answer_is_refused_and_never_wrong():
    """A detector did not decide: whatever verdict it gave beside, the answer is refused, and may be unconfirmed too."""
    for answer, truth, _ in ANSWERS:
        counts = judged(answer, truth, is_undecided=True)
        assert set(counts) - {"unconfirmed"} == {"refused"}, (answer, truth)


def test_tally_names_its_counts_or_passed():
    """Two missed and one within tolerance are three failures; unconfirmed answers are none."""
    of_family = {"detector": "exact", "kind": "family", "number": 3, "name": "needles", "seed": 103, "asked": 5000}
    tally = Tally(**of_family, missed=2, within=1, unconfirmed=1200)
    assert tally.failed == 2 + 1
    assert tally.words == "2 missed, 1 within tolerance, 1,200 unconfirmed"
    assert Tally(**of_family).words == "passed"


@pytest.mark.parametrize(
    ("detector", "kind", "counts", "is_broken"),
    [
        pytest.param("exact", "family", {"missed": 1}, True, id="missed"),
        pytest.param("exact", "family", {"refused": 1}, True, id="pair of triangles refused"),
        pytest.param("exact", "family", {"unconfirmed": 1}, False, id="unconfirmed"),
        pytest.param("exact", "case", {"refused": 1}, False, id="case of bodies refused"),
        pytest.param("exact", "case", {"refused": 1, "changed": 1}, True, id="case answered otherwise when repeated"),
        pytest.param("sphere", "family", {"missed": 1}, False, id="detector that is not exact"),
        pytest.param("exact", "family", {"missed": 1, "promised": False}, False, id="what was not promised"),
    ],
)
def test_wrong_answer_of_an_exact_detector_breaks_its_promise(detector, kind, counts, is_broken):
    """A case may ask what cannot be decided, such as containment of an open mesh: there it may refuse."""
    tally = Tally(detector, kind, number=3, name="needles", seed=103, asked=50, **counts)
    broken = StressResult(seed=100, pairs=50, tau=0.0, tallies=(tally,)).as_json()["broken"]
    sentence = f"exact claims exactness and failed {tally.failed} of 50 questions of 03 needles (seed 103)"
    assert [text.partition(":")[0] for text in broken] == ([sentence] if is_broken else [])
