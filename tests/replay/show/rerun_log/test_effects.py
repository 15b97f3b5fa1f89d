"""Effects in the picture: order of plots and lanes, the moment at which it opens, and the liquid in a vessel."""

from types import SimpleNamespace

import numpy as np
import pytest

from replay.effects.effects_runner import SKIPPED_LANE
from replay.effects.output import QUANTITIES, EffectEvent, LaneSpan, Liquid, Series
from replay.show.rerun_log import effects
from replay.show.rerun_log.effects import effect_lanes, effect_plots, log_effects, log_happened
from replay.show.rerun_log.lanes import lane_name

SPANS = (LaneSpan(0.0, 1.0, "pours"),)


def run_of(events=(), series=(), lanes=(), liquids=None):
    """The run of an effect with these events, units of series, names of lanes and liquids."""
    series_of_name = {name: Series(np.zeros(1), np.zeros(1), unit) for name, unit in dict(series).items()}
    output = SimpleNamespace(lanes=dict.fromkeys(lanes, SPANS), liquids=liquids or {})
    return SimpleNamespace(events=events, series=series_of_name, output=output)


def test_amounts_of_substance_are_plotted_last():
    """The effect has its mol first, then millilitres, and a number without a unit."""
    plots = effect_plots({"mix": run_of(series={"flask/HCl": "mol", "flask/volume": "mL", "other": ""})})
    quantities = [quantity for quantity, _ in plots]
    assert quantities == [QUANTITIES["mL"], "numbers", QUANTITIES["mol"]]


def test_lanes_are_numbered_without_what_a_trigger_skipped():
    """A lane that is called like its effect is not named twice."""
    lanes = effect_lanes({"pour": run_of(lanes=[SKIPPED_LANE, "pour"]), "grasp": run_of(lanes=["rod"])})
    assert [*lanes] == ["1_pour", f"2_{lane_name('rod', 'grasp')}"]


@pytest.mark.parametrize(("seconds", "opens_ns"), [(1.0, 1_250_000_000), (1.9, 2_000_000_000)])
def test_picture_opens_a_quarter_second_after_the_event(seconds, opens_ns, monkeypatch):
    """The recording ends at 2 s."""
    rows = []
    monkeypatch.setattr(effects, "log_bookmarks", lambda writer, bookmarks: rows.extend(bookmarks))
    writer = SimpleNamespace(clock=SimpleNamespace(ns=[0, 2_000_000_000]), markdown=lambda path, text: None)
    event = EffectEvent(seconds, "end-point", ("flask",), message="equivalent")
    log_happened(writer, {"titration": run_of(events=(event,))}, is_leading=True)
    assert [(row.kind, row.number, row.session_ns, row.leads) for row in rows] == [("event", 1, opens_ns, True)]


def test_liquid_reaches_from_floor_to_level_or_is_invisible():
    """A floor at 10 mm; levels 40 and 20 mm above it, and one below."""
    liquid = Liquid(
        np.arange(3.0), np.array([0.05, 0.03, 0.005]), floor=0.01, radius=0.02, rgba=np.full((3, 4), 200, np.uint8)
    )
    drawn = {}
    writer = SimpleNamespace(
        log_lines=lambda *_: None,
        session_rows=lambda path, times, columns: drawn.update(
            {column.descriptor.component.partition(":")[2]: column.as_arrow_array().to_pylist() for column in columns}
        ),
    )
    log_effects(writer, {"pour": run_of(liquids={"beaker": liquid})})
    assert np.ravel(drawn["lengths"]) == pytest.approx([0.04, 0.02, 1e-6])
    assert np.reshape(drawn["centers"], (3, 3)) == pytest.approx(np.array([[0, 0.03, 0], [0, 0.02, 0], [0, 0.01, 0]]))
    assert [colour & 255 for colour in np.ravel(drawn["colors"]).tolist()] == [200, 200, 0]
