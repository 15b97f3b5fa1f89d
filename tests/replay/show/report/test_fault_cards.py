"""The order of faults on a page, and those that have a picture."""

from types import SimpleNamespace

import pytest
from support.report_states import audit_of, document_with

from replay.auditing.fault import Cause, Fault, FaultKind
from replay.show.report import fault_cards
from replay.show.report.fault_cards import MOST_PAIRS, card, cards


def fault_of(number, body, depth, kind=FaultKind.NEVER_REPORTED):
    """A fault of the detector ``hull`` about a cup and another body, so many metres deep."""
    return Fault(number, "hull", 0, ("cup", body), kind, 3, 4, 0.3, 0.5, 3, depth=depth)


def numbers_and_pictures(monkeypatch, faults, moment=None):
    """The number of every fault of each pair, in their order, and whether it has a picture."""
    monkeypatch.setattr(fault_cards, "card", lambda view, fault, *, with_picture: (fault.number, with_picture))
    view = SimpleNamespace(answers=[SimpleNamespace(label="hull", moment=moment)], faults={"hull": faults})
    return cards(view, "hull")


def test_worst_fault_of_the_first_pairs_has_a_picture(monkeypatch):
    """One pair more than have pictures, each with a shallower fault than the pair before, and a second one."""
    faults = [fault_of(k, f"rod{k}", 0.9 - 0.01 * k) for k in range(MOST_PAIRS + 1)]
    seconds = [fault_of(100 + k, f"rod{k}", 0.1) for k in range(MOST_PAIRS + 1)]
    drawn = numbers_and_pictures(monkeypatch, [*seconds, *faults])
    assert drawn == [[(k, k < MOST_PAIRS), (100 + k, False)] for k in range(MOST_PAIRS + 1)]


@pytest.mark.parametrize(
    ("kind", "number", "order"),
    [("miss", 2, [2, 1, 3]), ("false", 3, [3, 1, 2])],
)
def test_fault_of_the_answer_comes_first_and_its_kind_next(kind, number, order, monkeypatch):
    """Misses 1 and 2, the first the deepest, and the false contact 3."""
    faults = [fault_of(1, "rod", 0.3), fault_of(2, "rod", 0.2), fault_of(3, "rod", 0.1, FaultKind.NO_CONTACT)]
    (pair,) = numbers_and_pictures(monkeypatch, faults, SimpleNamespace(kind=kind, number=number))
    assert [number for number, _ in pair] == order


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


@pytest.mark.parametrize(("end", "window"), [(6.0, (3.3, 6.7)), (4.1, (3.9, 4.2))])
def test_lanes_of_a_card_reach_beyond_its_fault(end, window):
    """A fault from 4 s on: 35 % of its length on both sides, and at least 0.1 s."""
    fault = Fault(1, "hull", 0, ("cup", "rod"), FaultKind.NEVER_REPORTED, 3, 4, 4.0, end, 3)
    lanes = card(view_of_detectors("hull"), fault).lanes
    assert [name for name, _ in lanes] == ["exact", "hull"]
    for name, lane in lanes:
        assert lane.length == pytest.approx(window[1] - window[0])
        assert lane.words == f"{name} from {window[0]:.3f} to {window[1]:.3f} s"


def test_commands_name_the_detector_if_several_ran():
    """The fault is miss 2 of ``hull``; an address names its detector unless that is the first."""
    fault = fault_of(2, "rod", 0.1)
    commands = [card(view_of_detectors(*labels), fault).command for labels in (["hull"], ["hull", "mesh"])]
    assert commands == ["replay view . --miss 2", "replay view . --miss 2 --by hull"]
    first, second = (card(view_of_detectors(*labels), fault) for labels in (["hull", "mesh"], ["mesh", "hull"]))
    assert "hull" not in first.address and "hull" in second.address


def test_only_cards_with_a_picture_have_lanes_and_a_still():
    """The first picture of a page is larger and has no lanes; a run without stills has no picture."""
    view, fault = view_of_detectors("hull"), fault_of(2, "rod", 0.1)
    with_picture, without, large = (
        card(view, fault, **options) for options in ({}, {"with_picture": False}, {"is_first_picture": True})
    )
    assert (with_picture.picture, without.picture, large.picture) == (
        str(fault_cards.CARD_SIZE),
        "",
        str(fault_cards.FIRST_SIZE),
    )
    assert [len(drawn.lanes) for drawn in (with_picture, without, large)] == [2, 0, 0]
    view.still = None
    assert card(view, fault).picture == ""


@pytest.mark.parametrize(("why", "text"), [("The rod passed.", "The rod passed."), ("", Cause.NOT_EXAMINED.value)])
def test_card_explains_a_fault_or_names_its_cause(why, text):
    """``why``: the sentence of the fault, which one that was not examined has not."""
    fault = Fault(1, "hull", 0, ("cup", "rod"), FaultKind.NEVER_REPORTED, 3, 4, 0.3, 0.5, 3, why=why)
    assert card(view_of_detectors("hull"), fault).why == text
