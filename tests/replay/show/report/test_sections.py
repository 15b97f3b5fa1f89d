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
        (EVENT_ROWS, "Events of the effects"),
        (EVENT_ROWS + 1, f"Events of the effects, the first {EVENT_ROWS} of {EVENT_ROWS + 1}"),
    ],
)
def test_page_lists_the_first_events_and_says_how_many(count, title):
    """All but the first EVENT_ROWS events are left out of the table; without effects there is no section."""
    event = SimpleNamespace(effect="pour", name="spill", message="spilt", time=1.0, end_time=None)
    run_document = document_with(effects={"pour": EFFECT})
    view = SimpleNamespace(document=run_document, events=[event] * count)
    heading, contents = effect_parts(view, ())
    assert heading == f"1 effect, {count} events" and contents[1].title == title
    assert len(contents[1].rows) == EVENT_ROWS
    assert effect_parts(SimpleNamespace(document=document_with(), events=[]), ()) is None


def flagged(body, action, samples):
    """Poses in doubt of a body, ``""``: of all, that were dropped."""
    return FlaggedPoses(
        kind="frozen", body=body, start_ns=0, end_ns=9, start=0.0, end=1.0, samples=samples, action=action,
        dropped=samples, held=0, interpolated=0,
    )  # fmt: skip


def test_repaired_poses_are_summed_by_body_and_policy():
    """Two spans of 2 and 3 dropped poses of the rod are one row.

    A row is kind, body, policy, spans, poses, and poses dropped, held and interpolated.
    """
    spans = (flagged("rod", "drop", 2), flagged("rod", "drop", 3), flagged("rod", "hold", 4), flagged("", "drop", 5))
    (table,) = finding_parts(document_with(flagged=spans))
    assert table.rows == (
        ("frozen", "rod", "drop", 2, 5, 5, 0, 0), ("frozen", "rod", "hold", 1, 4, 4, 0, 0),
        ("frozen", "all", "drop", 1, 5, 5, 0, 0),
    )  # fmt: skip


def test_glossary_explains_the_narrow_columns_that_name_no_row():
    """``detector`` and ``what`` of the ranking name a row, and ``settings`` and the share of a frame are wide."""
    narrow = {column.name for column in screen_columns("ranking") if not column.wide and not column.names_row}
    assert len(narrow) > 3 and narrow < GLOSSARY.keys()
    assert not GLOSSARY.keys() & {"detector", "what", "settings", "of a 90 Hz frame"}
