from types import SimpleNamespace

import numpy as np
import pytest
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
    MISS_KINDS,
    NEVER_FOUND,
    by_depth,
    misses,
    stretches,
)
from replay.comparison.outcome import Outcome


@pytest.mark.parametrize(
    ("subject", "expected"),
    [
        ("......", [(1, 4, NEVER_FOUND, 1)]), ("..CCC.", [(1, 1, FOUND_LATE, 1)]), (".CC...", [(3, 4, LOST_EARLY, 1)]),
        (".C..C.", [(2, 3, INTERRUPTED, 1)]), ("..C...", [(1, 1, FOUND_LATE, 1), (3, 4, LOST_EARLY, 1)]),
        # Frames left out part a miss and change no kind.
        ("..-...", [(1, 1, NEVER_FOUND, 1), (3, 4, NEVER_FOUND, 1)]),
        ("..-.C.", [(1, 1, FOUND_LATE, 1), (3, 3, FOUND_LATE, 1)]),
    ],
)  # fmt: skip
def test_kinds_say_where_in_the_contact_the_miss_lies(subject, expected):
    subject, oracle = verdict_column(subject), verdict_column(".CCCC.")
    found = stretches(compare(subject, oracle), episodes(oracle))
    assert [(one.first, one.last, one.kind, one.episode) for one in found] == expected


@given(st.lists(st.tuples(st.sampled_from(".C"), st.sampled_from(".C-")), min_size=1, max_size=40))
def test_stretches_are_exactly_the_missed_frames(letters):
    oracle, subject = (verdict_column([pair[k] for pair in letters]) for k in (0, 1))
    comparison = compare(subject, oracle)
    got = stretches(comparison, episodes(oracle))
    covered = np.zeros(len(letters), dtype=bool)
    for stretch in got:
        covered[stretch.first : stretch.last + 1] = True
        assert stretch.kind in MISS_KINDS
    assert np.array_equal(covered, comparison.outcome[:, 0] == Outcome.MISSED)


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
