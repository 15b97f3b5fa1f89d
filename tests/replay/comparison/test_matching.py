import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linear_sum_assignment
from support.small_worlds import verdict_column

from replay.comparison.compare import compare
from replay.comparison.contact_counts import count_contacts
from replay.comparison.episodes import episodes
from replay.comparison.matching import match_episodes


def matched(subject, oracle, within=None, reach=0):
    comparison, truth = compare(subject, oracle, within=within), episodes(oracle)
    return match_episodes(comparison, truth, episodes(subject), count_contacts(comparison, truth), reach)


def columns(subject, oracle, **more):
    return matched(verdict_column(subject), verdict_column(oracle), **more)


def test_late_and_short_is_an_onset_and_a_duration_error():
    (one,) = columns("...CC...", ".CCCCC..").matched
    assert (one.truth, one.found, one.overlap) == (1, 1, 2)
    assert np.allclose([one.onset_error, one.duration_error], [0.02, -0.03])


def test_a_split_contact_is_matched_with_its_longest_piece():
    found = columns(".C.CCC.C.", ".CCCCCCC.")
    assert [(m.truth, m.found, m.overlap) for m in found.matched] == [(1, 2, 3)]
    assert (found.split, found.pieces, found.missed, found.invented) == ((1,), (1, 3), (), ())
    assert found.status() == {1: "piece", 2: "matched", 3: "piece"}


def test_a_merged_contact_stands_for_the_longest_one_and_absorbs_the_others():
    found = columns(".CCCCCCC.", ".C.CCC.C.")
    assert [(m.truth, m.found) for m in found.matched] == [(2, 1)]
    assert (found.merged, found.absorbed, found.missed) == ((1,), (1, 3), ())


def test_missed_and_invented_stand_alone_and_excused_ones_are_nobodys_fault():
    found = columns(".C....C--.", ".....CC.C.")
    assert (found.missed, found.invented, found.excused_truth) == ((), (1,), (2,))
    near = columns(".C..", "...C", within=lambda frames, _: frames >= 0)
    assert (near.missed, near.invented, near.excused_truth, near.excused_found) == ((), (), (1,), (1,))
    finer = matched(verdict_column(".C..", covers="intervals"), verdict_column("...."))
    assert (finer.invented, finer.excused_found) == ((), (1,))


def test_an_instant_reaches_into_the_interval_after_it():
    subject, oracle = verdict_column(".C..."), verdict_column("..C..", covers="intervals")
    assert matched(subject, oracle).matched == () and matched(subject, oracle).missed == ()
    assert len(matched(subject, oracle, reach=1).matched) == 1


letters = st.lists(st.sampled_from(".CC"), min_size=1, max_size=60)


@given(letters, letters)
def test_the_total_overlap_is_that_of_the_hungarian_method(left, right):
    size = min(len(left), len(right))
    subject, oracle = verdict_column(left[:size]), verdict_column(right[:size])
    truth, found = episodes(oracle), episodes(subject)
    weight = np.array(
        [[max(0, min(a.last, b.last) - max(a.first, b.first) + 1) for b in found] for a in truth]
    ).reshape(len(truth), len(found))
    rows, partners = linear_sum_assignment(weight, maximize=True)
    got = matched(subject, oracle)
    assert sum(m.overlap for m in got.matched) == weight[rows, partners].sum()
    assert len({m.truth for m in got.matched}) == len({m.found for m in got.matched}) == len(got.matched)
    assert len(got.matched) + len(got.missed) + len(got.absorbed) + len(got.excused_truth) == len(truth)
    assert len(got.matched) + len(got.invented) + len(got.pieces) + len(got.excused_found) == len(found)


def test_a_report_is_invented_where_only_a_part_of_it_is_within_tolerance():
    for excused, invented in (([1], (1,)), ([1, 2, 3], ())):
        matches = columns(".CCC.", ".....", within=lambda frames, _, some=excused: np.isin(frames, some))
        assert (matches.invented, matches.excused_found) == (invented, () if invented else (1,))
