"""Sentences about made-up faults, in every form; ``test_fault_sentences`` asks whether they are true of whole runs."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from cdcore import Verdict
from replay.auditing.fault import Cause, Fault, FaultKind
from replay.document.fault_sentences import what_text, when_texts, why_false, why_missed

CONTACT = SimpleNamespace(first=4, last=7, start=0.04, end=0.08)
"""A contact in frames 4 to 7 of twelve frames of 10 ms."""
NEVER, LATE, EARLY = FaultKind.NEVER_REPORTED, FaultKind.REPORTED_LATE, FaultKind.LOST_EARLY


def audited(samples="............", reports="............", *, rate_hz=50.0, delay=0, reach=0.0):
    """A detector over twelve frames of 10 ms, a letter each.

    ``s``: it samples (None: nobody knows); ``C``: it reports contact; ``delay``: frames by which all its reports come
    late; ``reach``: metres from which on it reports contact.
    """
    verdict = [[Verdict.CONTACT if letter == "C" else Verdict.CLEAR] for letter in reports]
    return SimpleNamespace(
        sampled_frames=None if samples is None else np.array([letter == "s" for letter in samples]),
        rate_hz=rate_hz,
        motion=SimpleNamespace(times=0.01 * np.arange(12)),
        subject=SimpleNamespace(verdict=np.array(verdict)),
        has_pose=lambda pair: np.ones(12, dtype=bool),
        delay=lambda pair: delay,
        contact_reach=lambda pair: reach,
        detector=None,
    )


def fault(kind, first, last, cause=Cause.BETWEEN_SAMPLES, agreeing=(3, 3), metres=0.002):
    """A wrong answer about the bodies a and b in the frames ``first`` to ``last``, 10 ms each.

    ``agreeing``: of so many examined frames, (those with this cause, all); ``metres``: gap of the surfaces.
    """
    return Fault(
        number=1, detector="slow", pair=0, bodies=("a", "b"), kind=kind,
        first=first, last=last, start=0.01 * first, end=0.01 * (last + 1), frame=first,
        cause=cause, agreeing=agreeing, metres=metres, labels=("a", "b"),
    )  # fmt: skip


MISSES = {
    "shorter than the time between samples": (fault(NEVER, first=4, last=7), audited("..s......s..", rate_hz=20.0)),
    "as long as the time between samples": (fault(NEVER, first=4, last=7), audited("..s......s..", rate_hz=25.0)),
    "a part that counts as never": (fault(NEVER, first=4, last=6), audited("..s......s..")),
    "late by a step": (fault(LATE, first=4, last=5), audited("...s..s.....", "......CC....", rate_hz=50.0)),
    "late by more than a step": (fault(LATE, first=4, last=6), audited("...s...s....", ".......C....")),
    "late after a first part": (fault(LATE, first=5, last=6), audited("...s...s....", ".......C....")),
    "late and not reported next": (fault(LATE, first=4, last=5), audited("...s..s.....")),
    "early": (fault(EARLY, first=6, last=7), audited(".....s...s..", "....CC......")),
    "early before a last part": (fault(EARLY, first=5, last=6), audited("....s...s...", "....C.......")),
    "early and not reported before": (fault(EARLY, first=6, last=7), audited(".....s...s..")),
    "a sample inside": (fault(NEVER, first=4, last=7), audited("..s...s..s..")),
    "a sample in its last frame": (fault(NEVER, first=4, last=7), audited("..s....s.s..")),
    "before the first sample": (fault(NEVER, first=4, last=7), audited(".........s..")),
    "after the last sample": (fault(NEVER, first=4, last=7), audited("..ss........")),
    "no sample": (fault(NEVER, first=4, last=7), audited()),
    "by its own account": (fault(NEVER, first=4, last=7), audited(samples=None)),
    "by its own account in part": (fault(NEVER, first=4, last=7, agreeing=(2, 3)), audited(samples=None)),
    "without a rate": (fault(NEVER, first=4, last=7), audited("..s......s..", rate_hz=None)),
    "a reason": (fault(NEVER, first=4, last=7, cause=Cause.BUDGET), audited()),
    "a reason in part": (fault(NEVER, first=4, last=7, cause=Cause.BUDGET, agreeing=(2, 3)), audited()),
    "no reason": (fault(NEVER, first=4, last=7, cause=Cause.UNEXPLAINED), audited()),
    "this report late": (fault(LATE, first=4, last=5, cause=Cause.LATE), audited(reports="......CC....")),
    "this report early": (fault(EARLY, first=6, last=7, cause=Cause.EARLY), audited(reports="....CC......", delay=2)),
}
NO_CONTACT = FaultKind.NO_CONTACT
FALSE = {
    "answer of a sample": (fault(NO_CONTACT, first=4, last=7, cause=Cause.LAST_ANSWER), audited("s...s..s....")),
    "answer of no sample": (fault(NO_CONTACT, first=4, last=7, cause=Cause.LAST_ANSWER), audited(".......s....")),
    "no sample within": (fault(NO_CONTACT, first=4, last=7, cause=Cause.LAST_ANSWER), audited("...s....s...")),
    "by its own account": (fault(NO_CONTACT, first=4, last=7, cause=Cause.LAST_ANSWER), audited(samples=None)),
    "within the offset": (fault(NO_CONTACT, first=4, last=7, cause=Cause.CONTACT_OFFSET), audited(reach=0.002)),
    "beyond the offset": (fault(NO_CONTACT, first=4, last=7, cause=Cause.CONTACT_OFFSET), audited(reach=0.001)),
    "gap not measured": (fault(NO_CONTACT, first=4, last=7, cause=Cause.BOUNDING_VOLUMES, metres=np.nan), audited()),
    "report ends late": (fault(FaultKind.ENDS_LATE, first=8, last=9, cause=Cause.LATE), audited()),
    "report starts early": (fault(FaultKind.STARTS_EARLY, first=2, last=3, cause=Cause.EARLY), audited(delay=2)),
    "report is nowhere": (fault(NO_CONTACT, first=2, last=3, cause=Cause.LATE), audited(delay=-2)),
    "no reason": (fault(NO_CONTACT, first=4, last=7, cause=Cause.UNEXPLAINED), audited()),
}


def test_sentence_about_a_miss_reads_as_it_did(snapshot):
    """The cause of a miss in words, as the snapshot file has it; the contact is in frames 4 to 7 of 10 ms.

    A row of MISSES is the miss, and in which frames its detector, ``slow``, sampled and reported contact.
    """
    sentences = {name: why_missed(miss, "slow", detector, CONTACT) for name, (miss, detector) in MISSES.items()}
    assert sentences == snapshot


def test_sentence_about_a_false_contact_reads_as_it_did(snapshot):
    """The cause of a false contact in words, as the snapshot file has it; the surfaces are 2 mm apart.

    A row of FALSE is the false contact, and in which frames its detector, ``slow``, sampled and reported contact.
    """
    sentences = {name: why_false(contact, "slow", detector) for name, (contact, detector) in FALSE.items()}
    assert sentences == snapshot


WHEN = {
    "the only fault": ([fault(NEVER, 4, 7)], 9.9),
    "two misses of a short session": ([fault(NEVER, 4, 7), fault(LATE, 14, 15)], 9.9),
    "two misses of a long session": ([fault(NEVER, 4, 7), fault(LATE, 514, 515)], 10.0),
    "two false contacts in one tenth of a second": ([fault(NO_CONTACT, 1, 2), fault(NO_CONTACT, 3, 3)], 10.0),
    "another pair": ([fault(NEVER, 4, 7), replace(fault(NEVER, 4, 7), bodies=("a", "c"))], 9.9),
}


@pytest.mark.parametrize(("faults", "session_seconds"), WHEN.values(), ids=WHEN)
def test_sentences_about_error_and_moment_read_as_they_did(faults, session_seconds, snapshot):
    """The snapshot file has what went wrong, when, and when else, in words; a row of WHEN is all faults.

    They are misses, or false contacts, of the detector ``slow`` in a session of so many seconds; the moment, 0.04 s, is
    that of the first.
    """
    first = faults[0]
    misses, false_contacts = ({"slow": faults}, {}) if first.kind.is_miss else ({}, {"slow": faults})
    result = SimpleNamespace(misses=misses, false=false_contacts)
    document = SimpleNamespace(session=SimpleNamespace(duration=session_seconds))
    when, other_times = when_texts(result, document, SimpleNamespace(label="slow"), first, 0.04)
    assert (what_text(first), when, other_times) == snapshot
