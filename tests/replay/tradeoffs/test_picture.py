import io
from math import dist
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from replay.outputs.report import tradeoff_picture
from replay.tradeoffs.settings import Setting
from replay.tradeoffs.sweep import tradeoff


@pytest.fixture(scope="module")
def rows(bumped):
    rates = [Setting("discrete", "step rate", f"{hz} Hz", {"rate_hz": hz}) for hz in (20.0, 40.0)]
    return tradeoff(bumped, settings=[Setting("hybrid", "as it comes", ""), *rates], repeats=1).rows


def test_both_kinds_can_be_opened_and_name_what_they_show(rows):
    assert tradeoff_picture.picture(rows, "Costs").startswith(b"\x89PNG")
    drawn = tradeoff_picture.picture(rows, "Costs", "svg").decode()
    ElementTree.fromstring(drawn)
    front = [row["label"] for row in rows if row["front"]]
    axes = ("one frame at 90 Hz", "seconds per minute of the session")
    for words in ("Costs", "discrete", "step rate", "the front", *axes, *front):
        assert f"<!-- {words}" in drawn or words in drawn


def test_no_word_is_drawn_twice_on_itself(rows):
    drawn = tradeoff_picture.picture(rows, "Costs", "svg").decode()
    assert [drawn.count(f"<!-- {words} -->") for words in ("algorithm", "what is turned", "as it comes")] == [1, 1, 1]


def test_on_a_dark_page_nothing_is_drawn_on_white_paper(rows):
    light, dark = (
        np.asarray(Image.open(io.BytesIO(tradeoff_picture.picture(rows, "Costs", theme=theme))).convert("L"))
        for theme in (tradeoff_picture.LIGHT, tradeoff_picture.DARK)
    )
    assert light.shape == dark.shape and np.median(light) == 255 and np.median(dark) < 40
    assert (dark > 200).sum() < 0.05 * dark.size


def test_colours_of_a_theme_differ_and_stand_out_from_its_paper():
    def lightness(colour):
        red, green, blue = (int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5))
        return 0.2126 * red**2.2 + 0.7152 * green**2.2 + 0.0722 * blue**2.2

    for theme in (tradeoff_picture.LIGHT, tradeoff_picture.DARK):
        assert len(set(theme.series)) == len(theme.series)
        for colour in (*theme.series, theme.ink, theme.faint, theme.front):
            low, high = sorted((lightness(colour), lightness(theme.paper)))
            assert (high + 0.05) / (low + 0.05) > (2.0 if colour in theme.series else 4.0), colour


@given(st.floats(0.0, 100.0))
def test_a_recall_stands_where_it_can_be_read_back_and_more_stands_higher(recall):
    assert tradeoff_picture.unstretched(tradeoff_picture.stretched(recall)) == pytest.approx(recall, abs=1e-9)
    assert recall >= 99.99 or tradeoff_picture.stretched(recall) < tradeoff_picture.stretched(recall + 0.01)


def test_from_99_to_100_there_is_more_room_than_from_0_to_50():
    assert tradeoff_picture.stretched(100) - tradeoff_picture.stretched(99) > tradeoff_picture.stretched(
        50
    ) - tradeoff_picture.stretched(0)


def test_numbers_of_points_that_fall_together_stand_apart(rows):
    axes = tradeoff_picture._drawn(rows, "Costs", tradeoff_picture.LIGHT).axes[0]
    times, recall = [0.01] * 4 + [0.0101], [50.0, 50.0, 50.1, 51.0, 51.0]
    points = axes.transData.transform(np.column_stack([times, recall])) * 72 / axes.figure.dpi
    places = points + np.array(tradeoff_picture._apart(axes, times, recall))
    for k, one in enumerate(places):
        assert all(np.hypot(*(one - other)) >= tradeoff_picture.APART - 1e-9 for other in places[:k])


def test_no_row_is_no_picture():
    with pytest.raises(ValueError, match="no row"):
        tradeoff_picture.picture([], "Costs")


def test_points_of_one_algorithm_and_axis_are_one_line_in_order_of_time():
    rows = [{"line": name, "ms_per_frame": ms} for name, ms in (("a", 3.0), ("b", 1.0), ("a", 2.0))]
    assert tradeoff_picture.lines_of(rows) == {
        "a": [{"line": "a", "ms_per_frame": 2.0}, {"line": "a", "ms_per_frame": 3.0}],
        "b": [{"line": "b", "ms_per_frame": 1.0}],
    }
    assert tradeoff_picture.lines_of([]) == {}


@given(st.lists(st.tuples(st.integers(0, 20), st.integers(0, 20)), max_size=12))
def test_no_two_words_are_too_near_and_none_leaves_its_column(places):
    words = tradeoff_picture.apart(places, (-5.0, 2.0), 4.0, 0.5)
    for k, (word, place) in enumerate(zip(words, places, strict=True)):
        assert word[0] == place[0] - 5.0 and word[1] >= place[1] + 2.0
        assert all(dist(word, other) >= 4.0 for other in words[:k])


def test_a_point_alone_has_its_words_where_they_belong():
    assert tradeoff_picture.apart([(1.0, 2.0), (30.0, 2.0)], (-5.0, 2.0), 4.0, 0.5) == [(-4.0, 4.0), (25.0, 4.0)]
