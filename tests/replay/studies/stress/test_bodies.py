"""Cases are counted under the right word, say why, and gate only what the detector promised."""

import pytest

from replay.studies.stress import bodies
from replay.studies.stress.bodies import CASES, ask_case
from replay.studies.stress.runner import stress
from replay.studies.stress.scenes import at, of_instants
from replay.studies.stress.solids import box_mesh
from replay.studies.stress.tally import StressResult


def run_cases(detectors, cases, **more):
    return stress(",".join(detectors), families=(), cases=cases, **more).tallies


@pytest.mark.parametrize("number", [number for number in CASES if number != 29])
def test_exact_passes_or_speaks_of_frames(number):
    (one,) = run_cases(["exact"], [number])
    assert one.invented == one.within == one.refused == one.changed == 0 and one.asked > 0
    assert (one.missed > 0) == (number in (30, 32, 33, 44, 48))
    assert one.promised == (number not in (30, 31, 32, 33, 44, 48))
    assert StressResult(100, 1, 0.0, (one,)).broken == []


def test_a_detector_of_intervals_misses_none_of_them():
    for one in run_cases(["continuous"], [30, 31, 32, 33, 41, 43, 44, 48]):
        assert one.words == "passed" and one.promised and one.reason == "", one


def test_python_fcl_errors_on_resting_glass_need_tau():
    told = run_cases(["hybrid"], [41, 42])
    assert all(one.missed == one.invented == one.refused == 0 for one in told) and told[1].within > 0
    (strict,) = run_cases(["hybrid"], [42], tau=0.0)
    assert strict.within == 0 and strict.missed + strict.invented > 0


def test_missed_contact_is_within_tolerance_only_when_no_deeper():
    slab = box_mesh((8.0, 8.0, 1.0))
    # Of cubes that share planes every two faces meet 0 deep, though the cubes are in each other by a half.
    for other, place, within in (
        (slab, [0.1, 0.2, 0.995], 1), (slab, [0.1, 0.2, 0.985], 0), (box_mesh(), [0.5, 0.0, 0.0], 0),
    ):  # fmt: skip
        scene = of_instants("", (box_mesh(), other), at([place]))
        one = ask_case("support.planted_detectors:Blamed", 41, [scene], seed=0, tau=0.01)
        assert (one.within, one.missed, one.reason) == (within, 1 - within, "")


def test_who_cannot_tell_inside_from_outside_refuses_with_the_reason():
    (one,) = run_cases(["sphere"], [27])
    assert one.missed == one.invented == 0 and one.asked == 24
    assert one.refused + one.unconfirmed == 24


def test_an_answer_that_depends_on_blocks_is_seen(monkeypatch):
    monkeypatch.setattr(bodies, "join", lambda parts: parts[0])
    (one,) = run_cases(["exact"], [43])
    assert (one.asked, one.changed) == (4, 3) and "blocks 1" in one.reason
    assert len(StressResult(100, 1, 0.0, (one,)).broken) == 1
