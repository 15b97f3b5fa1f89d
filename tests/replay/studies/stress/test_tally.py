"""An answer is missed, invented, within tolerance, refused or unconfirmed, beside the true verdict."""

import numpy as np
import pytest

from cdcore import Verdict
from replay.studies.stress.tally import StressResult, Tally, judge_answers

CLEAR, CONTACT, CONTAINED = Verdict.CLEAR, Verdict.CONTACT, Verdict.CONTAINED
NOTHING = ""


@pytest.mark.parametrize(
    ("answer", "truth", "field"),
    [
        (CLEAR, CLEAR, NOTHING), (CLEAR, CONTACT, "missed"), (CLEAR, CONTAINED, "missed"),
        (CONTACT, CLEAR, "invented"), (CONTACT, CONTACT, NOTHING), (CONTACT, CONTAINED, "invented"),
        (CONTAINED, CLEAR, "invented"), (CONTAINED, CONTACT, "missed"), (CONTAINED, CONTAINED, NOTHING),
        (Verdict.CANDIDATE, CLEAR, "unconfirmed"), (Verdict.CANDIDATE, CONTACT, NOTHING),
        (Verdict.CANDIDATE, CONTAINED, "unconfirmed"),
        (Verdict.NOT_FOUND, CLEAR, NOTHING), (Verdict.NOT_FOUND, CONTACT, "missed"),
        (Verdict.NOT_FOUND, CONTAINED, "missed"),
    ],
)  # fmt: skip
def test_answer_is_judged_by_the_true_verdict(answer, truth, field):
    """Contact in place of containment is no miss: both are contact, and only the verdict is wrong."""
    answers, truths = np.array([answer], dtype=np.uint8), np.array([truth], dtype=np.uint8)
    decided, undecided = np.array([False]), np.array([True])
    strictly = judge_answers(answers, truths, decided, np.zeros_like)
    assert [name for name, mark in strictly.items() if mark[0]] == ([field] if field else [])
    tolerantly = judge_answers(answers, truths, decided, np.ones_like)
    excused = {"missed": "within", "invented": "within"}.get(field, field)
    assert [name for name, mark in tolerantly.items() if mark[0]] == ([excused] if excused else [])
    refused = judge_answers(answers, truths, undecided, np.zeros_like)
    assert refused["refused"][0] and not refused["missed"][0] and not refused["invented"][0]


def test_tally_names_its_counts_or_passed():
    """Missed and within tolerance fail; unconfirmed answers do not."""
    counts = {"missed": 2, "within": 1, "unconfirmed": 1200}
    tally = Tally("exact", "family", number=3, name="needles", seed=103, asked=5000, **counts)
    assert tally.failed == 3
    assert tally.words == "2 missed, 1 within tolerance, 1,200 unconfirmed"
    assert Tally("exact", "family", 3, "needles", seed=103, asked=5000).words == "passed"


@pytest.mark.parametrize(
    ("detector", "kind", "counts", "is_broken"),
    [
        ("exact", "family", {"missed": 1}, True),
        ("exact", "family", {"refused": 1}, True),
        ("exact", "family", {"unconfirmed": 1}, False),
        ("exact", "case", {"refused": 1}, False),
        ("exact", "case", {"refused": 1, "changed": 1}, True),
        ("sphere", "family", {"missed": 1}, False),
        ("exact", "family", {"missed": 1, "promised": False}, False),
    ],
)
def test_wrong_answer_of_an_exact_detector_breaks_its_promise(detector, kind, counts, is_broken):
    """A case may ask what cannot be decided, such as containment of an open mesh: there it may refuse."""
    tally = Tally(detector, kind, number=3, name="needles", seed=103, asked=50, **counts)
    broken = StressResult(seed=100, pairs=50, tau=0.0, tallies=(tally,)).as_json()["broken"]
    sentence = f"exact claims exactness and failed {tally.failed} of 50 questions of 03 needles (seed 103)"
    assert [text.partition(":")[0] for text in broken] == [sentence] * is_broken
