from dataclasses import replace

from support.small_worlds import jumping

from replay.outputs.words import LANE_LEGEND, OUTCOME_WORDS, counted, depth_words, span_words
from replay.pipeline.engine import compute


def test_one_thing_is_singular_and_all_other_numbers_are_plural():
    assert [counted(number, "frame") for number in (0, 1, 2, 1000)] == [
        "0 frames",
        "1 frame",
        "2 frames",
        "1,000 frames",
    ]


def test_a_span_without_length_is_one_number_and_an_unknown_one_is_nothing():
    assert span_words(1.0, 1.0) == "1.000" and span_words(1.0, 2.5) == "1.000 to 2.500"
    assert span_words(None, 1.0) == span_words(1.0, None) == ""


def test_a_miss_has_millimetres_or_lies_between_frames():
    (hidden,) = compute(jumping(), detectors="exact", oracle="continuous").misses["exact"]
    assert depth_words(hidden, " mm") == "between frames"
    shown = replace(hidden, touch=None, cut_length=0.01234)
    assert depth_words(shown, " mm", 6) == "  12.3 mm" and depth_words(shown) == "12.3"


def test_the_legend_of_the_lanes_names_every_outcome_that_has_a_colour():
    words = LANE_LEGEND.lower()
    assert all(word.lower() in words for word in OUTCOME_WORDS.values())
    assert "micrometres" not in words, "tau is an option"
