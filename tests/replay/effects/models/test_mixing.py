import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from replay.effects.models.colours import COLOURS, WATERY, blended
from replay.effects.models.mixing import Contents, mixture
from replay.effects.models.transfers import Ledger, Transfer, flows, total_ml
from replay.effects.models.warming import CALORIE_J, cooled, heat_given_off, warmed

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


def test_a_blend_begins_and_ends_at_its_colours_and_stays_between():
    shades = blended(COLOURS["red"], COLOURS["blue"], np.array([-1.0, 0.0, 0.5, 1.0, 9.0]))
    assert tuple(shades[0]) == tuple(shades[1]) == COLOURS["red"] and tuple(shades[3]) == tuple(shades[4])
    assert tuple(shades[4]) == COLOURS["blue"] and shades.dtype == np.uint8
    assert COLOURS["blue"][0] < shades[2][0] < COLOURS["red"][0]


def test_every_colour_can_be_seen():
    assert all(len(one) == 4 and one[3] > 100 and max(one) <= 255 for one in COLOURS.values())
    assert COLOURS["colourless"] == WATERY


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


DISH = {"capacity": 60.0, "loss": 0.4, "ambient": 20.0}


def test_it_nears_the_temperature_at_which_it_loses_what_it_gets():
    times = np.linspace(0.0, 5000.0, 7)
    celsius = warmed(times, np.full(7, 160.0), **DISH)
    assert celsius == pytest.approx(20.0 + 400.0 * (1 - np.exp(-times * 0.4 / 60.0)), rel=1e-12)


@given(st.lists(st.floats(1e-9, 1e3), min_size=1, max_size=20), st.floats(0.0, 100.0), st.floats(0.0, 1e3))
def test_it_does_not_matter_how_the_time_is_cut(steps, loss, power):
    told = {"capacity": 60.0, "loss": loss, "ambient": 20.0}
    times = np.concatenate([[0.0], np.cumsum(steps)])
    cut = warmed(times, np.full(len(times), power), **told)[-1]
    assert cut == pytest.approx(cooled(20.0, float(times[-1]), power_w=power, **told), rel=1e-9)


def test_without_loss_it_rises_evenly_and_a_tiny_loss_is_nearly_none():
    assert cooled(20.0, 30.0, power_w=60.0, capacity=60.0, loss=0.0, ambient=20.0) == 50.0
    tiny = cooled(20.0, 30.0, power_w=60.0, capacity=60.0, loss=1e-15, ambient=20.0)
    assert tiny == pytest.approx(50.0, rel=1e-12)


def test_no_time_changes_nothing_and_endless_time_ends_in_the_room():
    assert cooled(90.0, 0.0, power_w=5.0, **DISH) == 90.0
    assert cooled(90.0, 1e9, power_w=0.0, **DISH) == pytest.approx(20.0, abs=1e-9)


def test_an_acid_in_much_water_gives_all_and_in_none_nothing():
    heat = 17860 * CALORIE_J
    assert heat_given_off(1.0, 1e9, heat, 1.798) == pytest.approx(heat, rel=1e-8)
    assert heat_given_off(1.0, 1.798, heat, 1.798) == pytest.approx(heat / 2)
    assert [heat_given_off(*two, heat, 1.798) for two in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))] == [0.0, 0.0, 0.0]


@given(st.floats(0.0, 10.0), st.floats(0.0, 100.0), st.floats(0.0, 100.0))
def test_more_water_never_takes_heat_back(acid, water, more):
    assert heat_given_off(acid, water + more, 1.0, 1.8) >= heat_given_off(acid, water, 1.0, 1.8) * (1 - 1e-12)
