import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from replay.effects.models.mixing import Contents, mixture
from replay.effects.models.transfers import Transfer

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
