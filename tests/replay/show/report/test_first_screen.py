"""The first screen of a page: facts about the session, and the window of its lanes."""

from types import SimpleNamespace

import pytest
from msgspec import structs
from support.report_states import audit_of, document_with

from replay.auditing.wilson import proportion
from replay.document.ranking import Rank
from replay.document.session import Window
from replay.show.report.first_screen import comparison_of, page_facts
from replay.show.report.run_view import RunView

REFERENCE = Rank("exact", "", "", contacts=3, mean=1e-4, p99=2e-4)


@pytest.mark.parametrize(
    ("ranks", "undecided", "facts", "text"),
    [
        ((REFERENCE,), 0, {}, "60 s, 3 contacts"),
        ((REFERENCE,), 9, {}, "60 s"),
        ((), 9, {"synthetic": "true"}, "60 s, made up"),
        ((REFERENCE,), 0, {"synthetic": "true"}, "60 s, 3 contacts, made up"),
    ],
)
def test_contacts_are_a_fact_where_any_was_decided(ranks, undecided, facts, text):
    """``undecided``: of nine pair-frames of the only audit."""
    document = document_with(audit={"slow": audit_of(undecided=proportion(undecided, 9))})
    document = structs.replace(document, session=structs.replace(document.session, duration=60.0, facts=facts))
    assert page_facts(SimpleNamespace(document=document, ranking=ranks)) == text


def test_lanes_begin_where_the_replayed_window_does():
    """A run of 60 s, from 2.5 s of its session on, that compared nothing."""
    session = structs.replace(document_with().session, duration=60.0)
    document = document_with(window=Window(2.5, None), session=session)
    run = SimpleNamespace(document=document, oracle="", ranking=(), contacts={}, faults={}, answers=())
    assert comparison_of(RunView(run, "s")).timeline.window == (2.5, 60.0)
