"""The order of faults on a page, and those that have a picture."""

from types import SimpleNamespace

import pytest

from replay.auditing.fault import Fault, FaultKind
from replay.show.report import fault_cards
from replay.show.report.fault_cards import MOST_PAIRS, cards


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
