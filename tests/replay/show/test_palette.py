"""Colours, looks of bodies and words are the same in every output; one red means missed and nothing else."""

import numpy as np
import pytest

from replay.auditing.outcome import Outcome
from replay.show import palette
from replay.show.palette import albedo


def hue_distance(a, b):
    return float(np.linalg.norm(np.subtract(a[:3], b[:3])))


def lightness(colour):
    r, g, b = (channel / 255 for channel in colour[:3])
    return 0.2126 * r**2.2 + 0.7152 * g**2.2 + 0.0722 * b**2.2


def test_nothing_but_missed_is_near_the_red():
    others = [colour for outcome, (_, colour) in palette.OUTCOMES.items() if outcome != Outcome.MISSED]
    others += [colour for _, colour in palette.VERDICTS.values()]
    others += [*palette.SERIES, palette.WHITE, palette.BUDGET]
    others += [
        albedo((tag,)) for tag in ("glass", "hand", "headset", "bench", "rod", "metal", "plastic", "stopper", "?")
    ]
    assert min(hue_distance(palette.MISSED, other) for other in others) > 100


def test_red_yellow_and_blue_differ_in_lightness_too():
    values = sorted(lightness(colour) for colour in (palette.MISSED, palette.INVENTED, palette.FOUND))
    assert values[1] / values[0] > 1.2
    assert values[2] / values[1] > 1.2


@pytest.mark.parametrize(
    ("tags", "least", "most"),
    [("glass vessel", 1, 99), ("glass tool rod", 255, 255), ("bench furniture", 255, 255)]
    + [(tag, 1, 40) for tag in ("hand", "controller", "headset", "wand")],
)
def test_glass_is_translucent_and_the_user_never_hides_a_contact(tags, least, most):
    assert least <= albedo(tuple(tags.split()))[3] <= most
