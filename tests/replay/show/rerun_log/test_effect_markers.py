"""Dots of events of effects in the room of the picture."""

from types import SimpleNamespace

from replay.effects.output import EffectEvent
from replay.show.rerun_log.effects import log_effects


def test_events_with_a_position_have_a_dot_unless_information():
    """Four events of an effect, at 1 to 4 s: dots at 1 and 3 s, of the warning and the error that have a position.

    The event at 2 s is information only, that at 4 s has no position. Dots are numbered from 1.
    """
    events = (
        EffectEvent(1.0, "spill", level="warning", point=(0.0, 1.0, 0.0)),
        EffectEvent(2.0, "contact", level="info", point=(0.0, 2.0, 0.0)),
        EffectEvent(3.0, "break", level="error", point=(0.0, 3.0, 0.0)),
        EffectEvent(4.0, "spill", level="warning"),
    )
    output = SimpleNamespace(lanes={}, liquids={})
    run = SimpleNamespace(events=events, series={}, output=output)
    time_of_dot = {}
    writer = SimpleNamespace(
        log_lines=lambda path, times, lines: None,
        session_rows=lambda path, times, columns: time_of_dot.update({path.rpartition("/")[2]: times.tolist()}),
    )
    log_effects(writer, {"pour": run})
    assert time_of_dot == {"1": [1_000_000_000], "2": [3_000_000_000]}
