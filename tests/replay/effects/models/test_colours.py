import numpy as np

from replay.effects.models.colours import COLOURS, WATERY, blended


def test_a_blend_begins_and_ends_at_its_colours_and_stays_between():
    shades = blended(COLOURS["red"], COLOURS["blue"], np.array([-1.0, 0.0, 0.5, 1.0, 9.0]))
    assert tuple(shades[0]) == tuple(shades[1]) == COLOURS["red"] and tuple(shades[3]) == tuple(shades[4])
    assert tuple(shades[4]) == COLOURS["blue"] and shades.dtype == np.uint8
    assert COLOURS["blue"][0] < shades[2][0] < COLOURS["red"][0]


def test_every_colour_can_be_seen():
    assert all(len(one) == 4 and one[3] > 100 and max(one) <= 255 for one in COLOURS.values())
    assert COLOURS["colourless"] == WATERY
