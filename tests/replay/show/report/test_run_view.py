"""Pages of a run: its names, its first sentence without an audit, and the spans of its lanes."""

from types import SimpleNamespace

import pytest
from msgspec import structs
from support.report_states import EMPTY, detector_of, document_with

from replay.auditing.fault import FaultKind
from replay.document.contact import EventRecord
from replay.effects.effect_summary import RESULT_NAMES
from replay.show.report.run_view import FIRST_DATE_NS, RunView, session_names, spans

PAIR, OTHER_PAIR = ("cup", "rod"), ("cup", "hand")


def contact(start, end, bodies=PAIR):
    """A contact of two bodies from one second to another."""
    return SimpleNamespace(bodies=bodies, start=start, end=end, grasped=False)


def fault(kind, start, end, bodies=PAIR):
    """A fault of two bodies from one second to another."""
    return SimpleNamespace(kind=kind, bodies=bodies, start=start, end=end)


VIEW = RunView(
    SimpleNamespace(
        oracle="exact",
        contacts={
            "exact": [contact(0, 2), contact(3, 5), contact(6, 7), contact(8, 9, OTHER_PAIR)],
            "hull": [contact(1, 4), contact(4.5, 4.6), contact(7, 7.5), contact(8.2, 9.5, OTHER_PAIR)],
        },
        faults={
            "hull": [
                fault(FaultKind.NEVER_REPORTED, 6, 7),
                fault(FaultKind.REPORTED_LATE, 0, 1),
                fault(FaultKind.ENDS_LATE, 9, 9.5, OTHER_PAIR),
            ]
        },
    ),
    "s",
)
"""A page about the reference ``exact`` and the detector ``hull``, whose contacts and faults are these."""


def test_right_spans_are_common_to_detector_and_reference():
    """Contact of cup and rod at 0-2, 3-5 and 6-7 s (reference), and at 1-4, 4.5-4.6 and 7-7.5 s (detector ``hull``).

    Common to both are 1-2, 3-4 and 4.5-4.6 s; 7 s alone is no span. Of the faults of ``hull`` the contact 6-7 s was
    never reported, and 0-1 s of another was late.
    """
    spans_of_kind = spans(VIEW, "hull", PAIR)
    assert spans_of_kind == {"right": [(1, 2), (3, 4), (4.5, 4.6)], "missed": [(6, 7)], "late": [(0, 1)], "false": []}


def test_spans_of_another_pair_are_its_own():
    """Contact of cup and hand at 8-9 s (reference) and at 8.2-9.5 s (``hull``), whose fault is to end 0.5 s late."""
    spans_of_kind = spans(VIEW, "hull", OTHER_PAIR)
    assert spans_of_kind == {"right": [(8.2, 9)], "missed": [], "late": [], "false": [(9, 9.5)]}


def test_spans_without_a_pair_are_those_of_all():
    """Contacts of detector and reference overlap at 1-2, 3-4 and 4.5-4.6 s (cup and rod), and 8.2-9 s (cup and hand).

    The only false contact of ``hull`` is of cup and hand, from 9 to 9.5 s.
    """
    spans_of_kind = spans(VIEW, "hull")
    assert sorted(spans_of_kind["right"]) == [(1, 2), (3, 4), (4.5, 4.6), (8.2, 9)]
    assert spans_of_kind["false"] == [(9, 9.5)]


def test_spans_of_the_reference_are_its_contacts():
    """The reference (exact) has contacts of cup and rod at 0-2, 3-5 and 6-7 s."""
    assert spans(VIEW, "exact", PAIR) == {"reference": [(0, 2), (3, 5), (6, 7)]}


def test_spans_without_a_reference_are_contact():
    """A run of the detector ``hull`` alone (no oracle): its contact is neither right nor wrong."""
    unaudited = RunView(SimpleNamespace(oracle="", contacts={"hull": [contact(1, 4)]}, faults={}), "s")
    assert spans(unaudited, "hull") == {"contact": [(1, 4)]}


def test_session_is_named_by_scene_or_bodies_and_pseudonym():
    """The name of the scene, without one those of the bodies; then the pseudonym of the student, if facts state it.

    The first frame has the stamp 0: no date.
    """
    rows = {
        "scene": ("Titration", ["a", "b"], {}, ["Titration"]),
        "two bodies": ("", ["a", "b"], {}, ["a and b"]),
        "three bodies": ("", ["a", "b", "c"], {}, ["a, b and 1 more"]),
        "bodies and pseudonym": ("", ["a", "b", "c", "d"], {"pseudonym": "S07"}, ["a, b and 2 more", "S07"]),
        "no pseudonym": ("Titration", ["a", "b"], {"pseudonym": "not stated"}, ["Titration"]),
    }
    for row, (scene, bodies, facts, names) in rows.items():
        session = structs.replace(
            EMPTY.session, scene=scene, bodies=dict.fromkeys(bodies), facts=facts, first_stamp_ns=0
        )
        assert session_names(document_with(session=session)) == names, row


@pytest.mark.parametrize(
    ("first_stamp_ns", "names"),
    [
        pytest.param(FIRST_DATE_NS, 2, id="from 2000 on: scene and date"),
        pytest.param(FIRST_DATE_NS - 1, 1, id="earlier: scene"),
    ],
)
def test_date_is_named_where_stamps_have_a_date(first_stamp_ns, names):
    """Stamps from the year 2000 on count from 1970; smaller ones count from the begin of a recording."""
    session = structs.replace(EMPTY.session, scene="Titration", first_stamp_ns=first_stamp_ns)
    assert len(session_names(document_with(session=session))) == names


def first_sentence(events=(), **detectors):
    """The first sentence of a page about these events and detectors, without a reference."""
    run = SimpleNamespace(document=document_with(detectors=detectors), answers=(), oracle="", ranking=(), events=events)
    return RunView(run, "s").hero.sentence


def event_named(name, second):
    """An event of an effect, whose message is that it happened."""
    return EventRecord(stamp_ns=second, source="effect/x", name=name, time=float(second), message=f"{name} happened")


def test_first_sentence_counts_the_contacts_of_each_detector():
    """Nothing was compared: ``exact`` reported three contacts, ``hull`` one."""
    sentence = first_sentence(exact=detector_of("exact", contacts=3), hull=detector_of("hull", contacts=1))
    assert sentence == "3 contacts found by exact, 1 contact found by hull"


def test_first_sentence_without_detectors_is_the_weightiest_result():
    """``RESULT_NAMES`` lists names of events that are results of experiments, the weightiest first.

    It happens last here; the sentence is its message with a capital letter.
    """
    weightiest, second, *_ = RESULT_NAMES
    events = [event_named("other", 0), event_named(second, 1), event_named(weightiest, 2)]
    message = f"{weightiest} happened"
    assert first_sentence(events) == message[0].upper() + message[1:]


def test_first_sentence_without_results_counts_events_by_name():
    """A run without detectors whose only event, called "other", is no result of an experiment."""
    assert first_sentence([event_named("other", 0)]) == "other: 1"
