"""The first sentence of a comparison: better, worse, on balance, or nothing to tell."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from replay.studies.diff.answer import answer_of
from replay.studies.diff.runs import DetectorDiff


def run_with_digests(session="1", reference="1"):
    """A run of 18 contacts by exact, the reference, and hull50; digests of its recording and of the contacts of exact.

    Equal digests: two runs replay the same recording, or have the same contacts.
    """
    detectors = {"exact": SimpleNamespace(digest=reference)}
    audit = {"hull50": SimpleNamespace(contacts=18)}
    return SimpleNamespace(oracle="exact", audit=audit, detectors=detectors, session=SimpleNamespace(digest=session))


UNCHANGED = ((1, 3), (1, 3))
"""Contacts that the first run and the second got wrong: fewest and most over its sampling offsets."""
RISE, FALL = ((1, 3), (1, 4)), ((1, 3), (1, 2))
BETTER, WORSE = (0.5, 0.1), (0.1, 0.5)
"""Loss of the first run and of the second: all errors, weighed against each other."""


def diff_of_hull50(
    *,
    loss,
    false_contact=(0.2, 0.2),
    missed=UNCHANGED,
    late=UNCHANGED,
    gained=(),
    lost=(),
    seconds_a_frame=(0.001, 0.001),
):
    """Errors of hull50 in the first run and in the second: all but the loss are the same unless given.

    ``gained``, ``lost``: contacts that only the second, or only the first, run has.
    """
    ratios = {"time_ratio": 1.0, "p99_ratio": 1.0, "same_verdicts": False, "mean_seconds": seconds_a_frame}
    errors = {"missed": missed, "late": late, "false_contact": false_contact, "loss": loss}
    return DetectorDiff(("hull50", "hull50"), same=18, gained=gained, lost=lost, shifted=(), **ratios, **errors)


@pytest.mark.parametrize(
    ("loss", "errors", "verdict", "text"),
    [
        pytest.param(BETTER, {}, "Yes: ", "1-3 of 18 contacts missed in both, loss ", id="better, no error changed"),
        pytest.param(
            BETTER, {"late": RISE}, "Yes, on balance: ", "late or cut short 1-3 -> 1-4", id="better, more late"
        ),
        pytest.param(
            BETTER, {"missed": RISE}, "Yes, on balance: ", "missed 1-3 -> 1-4 of 18 contacts", id="better, more missed"
        ),
        pytest.param(
            BETTER, {"false_contact": (0.1, 0.2)}, "Yes, on balance: ", "contact 10 % -> 20 %", id="better, more false"
        ),
        pytest.param(
            BETTER,
            {"late": FALL, "missed": FALL, "false_contact": (0.2, 0.1)},
            "Yes: ",
            "late or cut short 1-3 -> 1-2",
            id="better in every error",
        ),
        pytest.param(WORSE, {}, "No, worse: ", "20 % false contact in both", id="worse, no error changed"),
        pytest.param(
            WORSE, {"late": FALL}, "No, worse, on balance: ", "late or cut short 1-3 -> 1-2", id="worse, fewer late"
        ),
        pytest.param(
            WORSE, {"missed": FALL}, "No, worse, on balance: ", "missed 1-3 -> 1-2 of 18", id="worse, fewer missed"
        ),
        pytest.param(
            WORSE, {"false_contact": (0.2, 0.1)}, "No, worse, on balance: ", "20 % -> 10 %", id="worse, less false"
        ),
        pytest.param(
            WORSE,
            {"late": RISE, "missed": RISE, "false_contact": (0.1, 0.2)},
            "No, worse: ",
            "false contact 10 % -> 20 %",
            id="worse in every error",
        ),
        pytest.param((0.1, 0.1), {}, "No difference: ", "hull50: it makes the same errors (", id="same loss"),
        pytest.param(
            (0.1, 0.1),
            {"gained": ("a contact",)},
            "No difference: ",
            "other contacts, and the same loss (",
            id="gained",
        ),
    ],
)
def test_change_of_errors_is_weighed_by_the_loss(loss, errors, verdict, text):
    """The loss, 0.5 or 0.1 here, decides; "on balance": an error, of false, missed or late, went the other way.

    Missed and late are counts, fewest and most over sampling offsets: 1-3 in the first run, then 1-4 (RISE), 1-2 (FALL)
    or the same. False contact is a fraction.
    """
    answer = answer_of(run_with_digests(), run_with_digests(), {"hull50": diff_of_hull50(loss=loss, **errors)}, {})
    assert answer.startswith(f"{verdict}hull50: ")
    assert text in answer


@pytest.mark.parametrize(
    ("seconds_a_frame", "ending"),
    [
        ((0.001, 0.001), "; the same time a frame."),
        ((0.001, 0.003), "; 2 ms more a frame."),
        ((0.003, 0.001), "; 2 ms less a frame."),
    ],
)
def test_answer_ends_in_the_cost(seconds_a_frame, ending):
    """Two runs of one recording by hull50, with its mean seconds of a frame in the first and in the second."""
    diff = diff_of_hull50(loss=BETTER, seconds_a_frame=seconds_a_frame)
    assert answer_of(run_with_digests(), run_with_digests(), {"hull50": diff}, {}).endswith(ending)


@pytest.mark.parametrize(
    ("lost", "beginning"),
    [
        ((), "No contact changed. "),
        (("a contact", "another"), "Contacts: 0 gained, 2 lost, 0 shifted. "),
    ],
    ids=["no contact changed", "two contacts lost"],
)
def test_runs_without_a_reference_are_not_ranked(lost, beginning):
    """Two runs by hull50 without a reference have no loss; contacts that only one of them has are counted."""
    diff = diff_of_hull50(loss=(None, None), lost=lost)
    answer = answer_of(run_with_digests(), run_with_digests(), {"hull50": diff}, {})
    assert answer == f"{beginning}No reference says which run is right."


@pytest.mark.parametrize(
    ("second", "settings", "reason"),
    [
        pytest.param(run_with_digests(session="2"), {}, "the runs replay different recordings", id="another recording"),
        pytest.param(
            run_with_digests(reference="2"), {}, "the contacts of the reference differ", id="other contacts of exact"
        ),
        pytest.param(
            run_with_digests(),
            {"window": (1, 2), "session.frames": (9, 8)},
            "the runs differ in session.frames and window",
            id="other frames",
        ),
        pytest.param(run_with_digests(), {"pairs.a": (1, 2)}, "the runs differ in pairs", id="other pairs of bodies"),
    ],
)
def test_runs_of_other_contacts_are_not_ranked(second, settings, reason):
    """``settings`` differ between the runs: name -> value of the first and of the second; one contact was gained."""
    detectors = {"hull50": diff_of_hull50(loss=BETTER, gained=("a contact",))}
    text = answer_of(run_with_digests(), second, detectors, settings)
    assert text.startswith("Contacts: 1 gained, 0 lost, 0 shifted. Whether that is better cannot be told: " + reason)


def test_runs_without_a_common_detector_say_so():
    """No detector of one run was compared with one of the other."""
    assert answer_of(run_with_digests(), run_with_digests(), detectors={}, settings={}) == "No detector compares."


def test_runs_with_only_a_common_reference_say_whether_contacts_changed():
    """The second run lost a contact of exact, the reference, and shares no other detector with the first."""
    reference = replace(diff_of_hull50(loss=(None, None), lost=("a contact",)), labels=("exact", "exact"))
    answer = answer_of(run_with_digests(), run_with_digests(), {"exact": reference}, {})
    assert answer == "No detector but the reference is in both runs; contacts changed."
