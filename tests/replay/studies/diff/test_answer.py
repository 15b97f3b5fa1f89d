"""The first sentence of a comparison: better, worse, on balance, or nothing to tell."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from replay.studies.diff.answer import answer_of
from replay.studies.diff.runs import DetectorDiff


def run_with_digests(session="1", reference="1"):
    """A run of a session, with a reference that gives these contacts."""
    detectors = {"exact": SimpleNamespace(digest=reference)}
    audit = {"hull50": SimpleNamespace(contacts=18)}
    return SimpleNamespace(oracle="exact", audit=audit, detectors=detectors, session=SimpleNamespace(digest=session))


def hull_detector_diff(
    *, false=(0.5, 0.5), missed=((1, 1), (1, 1)), late=((2, 2), (2, 2)), loss=(1.0, 1.0), gained=(), lost=()
):
    """A detector whose errors in the first and the second run are these."""
    ratios = {"time_ratio": 1.0, "p99_ratio": 1.0, "same_verdicts": False, "mean_seconds": (1e-5, 1e-5)}
    errors = {"missed": missed, "late": late, "false_contact": false, "loss": loss}
    return DetectorDiff(("hull50", "hull50"), 18, gained, lost, (), **ratios, **errors)


@pytest.mark.parametrize(
    ("change", "beginning"),
    [
        ({"false": (0.5, 0.2), "loss": (1.0, 0.7)}, "Yes: hull50: false contact 50 % -> 20 %"),
        ({"false": (0.2, 0.5), "loss": (0.7, 1.0)}, "No, worse: hull50: "),
        ({"false": (0.2, 0.3), "missed": ((5, 5), (1, 1)), "loss": (1.0, 0.7)}, "Yes, on balance: hull50: "),
        ({"false": (0.5, 0.2), "missed": ((1, 1), (3, 4)), "loss": (1.0, 0.9)}, "Yes, on balance: hull50: "),
        ({"false": (0.5, 0.2), "late": ((1, 1), (3, 4)), "loss": (1.0, 0.9)}, "Yes, on balance: hull50: "),
        ({"false": (0.3, 0.2), "missed": ((1, 1), (3, 4)), "loss": (0.9, 1.0)}, "No, worse, on balance: hull50: "),
        ({"false": (0.2, 0.3), "late": ((3, 4), (1, 1)), "loss": (0.9, 1.0)}, "No, worse, on balance: hull50: "),
        ({}, "No difference: hull50: it makes the same errors ("),
        ({"gained": (object(),)}, "No difference: hull50: other contacts, and the same loss ("),
        ({"loss": (None, None)}, "No contact changed. No reference says which run is right."),
        ({"loss": (None, None), "lost": (1, 2)}, "Contacts: 0 gained, 2 lost, 0 shifted. No reference says"),
    ],
)
def test_change_of_errors_is_weighed_by_the_loss(change, beginning):
    """Errors before and after; ``missed``, ``late``: (least, most) of 18 contacts in each run."""
    assert answer_of(run_with_digests(), run_with_digests(), {"hull50": hull_detector_diff(**change)}, {}).startswith(
        beginning
    )


@pytest.mark.parametrize(
    ("second", "settings", "reason"),
    [
        (run_with_digests(session="2"), {}, "the runs replay different recordings"),
        (run_with_digests(reference="2"), {}, "the contacts of the reference differ"),
        (
            run_with_digests(),
            {"window": (1, 2), "session.frames": (9, 8)},
            "the runs differ in session.frames and window",
        ),
        (run_with_digests(), {"pairs.a": (1, 2)}, "the runs differ in pairs"),
    ],
)
def test_runs_of_other_contacts_are_not_ranked(second, settings, reason):
    """``second``: the second run; ``settings``: those that differ, with both values."""
    text = answer_of(run_with_digests(), second, {"hull50": hull_detector_diff(gained=(1,))}, settings)
    assert text.startswith("Contacts: 1 gained, 0 lost, 0 shifted. Whether that is better cannot be told: " + reason)


def test_runs_without_a_common_detector_say_so():
    """Two runs share no detector, or the reference alone, which lost a contact."""
    reference = replace(hull_detector_diff(lost=(1,)), labels=("exact", "exact"))
    assert answer_of(run_with_digests(), run_with_digests(), {}, {}) == "No detector compares."
    expected = "No detector but the reference is in both runs; contacts changed."
    assert answer_of(run_with_digests(), run_with_digests(), {"exact": reference}, {}) == expected
