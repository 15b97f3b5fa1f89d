"""The runner counts each wrong answer once, under the right word, and its gate knows who promised what."""

from contextlib import contextmanager
from types import SimpleNamespace

import numpy as np
import pytest
from support.stress_files import read_cases

from cdcore import Verdict
from cdcore.errors import UnknownDetectorError
from cdcore.narrow.triangles.predicates import triangles_intersect
from replay.errors import StressError
from replay.studies.stress import stress_runner as runner
from replay.studies.stress.families import FAMILIES, Family
from replay.studies.stress.stress_runner import NOT_IN_ALL, detectors_of, families_of, stress, tally_of

FLOOR = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


def above(height):
    return [FLOOR, [[0.2, 0.2, height], [0.3, 0.2, 1], [0.2, 0.3, 1]]]


PAIRS = np.array([above(-0.1), above(0.1), above(-1e-6), above(1e-6), above(-0.1), above(0.1)], dtype=float)
TRUTH = np.array([True, False, True, False, True, False])
OPPOSITE = np.where(TRUTH, Verdict.CLEAR, Verdict.CONTACT).astype(np.uint8)


def counted(family=FAMILIES[0], verdict=OPPOSITE, tau=2e-6, **more):
    tally = tally_of("planted", family, 5, PAIRS, TRUTH, verdict, tau=tau, **more)
    return tally.missed, tally.invented, tally.within, tally.refused, tally.unconfirmed


def test_the_planted_pairs_have_the_truth_they_are_given():
    assert np.array_equal(triangles_intersect(PAIRS), TRUTH)


def test_wrong_answers_about_less_than_tau_stand_in_their_own_column():
    assert counted() == (2, 2, 2, 0, 0)
    assert counted(tau=0.0) == (3, 3, 0, 0, 0)
    assert counted(tau=0.5e-6) == (3, 3, 0, 0, 0)


def test_where_coordinates_are_not_metres_there_is_no_tolerance():
    assert counted(FAMILIES[13]) == (3, 3, 0, 0, 0)


def test_a_right_answer_is_counted_nowhere():
    assert counted(verdict=np.where(TRUTH, Verdict.CONTACT, Verdict.CLEAR).astype(np.uint8)) == (0, 0, 0, 0, 0)


def test_refusals_and_overlapping_volumes_are_neither_missed_nor_invented():
    verdict = np.array(
        [Verdict.INVALID, Verdict.CANDIDATE, Verdict.UNRESOLVED, Verdict.CLEAR, Verdict.CANDIDATE, Verdict.NOT_FOUND],
        dtype=np.uint8,
    )
    assert counted(verdict=verdict) == (0, 0, 0, 2, 1)


def test_failing_pairs_are_written_and_those_within_tolerance_are_not(tmp_path):
    tally = tally_of("planted", FAMILIES[0], 5, PAIRS, TRUTH, OPPOSITE, tau=2e-6, out=tmp_path)
    cases = read_cases(tmp_path / "family-01-planted-seed-5.npz")
    assert tally.file == str(tmp_path / "family-01-planted-seed-5.npz")
    assert cases.row.tolist() == [0, 1, 4, 5]
    assert np.array_equal(cases.triangles, PAIRS[[0, 1, 4, 5]])


def test_exact_is_right_on_a_sample_of_every_family():
    result = stress("exact", pairs=20, seed=4_711)
    assert [tally.failed for tally in result.tallies] == [0] * 26
    assert result.broken == []


def test_python_fcl_behind_hybrid_is_wrong_where_products_overflow_and_within_tolerance_on_points(tmp_path):
    points, overflow = stress("hybrid", families=families_of("10,16"), pairs=300, out=tmp_path).tallies
    assert points.within > 50 and points.missed == points.invented == 0
    assert overflow.missed > 5 and overflow.invented > 5 and overflow.within == 0
    assert [path.name for path in tmp_path.iterdir()] == ["family-16-hybrid-seed-100.npz"]


def test_a_detector_that_claims_exactness_and_lies_breaks_the_gate(monkeypatch):
    monkeypatch.setattr(runner, "answers_of", lambda name, pairs: np.zeros(len(pairs), dtype=np.uint8))
    result = stress("exact", families=families_of("3"), pairs=9)
    assert result.broken == ["exact claims exactness and failed 9 of 9 pairs of 03 shared vertex (seed 100)"]


def test_all_means_every_row_that_decides_on_meshes_and_the_peers_that_are_there(monkeypatch):
    monkeypatch.setattr(runner, "installed_peers", lambda: ["coal"])
    monkeypatch.setattr(runner, "detector_names", lambda: ["sphere", "hybrid", "exact", "a-new-row"])
    assert "sphere" in NOT_IN_ALL
    assert detectors_of("all") == ["hybrid", "exact", "a-new-row", "coal"]


def test_a_name_that_means_nothing_is_refused(monkeypatch):
    monkeypatch.setattr(runner, "installed_peers", list)
    with pytest.raises(StressError, match="coal is not installed"):
        detectors_of("coal")
    with pytest.raises(UnknownDetectorError, match="there are: sphere"):
        detectors_of("spoon")


@pytest.mark.parametrize(
    ("text", "numbers"),
    [("01-26", list(range(1, 27))), ("9", [9]), ("3-5,12", [3, 4, 5, 12]), ("12,12", [12]), ("1-", [1])],
)
def test_families_are_named_by_number_and_range(text, numbers):
    assert [family.number for family in families_of(text)] == numbers


@pytest.mark.parametrize("text", ["", "x", "0", "27", "5-3", "1-99"])
def test_a_family_that_is_none_is_refused(text):
    with pytest.raises(StressError):
        families_of(text)


@pytest.mark.parametrize("bad", [{"pairs": 0}, {"seed": -1}, {"tau": -1.0}, {"tau": float("nan")}])
def test_numbers_that_mean_nothing_are_refused(bad):
    with pytest.raises(StressError, match="give 1 pair or more"):
        stress("exact", families=FAMILIES[:1], **({"pairs": 1} | bad))


def test_progress_is_told_of_every_family_of_every_detector():
    told = []

    @contextmanager
    def stage(name, total=None, unit="frames"):
        told.append((name, total))
        yield told.append

    stress("exact", families=FAMILIES[:3], pairs=2, progress=SimpleNamespace(stage=stage))
    assert told == [("stress", 3), 1, 1, 1]


def test_a_family_of_nobody_can_be_asked_too():
    far_apart = Family(99, "apart", lambda rng, n: rng.random((n, 6, 3)) + np.repeat([0, 9], 3)[:, None], False)
    tally = stress("exact", families=[far_apart], pairs=7).tallies[0]
    assert (tally.number, tally.failed, tally.pairs) == (99, 0, 7)
