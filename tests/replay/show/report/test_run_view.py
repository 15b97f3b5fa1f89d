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


def test_right_spans_are_common_to_detector_and_reference():
    """Seconds, from the contacts that VIEW has of two pairs; without a pair all of them."""
    assert spans(VIEW, "hull", PAIR) == {
        "right": [(1, 2), (3, 4), (4.5, 4.6)], "missed": [(6, 7)], "late": [(0, 1)], "false": [],
    }  # fmt: skip
    assert spans(VIEW, "hull", OTHER_PAIR) == {"right": [(8.2, 9)], "missed": [], "late": [], "false": [(9, 9.5)]}
    assert len(spans(VIEW, "hull")["right"]) == 4 and spans(VIEW, "hull")["false"] == [(9, 9.5)]


def test_reference_and_unaudited_detector_have_spans_of_contact():
    """Spans are seconds of VIEW's contacts of the pair; without a reference nothing is wrong or right."""
    assert spans(VIEW, "exact", PAIR) == {"reference": [(0, 2), (3, 5), (6, 7)]}
    unaudited = RunView(SimpleNamespace(oracle="", contacts={"hull": [contact(1, 4)]}, faults={}), "s")
    assert spans(unaudited, "hull") == {"contact": [(1, 4)]}


@pytest.mark.parametrize(
    ("scene", "bodies", "facts", "stamp_ns", "names"),
    [
        ("Titration", "ab", {}, 0, ["Titration"]),
        ("", "ab", {}, 0, ["a and b"]),
        ("", "abc", {}, 0, ["a, b and 1 more"]),
        ("", "abcd", {"pseudonym": "S07"}, 0, ["a, b and 2 more", "S07"]),
        ("Titration", "ab", {"pseudonym": "not stated"}, FIRST_DATE_NS - 1, ["Titration"]),
    ],
)
def test_session_is_named_by_scene_or_bodies_and_pseudonym(scene, bodies, facts, stamp_ns, names):
    """``bodies``: a letter a body; ``stamp_ns``: of the first frame, too early for a date."""
    session = structs.replace(
        EMPTY.session, scene=scene, bodies=dict.fromkeys(bodies), facts=facts, first_stamp_ns=stamp_ns
    )
    assert session_names(document_with(session=session)) == names


def test_date_is_named_where_stamps_have_a_date():
    """Stamps from FIRST_DATE_NS on count from 1970: the page has the scene's name and a date."""
    session = structs.replace(EMPTY.session, scene="Titration", first_stamp_ns=FIRST_DATE_NS)
    assert len(session_names(document_with(session=session))) == 2


def hero_of(events=(), **detectors):
    """The first sentence of a page without an audit, of these events and detectors."""
    run = SimpleNamespace(document=document_with(detectors=detectors), answers=(), oracle="", ranking=(), events=events)
    return RunView(run, "s").hero.sentence


def test_first_sentence_counts_contacts_or_names_the_weightiest_result():
    """Without an audit: contacts of each detector; or the first of RESULT_NAMES that happened; or how many events."""
    events = [
        EventRecord(stamp_ns=k, source="effect/x", name=name, time=float(k), message=f"{name} happened")
        for k, name in enumerate(("other", RESULT_NAMES[1], RESULT_NAMES[0]))
    ]
    assert hero_of(exact=detector_of("exact", contacts=3), hull=detector_of("hull", contacts=1)) == (
        "3 contacts found by exact, 1 contact found by hull"
    )
    weightiest = f"{RESULT_NAMES[0]} happened"
    assert hero_of(events) == weightiest[0].upper() + weightiest[1:]
    assert hero_of(events[:1]) == "other: 1"
