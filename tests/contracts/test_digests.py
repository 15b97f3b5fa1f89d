"""Every detector says today what it said when ``digests.json`` was written: verdicts, faces, counters.

A change that is meant is written down by ``python tests/support/digests.py`` and the groups or detectors it touches.
"""

import json

import pytest
from support.digests import FILE, QUICK, REAL, SLOW, VARIANTS, asked_in, digests, variant_name
from support.optional import needs_data

KNOWN = json.loads(FILE.read_text())
KINDS_OF_DIGEST = ("verdicts", "faces", "counters")
"""What the digests of a detector are of, in the order of the file."""


def differing_digests(group):
    """Detectors and settings whose digests are not those of ``digests.json``, each with the kinds that differ."""
    differing = {}
    for variant in asked_in(group):
        known, now = KNOWN[group][variant_name(*variant)].split(), digests(group, *variant).split()
        kinds = [kind for kind, before, after in zip(KINDS_OF_DIGEST, known, now, strict=True) if before != after]
        if kinds:
            differing[variant_name(*variant)] = kinds
    return differing


@pytest.mark.parametrize(
    "group", [pytest.param(group, marks=[pytest.mark.slow] if "scene" in group else []) for group in QUICK]
)
def test_verdicts_faces_and_counters_equal_the_kept_digests(group):
    """``group``: some bodies and motions; each detector has a digest of its verdicts, faces and counters of work there.

    No detector has digests that differ from ``digests.json``, where they were written down.
    """
    assert differing_digests(group) == {}


@pytest.mark.slow
@pytest.mark.parametrize("group", SLOW)
def test_digests_of_scenes_hard_cases_and_random_worlds_are_unchanged(group):
    """``group``: many bodies and motions; verdicts, faces and counters of no detector differ from ``digests.json``."""
    assert differing_digests(group) == {}


@needs_data
@pytest.mark.slow
@pytest.mark.parametrize("group", REAL)
def test_digests_of_real_recordings_are_unchanged(group):
    """``group``: real recordings; no detector has verdicts, faces or counters other than in ``digests.json``."""
    assert differing_digests(group) == {}


def test_every_row_of_the_table_has_digests():
    """VARIANTS, the detectors and settings whose digests are in the file, are of all detectors of the table."""
    from cdcore.detectors.detector_table import DETECTORS

    assert {name for name, _ in VARIANTS} == set(DETECTORS)
