"""The first screen of a page: facts about the session, and the window of its lanes."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
from msgspec import structs
from support.report_states import audit_of, document_with, run_with_steady_times

from replay.auditing.wilson import proportion
from replay.document.ranking import Rank
from replay.document.session import Window
from replay.show.report.first_screen import comparison_of, page_facts
from replay.show.report.page import view_of

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
    result = run_with_steady_times("several")
    document = structs.replace(result.document, window=Window(2.5, None))
    timeline = comparison_of(view_of(replace(result, document=document))).timeline
    assert timeline.window == (2.5, pytest.approx(result.document.session.duration))
