import re
from types import SimpleNamespace

from hypothesis import given
from hypothesis import strategies as st
from support.small_worlds import verdict_column, verdicts

from replay.comparison.compare import compare
from replay.comparison.episodes import episodes
from replay.comparison.evidence import Cut
from replay.comparison.misses import (
    FOUND_LATE,
    INTERRUPTED,
    LOST_EARLY,
    NEVER_FOUND,
    by_depth,
    misses,
    stretches,
)

KINDS = {(False, False): NEVER_FOUND, (False, True): FOUND_LATE, (True, False): LOST_EARLY, (True, True): INTERRUPTED}
"""Whether the contact is found before a miss, and after it."""


@given(st.lists(st.tuples(st.sampled_from(".CCC"), st.sampled_from(".C-")), min_size=1, max_size=40))
def test_stretches_are_the_missed_frames_and_their_kinds_say_where_in_the_contact_they_lie(letters):
    """Frames left out part a miss and change no kind."""
    truth, said = map("".join, zip(*letters, strict=True))
    expected = []
    for number, contact in enumerate(re.finditer("C+", truth), 1):
        start, inside = contact.start(), said[contact.start() : contact.end()]
        for gap in re.finditer(r"\.+", inside):
            kind = KINDS["C" in inside[: gap.start()], "C" in inside[gap.end() :]]
            expected.append((start + gap.start(), start + gap.end() - 1, kind, number))
    oracle, subject = verdict_column(truth), verdict_column(said)
    found = stretches(compare(subject, oracle), episodes(oracle))
    assert [(one.first, one.last, one.kind, one.episode) for one in found] == expected


def test_misses_are_numbered_in_order_and_carry_time_names_and_geometry():
    oracle, subject = verdicts(["C.", "CC", ".C"]), verdicts(["..", "..", ".C"])
    places = stretches(compare(subject, oracle), episodes(oracle))
    cuts = {
        (one.pair, one.first, one.last): Cut(one.last, (1.0, 2.0, 3.0), (0.0, 1.0, 0.0), 7, 0.25 * one.pair)
        for one in places
    }
    first, second = misses(places, [("rod", "glass"), ("rod", "jar")], oracle.times, cuts)
    assert (first.number, first.body_a, first.body_b, first.start, first.end) == (1, "rod", "glass", 0.0, 0.02)
    assert (second.number, second.pair, second.kind, second.episode) == (2, 1, FOUND_LATE, 2)
    assert (second.deepest, second.point, second.face_pairs, second.cut_length) == (1, (1.0, 2.0, 3.0), 7, 0.25)


def test_a_miss_that_no_frame_shows_comes_after_those_with_a_cut():
    lengths = [SimpleNamespace(number=number, cut_length=cut) for number, cut in ((1, 0.0), (2, 0.01), (3, 0.0))]
    assert [miss.number for miss in by_depth(lengths)] == [2, 1, 3]
