"""An indicator turns where the pH leaves one end of its range and reaches the other."""

from types import SimpleNamespace

import numpy as np
import pytest

from replay.effects.colour import compute
from replay.effects.output import COLOURS, Liquid, Series

RED_TO_BLUE_FROM_6_TO_8 = {
    "in": "flask", "indicator": "mine", "species": "", "from_ph": 6.0, "to_ph": 8.0, "acid_colour": "red",
    "base_colour": "blue", "colour": "", "full_mol_l": None,
}  # fmt: skip


class Inputs(SimpleNamespace):
    """Inputs of an effect, with as many frames as times."""

    def __len__(self):
        return len(self.times)


def coloured(ph, step_s=0.1, start_s=0.0, liquids=(), declared=(RED_TO_BLUE_FROM_6_TO_8,)):
    """The effect of an indicator that is red below pH 6 and blue above 8, of a pH at times so far from each other.

    ``liquids``: vessel -> what effect mixing draws; ``declared``: indicators, where it is not that one.
    """
    times = start_s + step_s * np.arange(len(ph))
    outputs = {
        "reaction": SimpleNamespace(series={"flask/pH": Series(times, np.array(ph, dtype=float), "pH")}),
        "mixing": SimpleNamespace(liquids=dict(liquids)),
    }
    return compute(Inputs(declared=declared, times=times, output=outputs.get))


TO_BLUE, TO_RED = "mine in flask turns from red to blue", "mine in flask turns from blue to red"


def test_indicator_changes_between_both_ends_of_its_range():
    """The indicator "mine" is red up to pH 6 and blue from pH 8; ``ph``: of moments 0.1 s apart.

    ``events``: text, start and end in seconds: the first moment that leaves the old colour, and the first with the new;
    no end (None) where that is not reached. A pH that turns back, or that starts between 6 and 8, is no event.
    """
    for case, (ph, events) in {
        "acid to base": ([5, 7, 9], [(TO_BLUE, 0.1, 0.2)]),
        "base to acid": ([9, 7, 5], [(TO_RED, 0.1, 0.2)]),
        "at its ends": ([6, 8], [(TO_BLUE, 0.1, 0.1)]),
        "there and back": ([5, 9, 5], [(TO_BLUE, 0.1, 0.1), (TO_RED, 0.2, 0.2)]),
        "halfway": ([5, 7, 7.9], [(TO_BLUE + ", not wholly by the end", 0.1, None)]),
        "returns": ([5, 7, 5], []),
        "from within": ([7, 7, 9], []),
        "acid": ([5, 5.9], []),
    }.items():
        changes = coloured(ph).events
        expected = [(text, pytest.approx(start), end and pytest.approx(end)) for text, start, end in events]
        assert [(event.text, event.time, event.end) for event in changes] == expected, case


def test_slow_change_states_when_it_is_complete():
    """The indicator is red up to pH 6 and blue from pH 8; rows of the pH are 10 s apart.

    It leaves red at 10 s and is blue at 40 s.
    """
    (event,) = coloured([5, 7, 7, 7, 9], step_s=10.0).events
    assert event.text == f"{TO_BLUE}, wholly at 40.000 s" and (event.time, event.end) == (10.0, 40.0)


def test_quick_change_does_not_state_when_it_is_complete():
    """The change takes 0.1 s, also late in a recording, at 1000 s, where rounding is coarser."""
    (event,) = coloured([5, 7, 9], start_s=1000.0).events
    assert event.text == TO_BLUE


def test_lane_and_series_have_both_colours_and_what_is_between():
    """The indicator is red up to pH 6 and blue from pH 8: pH 7, at 0.1 s, is halfway, 0.5 of the series."""
    effect = coloured([5, 7, 9])
    spans = [(span.word, span.start, span.end) for span in effect.lanes["flask"]]
    assert spans == [("red", 0.0, 0.1), ("red to blue", 0.1, 0.2), ("blue", 0.2, 0.2)]
    assert effect.series["flask/mine colour"].values.tolist() == [0.0, 0.5, 1.0]


def grey_liquid():
    """A liquid as the effect mixing draws it at four times from 0 to 0.2 s, in grey."""
    times, grey = np.array([0.0, 0.05, 0.15, 0.2]), np.full((4, 4), 100, dtype=np.uint8)
    return Liquid(times, level=np.zeros(4), floor=0.0, radius=0.03, rgba=grey)


def test_liquid_has_the_colour_of_the_ph_at_its_time():
    """The pH is 5, 7 and 9 at 0, 0.1 and 0.2 s; the indicator is red up to pH 6 and blue from pH 8.

    The liquid is drawn at 0, 0.05, 0.15 and 0.2 s, each in the colour of the last pH until then.
    """
    rgba = coloured([5, 7, 9], liquids={"flask": grey_liquid()}).liquids["flask"].rgba
    red, blue = np.array(COLOURS["red"], dtype=float), np.array(COLOURS["blue"], dtype=float)
    assert rgba == pytest.approx(np.array([red, red, (red + blue) / 2.0, blue]), abs=0.5)


def test_colourless_indicator_lets_the_colour_of_another_through():
    """Two indicators are in a flask of pH 5 to 9; the other is colourless up to pH 10. Each has a lane."""
    other = {
        **RED_TO_BLUE_FROM_6_TO_8,
        "indicator": "other",
        "acid_colour": "colourless",
        "from_ph": 10.0,
        "to_ph": 12.0,
    }
    alone, both = (
        coloured([5, 7, 9], liquids={"flask": grey_liquid()}, declared=indicators)
        for indicators in ((RED_TO_BLUE_FROM_6_TO_8,), (RED_TO_BLUE_FROM_6_TO_8, other))
    )
    assert both.liquids["flask"].rgba.tolist() == alone.liquids["flask"].rgba.tolist()
    assert set(both.lanes) == {"flask", "flask other"}


def test_without_a_ph_nothing_has_a_colour():
    """The effect colour needs a pH of the effect reaction, which has none (no series flask/pH) of a dry flask."""
    inputs = Inputs(
        declared=[RED_TO_BLUE_FROM_6_TO_8],
        times=np.arange(3.0),
        output=lambda _: SimpleNamespace(series={}, liquids={}),
        count=lambda _: None,
    )
    assert not compute(inputs).events
