"""The first screen of a page: facts about the session, and the window of its lanes."""

from types import SimpleNamespace

import pytest
from msgspec import structs
from support.report_states import audit_of, detector_of, document_with

from replay.auditing.wilson import proportion
from replay.document.answer import Answer, Fix, FixFigures
from replay.document.ranking import Rank, ranking
from replay.document.session import Window
from replay.show.report.first_screen import comparison_of, page_facts
from replay.show.report.run_view import RunView

REFERENCE = Rank(label="exact", what="", setting="", contacts=3, mean=1e-4, p99=2e-4)


@pytest.mark.parametrize(
    ("ranks", "undecided", "facts", "text"),
    [
        pytest.param((REFERENCE,), 0, {}, "60 s, 3 contacts", id="all decided"),
        pytest.param((REFERENCE,), 9, {}, "60 s", id="nothing decided"),
        pytest.param((), 9, {"synthetic": "true"}, "60 s, made up", id="made up, no ranking"),
        pytest.param((REFERENCE,), 0, {"synthetic": "true"}, "60 s, 3 contacts, made up", id="made up"),
    ],
)
def test_contacts_are_a_fact_where_any_was_decided(ranks, undecided, facts, text):
    """A session of 60 s in which the reference (exact) sees 3 contacts; ``undecided``: of nine pair-frames.

    A recording states by the fact ``synthetic`` that it was made up.
    """
    document = document_with(audit={"slow": audit_of(undecided=proportion(undecided, 9))})
    document = structs.replace(document, session=structs.replace(document.session, duration=60.0, facts=facts))
    assert page_facts(SimpleNamespace(document=document, ranking=ranks)) == text


def test_lanes_begin_where_the_replayed_window_does():
    """60 s of a session are replayed, from 2.5 s on; a window of lanes is its first second and its length.

    Nothing was compared.
    """
    session = structs.replace(document_with().session, duration=60.0)
    document = document_with(window=Window(start=2.5, end=None), session=session)
    run = SimpleNamespace(document=document, oracle="", ranking=(), contacts={}, faults={}, answers=())
    assert comparison_of(RunView(run, "s")).timeline.window == (2.5, 60.0)


def run_of(*, answers=(), contacts=3, **audits):
    """A run of 10 s of a reference with so many contacts and of detectors, label -> the values of its audit."""
    document = document_with(
        oracle="exact",
        session=structs.replace(document_with().session, duration=10.0),
        detectors={"exact": detector_of("exact"), **{label: detector_of("discrete") for label in audits}},
        audit={label: audit_of(contacts=contacts, **values) for label, values in audits.items()},
        answers=answers,
    )
    ranks = ranking(document)
    return RunView(
        SimpleNamespace(
            document=document, oracle="exact", ranking=ranks, contacts={}, faults={}, answers=answers, flicker={}
        ),
        "s",
    )


@pytest.mark.parametrize(
    ("audit", "leads", "bad_column"),
    [
        ({}, "", ""),
        ({"contacts_missed": 1}, "missed", "missed"),
        ({"late_or_cut_short": 1, "time_missed": proportion(1, 10)}, "missed", ""),
        ({"false_contact": proportion(5, 10)}, "false", "false contact"),
    ],
)
def test_worst_figure_of_the_worst_detector_is_marked(audit, leads, bad_column):
    """``audit``: of a detector beside one that misses nothing; only false contact time has an interval."""
    rows = comparison_of(run_of(good={}, bad=audit)).ranking
    first, *others = rows
    assert (first.leads, first.bad, bool(first.interval)) == (leads, bad_column, bad_column == "false contact")
    assert [(row.leads, row.bad, row.interval) for row in others] == [("", "", "")] * 2


def test_only_the_worst_of_two_wrong_detectors_is_marked():
    """One misses 2 of 3 contacts, the other one."""
    rows = comparison_of(run_of(two={"contacts_missed": 2}, one={"contacts_missed": 1})).ranking
    assert [(row.rank.label, row.leads) for row in rows] == [("two", "missed"), ("one", ""), ("exact", "")]


def test_measured_fix_has_a_lane_of_its_own():
    """It stands below the worst detector, which reports nothing in this run; the fix is right from 1 to 2 s."""
    none = proportion(0, 3)
    figures = FixFigures(
        what="every frame", missed=none, late_or_cut_short=none, time_missed=none, false=none, missed_counts=(0, 0),
        late_counts=(0, 0), offsets=1, mean=1e-4, p99=None, spans={"right": ((1.0, 2.0),), "missed": ()},
    )  # fmt: skip
    answer = Answer("slow", "", fix=Fix("", True, setting="discrete", figures=figures))
    lanes = comparison_of(run_of(answers=(answer,), slow={"contacts_missed": 1})).timeline.lanes
    assert [label for label, *_ in lanes] == ["exact", "slow", "fix"]
    assert [[kind for kind, _ in drawn.paths] for *_, drawn in lanes] == [[], [], ["right", "right tick"]]
    assert [drawn.words for *_, drawn in lanes] == ["exact: no contact", "slow: no contact", "fix: 1 right"]
