"""The order of faults on a page, and those that have a picture."""

from dataclasses import replace
from math import nan
from types import SimpleNamespace

import pytest
from support.report_states import audit_of, document_with

from replay.auditing.fault import Cause, Fault, FaultKind
from replay.show.report import fault_cards
from replay.show.report.fault_cards import CARD_SIZE, FIRST_SIZE, MOST_PAIRS, card, cards, fault_counts, first_fault


def fault_of(number, body="rod", depth=nan, kind=FaultKind.NEVER_REPORTED, start=0.3, end=0.5, why=""):
    """A fault of the detector ``hull`` about a cup and another body, so many metres deep, from second to second."""
    return Fault(
        number=number, detector="hull", pair=0, bodies=("cup", body), kind=kind, first=3, last=4, start=start, end=end,
        frame=3, depth=depth, why=why,
    )  # fmt: skip


def numbers_and_pictures(monkeypatch, faults, answer_moment=None):
    """(number, whether it has a picture) of each fault on a page, in order, a list a pair.

    ``answer_moment``: kind and number of the fault that the first answer of the page is about.
    """
    monkeypatch.setattr(fault_cards, "card", lambda view, fault, *, with_picture: (fault.number, with_picture))
    view = SimpleNamespace(answers=[SimpleNamespace(label="hull", moment=answer_moment)], faults={"hull": faults})
    return cards(view, "hull")


def test_worst_fault_of_the_first_pairs_has_a_picture(monkeypatch):
    """Six pairs get pictures; there are seven, cup and rod0 to rod6, with two misses each.

    The deep one of a pair is 1 cm shallower than that of the pair before, 0.9 m for rod0; the other is 0.1 m deep.
    """
    pairs = range(MOST_PAIRS + 1)
    deep = [fault_of(number=k, body=f"rod{k}", depth=0.9 - 0.01 * k) for k in pairs]
    shallow = [fault_of(number=100 + k, body=f"rod{k}", depth=0.1) for k in pairs]
    drawn = numbers_and_pictures(monkeypatch, [*shallow, *deep])
    with_pictures = [[(k, True), (100 + k, False)] for k in range(MOST_PAIRS)]
    without_picture = [(MOST_PAIRS, False), (100 + MOST_PAIRS, False)]
    assert drawn == [*with_pictures, without_picture]


@pytest.mark.parametrize(
    ("kind", "number", "order"),
    [
        pytest.param("miss", 2, [2, 1, 3], id="answer is miss 2"),
        pytest.param("false", 3, [3, 1, 2], id="answer is false contact 3"),
    ],
)
def test_fault_of_the_answer_comes_first_and_its_kind_next(kind, number, order, monkeypatch):
    """Misses 1 and 2 are 0.3 and 0.2 m deep, and there is a false contact 3; all are of one pair.

    The fault that the answer is about leads, then others of its kind, then the other kind, each the deepest first.
    """
    faults = [
        fault_of(1, depth=0.3),
        fault_of(2, depth=0.2),
        fault_of(3, depth=0.1, kind=FaultKind.NO_CONTACT),
    ]
    (faults_of_pair,) = numbers_and_pictures(monkeypatch, faults, SimpleNamespace(kind=kind, number=number))
    assert [number for number, _has_picture in faults_of_pair] == order


def view_of_detectors(*labels):
    """A page of a run of these detectors without any contact, whose stills are named after their size."""
    return SimpleNamespace(
        document=document_with(audit={label: audit_of() for label in labels}),
        answers=labels,
        folder=".",
        oracle="exact",
        contacts={label: [] for label in ("exact", *labels)},
        faults={label: [] for label in labels},
        still=lambda label, fault, size: (str(size), "red"),
    )


@pytest.mark.parametrize(
    ("end", "lane_start", "lane_end"),
    [
        pytest.param(6.0, 4.0 - 0.7, 6.0 + 0.7, id="fault of 2 s"),
        pytest.param(4.1, 4.0 - 0.1, 4.1 + 0.1, id="fault of 0.1 s"),
    ],
)
def test_lanes_of_a_card_reach_beyond_its_fault(end, lane_start, lane_end):
    """A fault of ``hull`` begins at 4 s; its card has a lane of the reference (exact) and one of the detector.

    Both show 35 % of the length of the fault before and after it, and at least 0.1 s.
    """
    lanes = card(view_of_detectors("hull"), fault_of(1, start=4.0, end=end)).lanes
    assert [name for name, _ in lanes] == ["exact", "hull"]
    for name, lane in lanes:
        assert lane.length == pytest.approx(lane_end - lane_start)
        assert lane.words == f"{name} from {lane_start:.3f} to {lane_end:.3f} s"


