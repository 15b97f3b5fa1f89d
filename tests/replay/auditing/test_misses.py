import re
from dataclasses import replace

from hypothesis import given
from hypothesis import strategies as st
from support.small_worlds import verdict_column, verdicts

from replay.auditing.compare import compare
from replay.auditing.episodes import episodes
from replay.auditing.fault import FaultCategory, FaultKind, worst_first
from replay.auditing.misses import missed_faults

KINDS = {
    (False, False): FaultKind.NEVER_REPORTED,
    (False, True): FaultKind.REPORTED_LATE,
    (True, False): FaultKind.LOST_EARLY,
    (True, True): FaultKind.INTERRUPTED,
}
"""Whether the contact is found before a miss, and after it."""


@given(st.lists(st.tuples(st.sampled_from(".CCC"), st.sampled_from(".C-")), min_size=1, max_size=40))
def test_misses_are_the_missed_frames_of_each_contact(contact_letters):
    """Frames left out part a miss and change no kind."""
    truth, reported = map("".join, zip(*contact_letters, strict=True))
    expected = []
    for number, contact in enumerate(re.finditer("C+", truth), 1):
        start, inside = contact.start(), reported[contact.start() : contact.end()]
        for gap in re.finditer(r"\.+", inside):
            kind = KINDS["C" in inside[: gap.start()], "C" in inside[gap.end() :]]
            expected.append((start + gap.start(), start + gap.end() - 1, kind, number))
    oracle, subject = verdict_column(truth), verdict_column(reported)
    misses = missed_faults(compare(subject, oracle), episodes(oracle), [("a", "b")], oracle.times)
    assert [(miss.first, miss.last, miss.kind, miss.contact) for miss in misses] == expected


def test_misses_are_numbered_by_time_and_name_their_bodies():
    """Each text is a frame of two pairs, C contact.

    The first pair touches in frames 0 and 1, the second in 1 and 2; the detector reports the second, a frame late.
    """
    oracle, subject = verdicts(["C.", "CC", ".C"]), verdicts(["..", "..", ".C"])
    names = [("rod", "glass"), ("rod", "jar")]
    first, second = missed_faults(compare(subject, oracle), episodes(oracle), names, oracle.times)
    assert (first.number, first.bodies, first.start, first.end) == (1, ("rod", "glass"), 0.0, 0.02)
    assert (second.number, second.pair, second.kind, second.contact) == (2, 1, FaultKind.REPORTED_LATE, 2)
    assert first.kind.category is second.kind.category is FaultCategory.MISS


def test_a_miss_that_no_frame_shows_comes_last():
    """``lengths``: metres of the curve in which the surfaces meet; where they only touch there is none to see."""
    oracle, subject = verdict_column("C.C.C"), verdict_column(".....")
    misses = missed_faults(compare(subject, oracle), episodes(oracle), [("a", "b")], oracle.times)
    lengths = [0.0, 0.01, 0.0]
    measured = [replace(miss, metres=metres) for miss, metres in zip(misses, lengths, strict=True)]
    assert [miss.number for miss in worst_first(measured)] == [2, 1, 3]
