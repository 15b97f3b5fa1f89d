from math import dist

from hypothesis import given
from hypothesis import strategies as st

from replay.tradeoff.lines import apart, lines_of


def test_points_of_one_algorithm_and_axis_are_one_line_in_order_of_time():
    rows = [{"line": name, "ms_per_frame": ms} for name, ms in (("a", 3.0), ("b", 1.0), ("a", 2.0))]
    assert lines_of(rows) == {
        "a": [{"line": "a", "ms_per_frame": 2.0}, {"line": "a", "ms_per_frame": 3.0}],
        "b": [{"line": "b", "ms_per_frame": 1.0}],
    }
    assert lines_of([]) == {}


@given(st.lists(st.tuples(st.integers(0, 20), st.integers(0, 20)), max_size=12))
def test_no_two_words_are_too_near_and_none_leaves_its_column(places):
    words = apart(places, (-5.0, 2.0), 4.0, 0.5)
    for k, (word, place) in enumerate(zip(words, places, strict=True)):
        assert word[0] == place[0] - 5.0 and word[1] >= place[1] + 2.0
        assert all(dist(word, other) >= 4.0 for other in words[:k])


def test_a_point_alone_has_its_words_where_they_belong():
    assert apart([(1.0, 2.0), (30.0, 2.0)], (-5.0, 2.0), 4.0, 0.5) == [(-4.0, 4.0), (25.0, 4.0)]
