"""One red means missed and nothing else."""

import numpy as np

from cdcore import Verdict
from replay.comparison.outcome import Outcome
from replay.outputs import palette
from replay.outputs.materials import albedo
from replay.outputs.rerun_log.columns import packed

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