@pytest.mark.parametrize(
    ("detectors", "command"),
    [
        pytest.param(["hull"], "replay view . --miss 2", id="alone"),
        pytest.param(["hull", "mesh"], "replay view . --miss 2 --by hull", id="of two"),
    ],
)
def test_commands_name_the_detector_if_several_ran(detectors, command):
    """The card of a fault on a page has the command that shows it in the viewer: miss 2 of the detector ``hull``."""
    assert card(view_of_detectors(*detectors), fault_of(2)).command == command


@pytest.mark.parametrize(
    ("detectors", "names_hull"),
    [
        pytest.param(["hull", "mesh"], False, id="hull is the first"),
        pytest.param(["mesh", "hull"], True, id="hull is the second"),
    ],
)
def test_address_names_the_detector_unless_it_is_the_first(detectors, names_hull):
    """A card has an address, by which links lead to its fault: here miss 2 of ``hull``, one of two detectors."""
    assert ("hull" in card(view_of_detectors(*detectors), fault_of(2)).address) == names_hull


def test_only_cards_with_a_picture_have_lanes_and_a_still():
    """Pictures of this view are named after their size. Two lanes: of the reference and of the detector ``hull``.

    The card with the first picture of a page, which is larger, has none.
    """
    rows = {
        "card with a picture": ({}, str(CARD_SIZE), 2),
        "card without": ({"with_picture": False}, "", 0),
        "first, large picture of a page": ({"is_first_picture": True}, str(FIRST_SIZE), 0),
    }
    for row, (options, picture, lanes) in rows.items():
        made_card = card(view_of_detectors("hull"), fault_of(2), **options)
        assert made_card.picture == picture, row
        assert len(made_card.lanes) == lanes, row


def test_card_of_a_run_without_stills_has_no_picture():
    """A page draws the picture of a fault by the function ``still`` of its view; here there is none (None)."""
    view = view_of_detectors("hull")
    view.still = None
    assert card(view, fault_of(2)).picture == ""


@pytest.mark.parametrize(
    ("why", "text"),
    [
        pytest.param("The rod passed.", "The rod passed.", id="explained"),
        pytest.param("", Cause.NOT_EXAMINED.value, id="not examined"),
    ],
)
def test_card_explains_a_fault_or_names_its_cause(why, text):
    """A card prints the sentence that explains its fault (``why``); without one, that nobody examined it."""
    assert card(view_of_detectors("hull"), fault_of(1, why=why)).why == text


MISS, LATE = fault_of(1), fault_of(2, kind=FaultKind.REPORTED_LATE)
FALSE = fault_of(1, kind=FaultKind.NO_CONTACT)
UNCONFIRMED = replace(FALSE, cause=Cause.BOUNDING_VOLUMES)


def test_faults_of_a_detector_are_counted_by_kind():
    """``others``: faults of another detector; a contact of bounding volumes alone is unconfirmed.

    Counts of the other detector are over 16 start times of sampling, of which a note says which one its moments are of;
    ``hull`` was counted once, and needs no note.
    """
    for faults, others, text in (
        ([MISS], [], "1 fault: 1 missed."),
        ([MISS, LATE], [], "2 faults: 1 missed, 1 late or cut short. Missed and late contacts share their numbers"),
        ([MISS, FALSE], [MISS], "2 of the 3 faults of this run: 1 false contact, 1 missed."),
        ([MISS, UNCONFIRMED], [], "2 faults: 1 unconfirmed contact, 1 missed."),
    ):
        ranks = [SimpleNamespace(label="other", phases=16), SimpleNamespace(label="hull", phases=1)]
        view = SimpleNamespace(faults={"hull": faults, "other": others}, ranking=ranks)
        counted = fault_counts(view, "hull")
        assert counted.startswith(text), text
        assert "start time of sampling" not in counted, text
        assert "start time of sampling" in fault_counts(view, "other"), text


def test_first_fault_is_that_of_the_first_answer(monkeypatch):
    """Miss 1, false contact 1 and the late contact 2 of a detector, found by kind and number; there is no miss 3.

    An answer without a moment is about none.
    """
    monkeypatch.setattr(fault_cards, "card", lambda view, fault, *, is_first_picture: fault)
    for kind, number, fault in (("miss", 1, MISS), ("false", 1, FALSE), ("miss", 2, LATE), ("miss", 3, None)):
        answer = SimpleNamespace(label="hull", moment=SimpleNamespace(kind=kind, number=number))
        view = SimpleNamespace(answers=[answer], faults={"hull": [MISS, FALSE, LATE]})
        assert first_fault(view) is fault
    assert first_fault(SimpleNamespace(answers=[SimpleNamespace(moment=None)])) is None
