"""Sums are sums of what is below them, and a zero is a dot."""

from rich.console import Console

from replay.cli.stress_tables import stress_tables
from replay.stress.flips import Flips
from replay.stress.runner import StressResult, Tally
from replay.stress.system import CaseTally


def shown(*tallies, **more):
    console = Console(width=120)
    with console.capture() as captured:
        console.print(stress_tables(StressResult(100, 40, 2e-6, tallies, **more)))
    return [line.split() for line in captured.get().splitlines() if line.strip()]


def tally(detector, number, missed=0, invented=0, within=0, refused=0, file=None):
    return Tally(detector, number, "name", 100, 40, missed, invented, within, refused, 0, file)


def test_the_sums_of_a_detector_stand_above_its_families():
    rows = shown(tally("a", 1, 2, 3), tally("a", 2, 5), tally("b", 1, within=4), tally("b", 2, refused=1))
    assert ["a", "80", "7", "3", "·", "·", "·"] in rows
    assert ["b", "80", "·", "·", "4", "1", "·"] in rows
    assert ["01", "name", "2", "+", "3", "~", "4"] in rows
    assert ["02", "name", "5", "+", "0", "!", "1"] in rows


def test_one_detector_has_one_table_with_its_sums_at_the_foot():
    rows = shown(tally("a", 1, 2, 3), tally("a", 2, 5, file="x.npz"))
    assert ["01", "name", "2", "3", "·", "·", "·"] in rows
    assert ["all", "7", "3", "·", "·", "·"] in rows
    assert ["x.npz"] in rows


def test_only_families_and_detectors_that_failed_are_crossed():
    rows = shown(tally("a", 1), tally("a", 2, 5), tally("b", 1), tally("b", 2))
    assert ["02", "name", "5", "+", "0"] in rows
    assert not any(row[:2] == ["01", "name"] for row in rows)
    assert ["family", "a"] in rows


def test_flips_are_summed_over_families_which_are_named_behind():
    flips = [
        Flips("a", relation, family, "name", 100, 40, family, 0) for relation in ("swap", "axes") for family in (1, 2)
    ]
    flips += [
        Flips("b", relation, family, "name", 100, 40, 0, family // 2)
        for relation in ("swap", "axes")
        for family in (1, 2)
    ]
    rows = shown(flips=tuple(flips))
    assert ["a", "3", "3", "01", "02"] in rows
    assert ["b", "·", "!", "1", "·", "!", "1", "02"] in rows
    assert ["of", "80", "pairs"] in rows


def test_a_case_has_a_row_for_each_answer_given_to_it():
    cases = [CaseTally(name, 28, "cavity", 100, asked=7) for name in "ab"]
    cases += [
        CaseTally("a", 29, "wall", 100, asked=9, missed=2, reason="why"),
        CaseTally("b", 29, "wall", 100, asked=9),
    ]
    cases += [CaseTally("c", number, "x", 100, reason="triangles", applies=False) for number in (28, 29)]
    rows = shown(cases=tuple(cases))
    assert [row for row in rows if "c" in row] == [["all", "of", "them", "·", "does", "not", "apply", "c", "triangles"]]
    assert ["28", "cavity", "7", "passed", "all"] in rows
    assert ["29", "wall", "9", "2", "missed", "a", "why"] in rows
    assert ["9", "passed", "b"] in rows
