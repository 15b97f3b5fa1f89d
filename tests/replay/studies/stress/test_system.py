"""Cases are counted under the right word, say why, and gate only what the detector promised."""

import numpy as np
import pytest
from support.stress_files import read_scenes

from cdcore import Verdict
from replay.errors import StressError
from replay.studies.stress import effect_cases, system
from replay.studies.stress.stress_runner import StressResult
from replay.studies.stress.system import CASES, CaseTally, cases_of, run_cases


def test_every_case_of_the_list_is_there():
    assert list(CASES) == list(range(27, 52))


@pytest.mark.parametrize("number", [number for number in CASES if number not in (29, 40)])
def test_exact_passes_or_speaks_of_frames(number):
    (one,) = run_cases(["exact"], [number])
    assert one.invented == one.within == one.refused == 0 and one.asked > 0
    assert (one.missed > 0) == (number in (30, 32, 33, 44, 48))
    assert one.promised == (number not in (30, 31, 32, 33, 44, 48))


def test_a_detector_of_intervals_misses_none_of_them():
    for one in run_cases(["continuous"], [30, 31, 32, 33, 41, 44, 48]):
        assert one.words == "passed" and one.promised and one.reason == "", one


def test_python_fcl_on_resting_glass_and_a_lattice_is_within_tolerance_and_without_tau_it_is_not():
    told = run_cases(["hybrid"], [41, 42])
    assert all(one.missed == one.invented == one.refused == 0 for one in told) and told[1].within > 0
    (strict,) = run_cases(["hybrid"], [42], tau=0.0)
    assert strict.within == 0 and strict.missed + strict.invented > 0


def test_who_cannot_tell_inside_from_outside_refuses_with_the_reason():
    (one,) = run_cases(["sphere"], [27])
    assert one.missed == one.invented == 0 and one.asked == 24
    assert one.refused + one.unconfirmed == 24


def test_peers_and_recordings_do_not_apply():
    assert [one.words for one in run_cases(["coal", "exact"], [40])] == ["does not apply"] * 2
    assert run_cases(["coal"], [27])[0].reason == "is asked about triangle pairs only"


def test_a_liar_is_counted_gated_and_written(tmp_path, monkeypatch):
    real = system._asked

    def lying(detector, scene):
        found = real(detector, scene)
        for one in found:
            one.verdict.flags.writeable = True
            one.verdict[:] = Verdict.CLEAR
        return found

    monkeypatch.setattr(system, "_asked", lying)
    (one,) = run_cases(["exact"], [27], out=tmp_path)
    assert one.missed == one.asked == 24
    (path,) = tmp_path.iterdir()
    assert one.file == str(path)
    assert sum(np.sum(back.scene.truth != back.said) for back in read_scenes(path)) == 24
    (sentence,) = StressResult(100, 1, 0.0, (), (), (one,)).broken
    assert sentence == "exact claims exactness and failed case 27 containment: 24 missed of 24"


def test_what_was_not_promised_breaks_no_gate():
    between = CaseTally("exact", 29, "thin-wall phases", 100, asked=9, missed=2, promised=False)
    assert StressResult(100, 1, 0.0, (), (), (between,)).broken == []


def test_effects_are_asked_once_whoever_else_is_and_what_they_get_wrong_breaks_the_gate(monkeypatch):
    told = run_cases(["exact", "coal"], [49, 50, 51])
    assert [(one.detector, one.words) for one in told] == [("effects", "passed")] * 3
    assert min(one.asked for one in told) >= 50
    monkeypatch.setattr(effect_cases, "volume_kept", lambda tilt, radius, height: 2.0 - tilt)
    monkeypatch.setattr(effect_cases, "cooled", lambda **given: 20.0)
    monkeypatch.setattr(effect_cases, "ph_of", lambda chemistry, amounts: np.array([7.0]))
    told = run_cases(["exact"], [49, 50, 51])
    assert all(0 < one.missed < one.asked for one in told)
    words = StressResult(100, 1, 0.0, (), (), told).broken[2]
    assert words.startswith(
        f"the effects failed case 51 level at the rim: {told[2].missed} of 52 wrong, 0.03 m by 0.1 m"
    )


def test_cases_are_named_by_number_and_range():
    assert cases_of("all") == list(CASES)
    assert (cases_of("27-28,41"), cases_of("27-")) == ([27, 28, 41], [27])
    for text in ("", "26", "52", "30-29", "x"):
        with pytest.raises(StressError, match="they go from 27 to 51"):
            cases_of(text)
