"""Clusters hold every miss once, of one pair each, and are few."""

from dataclasses import replace

from hypothesis import given
from hypothesis import strategies as st

from replay.comparison.clusters import MANY, SHORTEST_GAP, by_depth, clusters, seen_and_between
from replay.comparison.outcome import FirstTouch, Miss

ONE = Miss(
    number=1, pair=0, body_a="a", body_b="b", first=0, last=0, start=0.0, end=0.0, kind="never found", episode=1,
    deepest=0, point=(0.0, 0.0, 0.0), normal=(0.0, 1.0, 0.0), face_pairs=1, cut_length=0.01, cause="search",
)  # fmt: skip


def at(number, start, pair=0, depth=0.01, frames=1):
    first = round(start * 90)
    end = start + (frames - 1) / 90
    return replace(
        ONE, number=number, pair=pair, start=start, end=end, first=first, last=first + frames - 1, cut_length=depth
    )


def numbers(found):
    return [[miss.number for miss in cluster.misses] for cluster in found]


def test_misses_of_one_pair_close_in_time_are_one_cluster_and_the_deepest_comes_first():
    near = SHORTEST_GAP * 0.9
    misses = [at(1, 0.0), at(2, near), at(3, near, pair=1, depth=0.5), at(4, 5.0, depth=0.02)]
    assert numbers(clusters(misses)) == [[3], [4], [1, 2]]


def test_a_miss_that_no_frame_shows_comes_after_those_with_a_cut():
    assert [miss.number for miss in by_depth([at(1, 0.0, depth=0.0), at(2, 1.0), at(3, 2.0, depth=0.0)])] == [2, 1, 3]


def test_misses_that_no_frame_shows_stand_apart_in_order_of_time():
    touch = FirstTouch(3, 0.03, 0.031, 100, (0, 1), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    misses = [
        at(1, 0.0), replace(at(2, 1.0, depth=0.0), touch=touch), at(3, 2.0, depth=0.02),
        replace(at(4, 3.0, depth=0.0), touch=touch), at(5, 4.0, depth=0.0),
    ]  # fmt: skip
    seen, between = seen_and_between(misses)
    assert [[miss.number for miss in part] for part in (seen, between)] == [[3, 1, 5], [2, 4]]


@given(st.lists(st.tuples(st.integers(0, 30000), st.integers(0, 60)), max_size=300), st.integers(1, MANY))
def test_every_miss_is_in_one_cluster_of_its_pair_and_there_are_few(places, most):
    misses = [at(k, start / 100, pair, depth=start % 7) for k, (start, pair) in enumerate(sorted(places), 1)]
    found = clusters(misses, most)
    assert sorted(number for group in numbers(found) for number in group) == [miss.number for miss in misses]
    assert all(len({miss.pair for miss in cluster.misses}) == 1 for cluster in found)
    assert len(found) <= max(most, len({miss.pair for miss in misses}))
    depths = [cluster.deepest.cut_length for cluster in found]
    assert depths == sorted(depths, reverse=True)
