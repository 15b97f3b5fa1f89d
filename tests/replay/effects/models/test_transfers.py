import math

from hypothesis import given
from hypothesis import strategies as st

from replay.effects.models.transfers import Ledger, Transfer, flows, total_ml

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
