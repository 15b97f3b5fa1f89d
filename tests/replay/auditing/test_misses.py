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
"""The kind of a miss by whether the same contact is reported before it, and after it."""


@given(st.lists(st.tuples(st.sampled_from(".CCC"), st.sampled_from(".C-")), min_size=1, max_size=40))
def test_misses_are_the_missed_frames_of_each_contact(contact_letters):
    """A letter a frame, of the reference and the detector: C contact, . clear, - no pose.

    Each segment of clear frames within a true contact is a miss; frames without a pose part a miss in two and change
    no kind (KINDS).
    """
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
    """Two pairs of bodies; each text is a frame of 10 ms, a letter a pair: C contact.

    Rod and glass touch in frames 0 and 1, rod and jar in 1 and 2; the detector reports the jar alone, a frame late.
    """
    oracle, subject = verdicts(["C.", "CC", ".C"]), verdicts(["..", "..", ".C"])
    names = [("rod", "glass"), ("rod", "jar")]
    glass, jar = missed_faults(compare(subject, oracle), episodes(oracle), names, oracle.times)
    assert (glass.number, glass.pair, glass.bodies, glass.contact) == (1, 0, ("rod", "glass"), 1)
    assert (glass.start, glass.end, glass.kind) == (0.0, 0.02, FaultKind.NEVER_REPORTED)
    assert (jar.number, jar.pair, jar.bodies, jar.contact) == (2, 1, ("rod", "jar"), 2)
    assert (jar.start, jar.end, jar.kind) == (0.01, 0.02, FaultKind.REPORTED_LATE)
    assert glass.kind.category is jar.kind.category is FaultCategory.MISS


def test_a_miss_that_no_frame_shows_comes_last():
    """Three contacts of a frame each are missed; only in the second do surfaces cross, in a curve of 0.01 m.

    The other two have nothing to show: they come after it, in order of time.
    """
    oracle, subject = verdict_column("C.C.C"), verdict_column(".....")
    misses = missed_faults(compare(subject, oracle), episodes(oracle), [("a", "b")], oracle.times)
    curve_lengths = [0.0, 0.01, 0.0]
    measured = [replace(miss, metres=metres) for miss, metres in zip(misses, curve_lengths, strict=True)]
    assert [miss.number for miss in worst_first(measured)] == [2, 1, 3]
