import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from replay.effects.models.transfers import Contents, Ledger, Transfer, flows, mixture, total_ml

NOWHERE = (0.0, 0.0, 0.0)


def drop(time, volume=0.1, source="a", target="b"):
    return Transfer(round(time * 100), time, source, target, volume, NOWHERE)


def test_a_pause_splits_a_flow_and_a_shorter_one_does_not():
    parts = flows([drop(0.0), drop(0.2), drop(0.6)], gap_s=0.3, least_ml=0.0)
    assert [[one.time for one in part] for part in parts] == [[0.0, 0.2], [0.6]]


def test_what_goes_elsewhere_is_another_flow_at_the_same_time():
    parts = flows([drop(0.0), drop(0.0, target=""), drop(0.1), drop(0.1, target="")], 0.0, 0.3)
    assert [(part[0].target, len(part)) for part in parts] == [("", 2), ("b", 2)]


def test_less_than_a_flow_is_none():
    assert flows([drop(0.0, 0.02), drop(0.1, 0.02)], 0.05, 0.3) == []
    assert len(flows([drop(0.0, 0.03), drop(0.1, 0.03)], 0.05, 0.3)) == 1


@given(st.lists(st.tuples(st.sampled_from("abc"), st.sampled_from(["a", "b", "c", ""]), st.floats(0.0, 1e3))))
def test_the_ledger_neither_makes_nor_loses_liquid(moves):
    ledger = Ledger({"a": 100.0, "b": 0.0, "c": 1e-6})
    for source, target, volume in moves:
        ledger.move(drop(0.0, volume, source, target))
    there = math.fsum(ledger.volume_ml.values()) + ledger.spilled_ml
    assert abs(there - 100.000001) <= 1e-9 * (100.0 + total_ml(ledger.transfers))


TIMES = np.arange(100) * 0.1


def move(frame, volume, source="a", target="b"):
    return Transfer(frame, frame * 0.1, source, target, volume, (0.0, 0.0, 0.0))


def two():
    return {"a": Contents(50.0, {"HCl": 0.005}), "b": Contents(50.0, {"NaOH": 0.01}, {"Zn": 0.1})}


def test_a_part_carries_its_share_and_a_solid_stays():
    mixed = mixture(two(), [move(10, 10.0), move(20, 30.0, "b", "a")], TIMES)
    b = mixed.histories["b"]
    assert b.volume_ml.tolist() == [50.0, 60.0, 30.0, 30.0] and b.added_ml.tolist() == [0.0, 10.0, 10.0, 10.0]
    assert b.amount("HCl").tolist() == pytest.approx([0.0, 0.001, 0.0005, 0.0005])
    assert b.amount("NaOH").tolist() == pytest.approx([0.01, 0.01, 0.005, 0.005])
    assert b.amount("Zn").tolist() == [0.1] * 4 and b.amount("KCl").tolist() == [0.0] * 4
    assert mixed.loads[1].amounts["NaOH"] == pytest.approx(0.005) and mixed.loads[1].before_ml == 40.0


def test_pouring_all_leaves_exactly_nothing():
    mixed = mixture(two(), [move(1, 50.0)], TIMES)
    assert mixed.histories["a"].amount("HCl")[-1] == 0.0 and mixed.histories["a"].volume_ml[-1] == 0.0
    again = mixture(two(), [move(1, 50.0), move(2, 0.0)], TIMES)
    assert again.histories["b"].amount("HCl")[-1] == 0.005


@given(st.lists(st.tuples(st.sampled_from("ab"), st.sampled_from(["a", "b", ""]), st.floats(0.0, 1.0)), max_size=40))
def test_amounts_and_volumes_are_conserved_with_what_is_spilled(moves):
    initial, transfers = two(), []
    there = {"a": 50.0, "b": 50.0}
    for frame, (source, target, share) in enumerate(moves):
        volume = share * there[source]
        there[source] -= volume
        if target:
            there[target] += volume
        transfers.append(move(frame, volume, source, target))
    mixed = mixture(initial, transfers, TIMES)
    spilled = [load for load in mixed.loads if not load.transfer.target]
    volume = sum(one.volume_ml[-1] for one in mixed.histories.values()) + sum(x.transfer.volume_ml for x in spilled)
    assert volume == pytest.approx(100.0, rel=1e-9)
    for formula, amount in (("HCl", 0.005), ("NaOH", 0.01)):
        inside = sum(one.amount(formula)[-1] for one in mixed.histories.values())
        assert inside + sum(x.amounts.get(formula, 0.0) for x in spilled) == pytest.approx(amount, rel=1e-9)
        assert all((one.amount(formula) >= -1e-18).all() for one in mixed.histories.values())


def test_without_frames_there_is_no_history():
    assert len(mixture(two(), [], TIMES[:0]).histories["a"].times) == 0
