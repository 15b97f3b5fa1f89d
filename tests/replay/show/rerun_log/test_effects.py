"""Effects in the picture: order of plots and lanes, the moment at which it opens, and the liquid in a vessel."""

from types import SimpleNamespace

import numpy as np
import pytest

from replay.effects.effects_runner import SKIPPED_LANE
from replay.effects.output import QUANTITIES, EffectEvent, LaneSpan, Liquid, Series
from replay.show.rerun_log import effects
from replay.show.rerun_log.effects import effect_lanes, effect_plots, log_effects, log_happened
from replay.show.rerun_log.lanes import lane_name

SPANS = (LaneSpan(start=0.0, end=1.0, word="pours"),)


def run_of(events=(), series=(), lanes=(), liquids=None):
    """The run of an effect with these events, units of series, names of lanes and liquids."""
    series_of_name = {name: Series(np.zeros(1), np.zeros(1), unit) for name, unit in dict(series).items()}
    output = SimpleNamespace(lanes=dict.fromkeys(lanes, SPANS), liquids=liquids or {})
    return SimpleNamespace(events=events, series=series_of_name, output=output)


def test_amounts_of_substance_are_plotted_last():
    """An effect has a series in mol, one in millilitres and one without a unit, in this order: a plot each.

    A plot is called by the quantity of its unit, amounts of substance come last.
    """
    plots = effect_plots({"mix": run_of(series={"flask/HCl": "mol", "flask/volume": "mL", "other": ""})})
    assert [quantity for quantity, _series in plots] == [QUANTITIES["mL"], "numbers", QUANTITIES["mol"]]


def test_lanes_are_numbered_without_what_a_trigger_skipped():
    """The effect ``pour`` has a lane of its name, and one of frames that its trigger skipped; ``grasp`` one of the rod.

    Lanes are numbered over all effects. A lane that is called like its effect is not named twice.
    """
    lanes = effect_lanes({"pour": run_of(lanes=[SKIPPED_LANE, "pour"]), "grasp": run_of(lanes=["rod"])})
    assert [*lanes] == ["1_pour", f"2_{lane_name('rod', 'grasp')}"]


@pytest.mark.parametrize(
    ("event_s", "opens_ns"),
    [
        pytest.param(1.0, 1_250_000_000, id="amid the recording"),
        pytest.param(1.9, 2_000_000_000, id="near its end, at 2 s"),
    ],
)
def test_picture_opens_a_quarter_second_after_the_event(event_s, opens_ns, monkeypatch):
    """A recording of 2 s whose only event is the end point of a titration: a bookmark 250 ms later leads the picture.

    So its outcome is in sight; the end of the recording is the latest.
    """
    bookmarks = []
    monkeypatch.setattr(effects, "log_bookmarks", lambda writer, added: bookmarks.extend(added))
    writer = SimpleNamespace(clock=SimpleNamespace(ns=[0, 2_000_000_000]), markdown=lambda path, text: None)
    event = EffectEvent(event_s, "end-point", ("flask",), message="equivalent")
    log_happened(writer, {"titration": run_of(events=(event,))}, is_leading=True)
    (bookmark,) = bookmarks
    assert (bookmark.kind, bookmark.number, bookmark.leads) == ("event", 1, True)
    assert bookmark.session_ns == opens_ns


def test_liquid_reaches_from_floor_to_level_or_is_invisible():
    """A beaker with its floor at 10 mm; in three rows the liquid's level is at 50, 30 and 5 mm, below the floor.

    It is drawn as a cylinder 40 and 20 mm long about its middle, then one of no length (1 um) and opacity 0 (of 255).
    """
    levels = np.array([0.05, 0.03, 0.005])
    colours = np.full((3, 4), 200, np.uint8)
    liquid = Liquid(np.arange(3.0), levels, floor=0.01, radius=0.02, rgba=colours)
    drawn = {}
    writer = SimpleNamespace(
        log_lines=lambda *_: None,
        session_rows=lambda path, times, columns: drawn.update(
            {column.descriptor.component.partition(":")[2]: column.as_arrow_array().to_pylist() for column in columns}
        ),
    )
    log_effects(writer, {"pour": run_of(liquids={"beaker": liquid})})
    heights_of_middles = np.reshape(drawn["centers"], (3, 3))[:, 1]
    opacities = [colour & 255 for colour in np.ravel(drawn["colors"]).tolist()]
    assert np.ravel(drawn["lengths"]) == pytest.approx([0.04, 0.02, 1e-6])
    assert heights_of_middles == pytest.approx([0.03, 0.02, 0.01])
    assert opacities == [200, 200, 0]
