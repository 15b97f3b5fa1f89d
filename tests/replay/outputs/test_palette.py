"""Colours, looks of bodies and words are the same in every output; one red means missed and nothing else."""

from dataclasses import replace

import numpy as np
import pytest
from support.small_worlds import jumping

from cdcore import Verdict
from replay.comparison.outcome import Outcome
from replay.outputs import palette
from replay.outputs.palette import albedo, is_ghost, tags_of
from replay.outputs.rerun_log.columns import packed
from replay.outputs.words import OUTCOME_WORDS, counted, depth_words, lane_legend, span_words
from replay.pipeline.engine import compute
from sessions import Scene
from sessions.model.scene import SceneBody

Rgba = palette.Rgba


def hue_distance(a, b):
    return float(np.linalg.norm(np.subtract(a[:3], b[:3])))


def lightness(colour):
    r, g, b = (channel / 255 for channel in colour[:3])
    return 0.2126 * r**2.2 + 0.7152 * g**2.2 + 0.0722 * b**2.2


def test_nothing_but_missed_is_near_the_red():
    others = [colour for outcome, (_, colour) in palette.OUTCOMES.items() if outcome != Outcome.MISSED]
    others += [colour for _, colour in palette.VERDICTS.values()]
    others += [*palette.SERIES, *palette.DOUBTS, palette.WHITE, palette.BUDGET]
    others += [
        albedo((tag,)) for tag in ("glass", "hand", "headset", "bench", "rod", "metal", "plastic", "stopper", "?")
    ]
    assert min(hue_distance(palette.MISSED, other) for other in others) > 100


def test_red_yellow_and_blue_differ_in_lightness_too():
    values = sorted(lightness(colour) for colour in (palette.MISSED, palette.INVENTED, palette.FOUND))
    assert values[1] / values[0] > 1.2
    assert values[2] / values[1] > 1.2


def test_silence_has_no_word_and_everything_else_has_one():
    assert set(palette.OUTCOMES) == set(Outcome) - {Outcome.NEITHER}
    assert set(palette.VERDICTS) == set(Verdict) - {Verdict.CLEAR}


def test_verdict_lanes_use_the_words_of_the_glossary():
    assert all(word == Verdict(code).name for code, (word, _) in palette.VERDICTS.items())


def test_colours_are_packed_red_first():
    assert packed([(1, 2, 3, 4)]).tolist() == [0x01020304]
    assert packed([]).dtype == np.uint32


@pytest.mark.parametrize(
    ("tags", "least", "most", "ghost"),
    [("glass vessel", 1, 59, False), ("glass tool rod", 255, 255, False), ("bench furniture", 255, 255, False)]
    + [(tag, 1, 40, True) for tag in ("hand", "controller", "headset", "wand")],
)
def test_glass_is_translucent_a_rod_of_it_is_not_and_what_belongs_to_the_user_never_hides_a_contact(
    tags, least, most, ghost
):
    assert least <= albedo(tuple(tags.split()))[3] <= most and is_ghost(tuple(tags.split())) == ghost


def test_declared_tags_win_over_the_name_and_without_any_the_name_tells():
    scene = Scene("s", (SceneBody("hand-left", shape="box", tags=("glass",)),))
    assert tags_of("hand-left", scene) == ("glass",)
    assert "hand" in tags_of("Hand_Left2", Scene()) and "bench" in tags_of("lab bench", Scene())


def test_one_thing_is_singular_and_all_other_numbers_are_plural():
    words = [counted(number, "frame") for number in (0, 1, 2, 1000)]
    assert words == ["0 frames", "1 frame", "2 frames", "1,000 frames"]


def test_a_span_without_length_is_one_number_and_an_unknown_one_is_nothing():
    assert span_words(1.0, 1.0) == "1.000" and span_words(1.0, 2.5) == "1.000 to 2.500"
    assert span_words(None, 1.0) == span_words(1.0, None) == ""


def test_a_miss_has_millimetres_or_lies_between_frames():
    (hidden,) = compute(jumping(), detectors="exact", oracle="continuous").misses["exact"]
    assert depth_words(hidden, " mm") == "between frames"
    shown = replace(hidden, touch=None, cut_length=0.01234)
    assert depth_words(shown, " mm", 6) == "  12.3 mm" and depth_words(shown) == "12.3"


def test_the_legend_of_the_lanes_names_every_outcome_that_has_a_colour_and_none_that_is_not_there():
    words = lane_legend(OUTCOME_WORDS, "slow").lower()
    assert all(word.lower() in words for word in OUTCOME_WORDS.values())
    assert "micrometres" not in words, "tau is an option"
    assert lane_legend([Outcome.NEITHER, Outcome.BOTH, Outcome.MISSED], "slow") == "red: missed by slow    blue: both"
    assert lane_legend([Outcome.NEITHER]) == "" and lane_legend([Outcome.MISSED]) == "red: missed"
