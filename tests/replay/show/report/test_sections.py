"""Folded sections of a page: events of effects, and what became of doubtful poses."""

from types import SimpleNamespace

import pytest
from msgspec import convert
from support.report_states import document_with

from replay.document.columns import screen_columns
from replay.document.session import EffectRecord, FlaggedPoses
from replay.effects.effect_summary import EVENT_ROWS
from replay.show.report.sections import GLOSSARY, effect_parts, finding_parts

EFFECT = convert(
    {
        "about": "a", "because": (), "seconds": 0.1, "fraction": 0.1, "frames": 9, "frames_run": 9, "trigger": "",
        "counters": {}, "events": {}, "digest": "d", "sources": (),
    },
    EffectRecord,
)  # fmt: skip


@pytest.mark.parametrize(
    ("count", "title"),
    [
        pytest.param(EVENT_ROWS, "Events of the effects", id="all listed"),
        pytest.param(
            EVENT_ROWS + 1, f"Events of the effects, the first {EVENT_ROWS} of {EVENT_ROWS + 1}", id="too many"
        ),
    ],
)
def test_page_lists_the_first_events_and_says_how_many(count, title):
    """One effect with so many events; the table of events has ``EVENT_ROWS`` rows at most, and its title says so."""
    event = SimpleNamespace(effect="pour", name="spill", message="spilt", time=1.0, end_time=None)
    view = SimpleNamespace(document=document_with(effects={"pour": EFFECT}), events=[event] * count)
    heading, (_effect_table, event_table, *_) = effect_parts(view, curves=())
    assert heading == f"1 effect, {count} events"
    assert event_table.title == title
    assert len(event_table.rows) == EVENT_ROWS


def test_page_without_effects_has_no_section_of_them():
    """The scene declares no effect."""
    assert effect_parts(SimpleNamespace(document=document_with(), events=[]), curves=()) is None


def flagged(body, action, samples, dropped=0, repeated=0):
    """Frozen poses of a body in a span of time, and what the policy ``action`` made of them: the last one repeated."""
    return FlaggedPoses(
        kind="frozen", body=body, start_ns=0, end_ns=9, start=0.0, end=1.0, samples=samples, action=action,
        dropped=dropped, held=repeated, interpolated=0,
    )  # fmt: skip


def test_repaired_poses_are_summed_by_body_and_policy():
    """Frozen poses in four spans of time: 2 and 3 of the rod dropped, 4 of the rod held, 5 of all bodies dropped.

    The first two are one row, of 2 spans and 5 poses. A body without a name stands for all.
    """
    spans = [
        flagged("rod", action="drop", samples=2, dropped=2),
        flagged("rod", action="drop", samples=3, dropped=3),
        flagged("rod", action="hold", samples=4, repeated=4),
        flagged("", action="drop", samples=5, dropped=5),
    ]
    (table,) = finding_parts(document_with(flagged=tuple(spans)))
    assert table.head == ["kind", "body", "policy", "spans", "samples", "dropped", "held", "interpolated"]
    assert table.rows == (
        ("frozen", "rod", "drop", 2, 5, 5, 0, 0),
        ("frozen", "rod", "hold", 1, 4, 0, 4, 0),
        ("frozen", "all", "drop", 1, 5, 5, 0, 0),
    )


def test_glossary_explains_the_narrow_columns_that_name_no_row():
    """The glossary of a page explains the ranking's columns, but those that only name a row (detector, what it is).

    Wide columns, shown only where there is room, are left out too, but the loss, over which the page has a plot.
    """
    columns = screen_columns("ranking")
    explained = {column.name for column in columns if not column.wide and not column.names_row} | {"loss"}
    left_out = {column.name for column in columns} - explained
    assert explained >= {"missed", "false contact", "mean ms"}
    assert left_out == {"detector", "what", "settings", "of a 90 Hz frame"}
    assert explained <= GLOSSARY.keys()
    assert not GLOSSARY.keys() & left_out
