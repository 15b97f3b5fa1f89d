"""How sure the figures are: the width of an interval, and whether noise was tried."""

from dataclasses import replace

import pytest
from support.report_states import audit_of, document_with, offset_ranges

from replay.auditing.wilson import proportion
from replay.document.audit import NoiseProofAudit
from replay.document.certainty import certainty
from replay.document.ranking import Rank
from replay.document.session import NoiseRecord

NOISE_PROOF = NoiseProofAudit(
    contacts=4, contacts_missed=1, time_missed=proportion(1, 4), counts_over_offsets=offset_ranges(missed=1)
)
"""Audit of a detector over the four contacts that hold in every copy of the recording with noise added."""


def ranking_of(missed, contacts):
    """Rows of a detector that missed so many of the contacts and reported no false one, and of the reference."""
    reference = Rank("exact", "", "", contacts=contacts, mean=1e-4, p99=2e-4)
    proportion_missed = proportion(missed, contacts)
    slow = replace(
        reference, label="slow", missed=proportion_missed, time_missed=proportion_missed, false=proportion(0, 9)
    )
    return [slow, reference]


@pytest.mark.parametrize(("missed", "contacts", "is_wide"), [(2, 3, True), (70, 100, False), (5, 100, False)])
def test_interval_wider_than_half_of_all_is_not_very_sure(missed, contacts, is_wide):
    """A detector missed so many of the contacts, of which Wilson's 95 % interval says how many it may miss.

    It is 21 to 94 % of 2 in 3, 60 to 78 % of 70 in 100, and 2 to 11 % of 5 in 100.
    """
    first, *_ = certainty(document_with(audit={"slow": audit_of()}), ranking_of(missed, contacts))
    assert first.startswith("Not very: with ") == is_wide


@pytest.mark.parametrize(
    ("noise", "noise_proof", "text"),
    [
        (None, None, "not tried"),
        (None, NOISE_PROOF, "not tried"),
        (NoiseRecord(2, {}), None, "not tried"),
        (NoiseRecord(2, {}), NOISE_PROOF, "4 of 9 contacts hold in 2 copies"),
    ],
    ids=["no noise", "only in the audit", "only in the run", "in run and audit"],
)
def test_contacts_that_hold_in_noise_are_stated_where_tried(noise, noise_proof, text):
    """The run made two copies of the recording with noise; of nine contacts of the reference four hold in both.

    Record of the run or audit of the detector alone says nothing.
    """
    document = document_with(audit={"slow": audit_of(noise_proof=noise_proof)}, noise=noise)
    *_, last = certainty(document, ranking_of(missed=3, contacts=9))
    assert text in last
