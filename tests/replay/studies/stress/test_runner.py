"""The runner counts each wrong answer once, under the right word, and its gate knows who promised what."""

import sys

import numpy as np
import pytest
from support.optional import read_cases
from support.processes import Watched
from support.shapes import triangle_family

from cdcore import Verdict
from cdcore.errors import InvalidSettingError, MissingEngineError, UnknownDetectorError
from cdcore.triangles.decide import triangles_intersect
from replay.errors import OutputError, StressError
from replay.studies.stress import runner
from replay.studies.stress.bodies import CASE_NAMES, REPEATED_CASE
from replay.studies.stress.families import FAMILIES
from replay.studies.stress.runner import detectors_of, family_tally, numbers_of, stress

FLOOR = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
"""Corners of a triangle, in metres."""

CAVITY = 28
"""Number of the hard case of bodies in a closed cavity."""


def floor_and_triangle(height):
    """The floor, and a triangle of which the lowest corner is at this height, and the others at 1 m."""
    return [FLOOR, [[0.2, 0.2, height], [0.3, 0.2, 1], [0.2, 0.3, 1]]]


PAIRS_ABOVE_AND_BELOW = np.array(
    [
        floor_and_triangle(height=-0.1),
        floor_and_triangle(height=0.1),
        floor_and_triangle(height=-1e-6),
        floor_and_triangle(height=1e-6),
        floor_and_triangle(height=-0.1),
        floor_and_triangle(height=0.1),
    ],
    dtype=float,
)
"""Six pairs, of which every other one meets; the third and the fourth by 1 um only."""
TRUTH = np.array([True, False, True, False, True, False])
OPPOSITE_OF_TRUTH = np.where(TRUTH, Verdict.CLEAR, Verdict.CONTACT).astype(np.uint8)
RIGHT_VERDICTS = np.where(TRUTH, Verdict.CONTACT, Verdict.CLEAR).astype(np.uint8)
MIXED_VERDICTS = np.array(
    [
        Verdict.INVALID,  # refused
        Verdict.CANDIDATE,  # volumes meet, faces do not: unconfirmed
        Verdict.UNRESOLVED,  # refused
        Verdict.CLEAR,  # right
        Verdict.CANDIDATE,  # volumes meet, and so do faces: right
        Verdict.NOT_FOUND,  # right
    ],
    dtype=np.uint8,
)


@pytest.mark.parametrize(
    ("family", "verdicts", "tau", "counts"),
    [
        pytest.param("generic control", OPPOSITE_OF_TRUTH, 2e-6, {"missed": 2, "invented": 2, "within": 2}, id="wrong"),
        pytest.param("generic control", OPPOSITE_OF_TRUTH, 0.0, {"missed": 3, "invented": 3}, id="no tolerance"),
        pytest.param("generic control", OPPOSITE_OF_TRUTH, 0.5e-6, {"missed": 3, "invented": 3}, id="tolerance < 1 um"),
        pytest.param("tiny", OPPOSITE_OF_TRUTH, 2e-6, {"missed": 3, "invented": 3}, id="family not in metres"),
        pytest.param("generic control", RIGHT_VERDICTS, 2e-6, {}, id="right"),
        pytest.param("generic control", MIXED_VERDICTS, 2e-6, {"refused": 2, "unconfirmed": 1}, id="not decided"),
    ],
)
def test_an_answer_is_counted_once_under_the_right_word(family, verdicts, tau, counts):
    """Verdicts about six pairs, two of which meet or part by 1 um only; tau is a tolerance in metres.

    Counts that are not named are 0; every count but "unconfirmed" is a failure.
    """
    assert np.array_equal(triangles_intersect(PAIRS_ABOVE_AND_BELOW), TRUTH)
    any_seed = 5
    tally = family_tally(
        "planted", triangle_family(family), any_seed, PAIRS_ABOVE_AND_BELOW, truth=TRUTH, verdict=verdicts, tau=tau
    )
    count_names = ("missed", "invented", "within", "refused", "unconfirmed")
    assert {name: getattr(tally, name) for name in count_names} == dict.fromkeys(count_names, 0) | counts
    assert tally.failed == sum(count for name, count in counts.items() if name != "unconfirmed")


def test_progress_counts_families_and_cases():
    """One detector, two families and one case: 3 of 3 questions are done."""
    watched = Watched()
    stress("exact", families=FAMILIES[:2], cases=[CAVITY], pairs=2, progress=watched)
    total, done = watched.stages["stress"]
    assert (total, done) == (3, 3)


@pytest.fixture
def wrong_answers():
    """Arguments of ``family_tally``: a detector that is wrong about all six pairs; tau is 2 um, two are within it."""
    return {
        "detector": "lab.engine:Planted",
        "family": triangle_family("generic control"),  # number 1
        "seed": 5,
        "triangles": PAIRS_ABOVE_AND_BELOW,
        "truth": TRUTH,
        "verdict": OPPOSITE_OF_TRUTH,
        "tau": 2e-6,
    }


def test_failing_triangle_pairs_beyond_tolerance_are_written(wrong_answers, tmp_path):
    """A detector is wrong about six pairs of triangles; rows 2 and 3 are within tau, the other four in one file.

    Its name has family 1, the detector in small letters with - for other signs, and seed 5.
    """
    tally = family_tally(**wrong_answers, out=tmp_path / "new")
    path = tmp_path / "new" / "family-01-lab-engine-planted-seed-5.npz"
    assert [*path.parent.iterdir()] == [path] and tally.file == str(path)
    cases = read_cases(path)
    assert (cases.detector, cases.family, cases.seed, cases.count) == ("lab.engine:Planted", 1, 5, 6)
    assert cases.row.tolist() == [0, 1, 4, 5]
    assert cases.triangles.tobytes() == PAIRS_ABOVE_AND_BELOW[[0, 1, 4, 5]].tobytes()
    assert np.array_equal(cases.truth, TRUTH[cases.row])
    assert np.array_equal(cases.verdict, OPPOSITE_OF_TRUTH[cases.row])


def test_file_in_place_of_the_output_folder_is_refused(wrong_answers, tmp_path):
    """``out``, the folder for pairs about which a detector is wrong, names a file."""
    (tmp_path / "taken").write_text("")
    with pytest.raises(OutputError, match="cannot be written"):
        family_tally(**wrong_answers, out=tmp_path / "taken")


@pytest.mark.slow
def test_exact_is_right_on_a_sample_of_every_family():
    """20 pairs of each of the 26 families, of any seed: no answer is wrong, so no promise is broken."""
    result = stress("exact", pairs=20, seed=4_711)
    assert [tally.failed for tally in result.tallies] == [0] * 26
    assert result.broken == []


@pytest.mark.slow
def test_python_fcl_behind_hybrid_fails_where_products_overflow():
    """300 pairs of two families: about points on a face all its errors, over 50, are by less than 2 um (``within``).

    Coordinates whose products overflow are no metres, so that nothing is within a tolerance: more than five contacts
    are missed, and more than five are invented.
    """
    families = [triangle_family("point on a face"), triangle_family("products overflow")]
    points, overflow = stress("hybrid", families=families, pairs=300).tallies
    assert points.missed == points.invented == 0
    assert points.within > 50
    assert overflow.missed > 5 and overflow.invented > 5 and overflow.within == 0


@pytest.mark.parametrize("wrong", [{"pairs": 0}, {"seed": -1}, {"tau": -1e-6}, {"tau": np.inf}])
def test_no_pairs_and_negative_seeds_or_tolerances_are_refused(wrong):
    """An argument is wrong; an infinite tolerance, which would excuse everything, is refused too."""
    with pytest.raises(StressError, match="give 1 pair or more, and neither seed nor tau below 0"):
        stress("exact", families=FAMILIES[:1], **{"pairs": 1, **wrong})


def test_stress_of_all_runs_detectors_that_decide_on_meshes(monkeypatch):
    """There are three detectors here; sphere decides on bounding spheres alone."""
    monkeypatch.setattr(runner, "detector_names", lambda: ["sphere", "hybrid", "exact"])
    assert [spec.label for spec in detectors_of("all")] == ["hybrid", "exact"]


def test_detectors_are_named_between_commas_each_once():
    """Names may be repeated, with blanks and a comma at the end; an unknown one is refused with those there are."""
    assert [spec.label for spec in detectors_of("exact, hybrid,exact,")] == ["exact", "hybrid"]
    with pytest.raises(UnknownDetectorError, match=r"there are: .*sphere"):
        detectors_of("spoon")


def test_stress_takes_specs_and_screen_names():
    """Two names that screens print, mesh50 and paper, and between them a detector with a setting and its own label.

    The counts of the family come first, then those of the case, each of all three detectors.
    """
    result = stress("mesh50,slow=discrete[rate_hz=20],paper", families=FAMILIES[:1], cases=[CAVITY], pairs=2)
    of_family = of_case = ["mesh50", "slow", "paper"]
    assert [(tally.kind, tally.detector) for tally in result.tallies] == [
        *(("family", label) for label in of_family),
        *(("case", label) for label in of_case),
    ]


def test_setting_that_a_detector_has_not_is_refused():
    """The detector exact has no setting called speed."""
    with pytest.raises(InvalidSettingError, match="has no setting 'speed'"):
        stress("exact[speed=1]", families=FAMILIES[:1], pairs=1)


@pytest.mark.parametrize(
    "questions",
    [{"families": FAMILIES[:1]}, {"families": (), "cases": [CAVITY]}, {"families": (), "cases": [REPEATED_CASE]}],
)
@pytest.mark.parametrize(
    ("detector", "error"), [("newton", MissingEngineError), ("collider[shape=compound]", InvalidSettingError)]
)
def test_detector_that_cannot_be_made_is_an_error(detector, error, questions, monkeypatch):
    """The extra newton is not installed, and bodies of these questions have no convex pieces: nothing is counted."""
    monkeypatch.setitem(sys.modules, "newton", None)
    with pytest.raises(error, match=r"is not installed; pip install|has no convex pieces"):
        stress(detector, **questions, pairs=2)


@pytest.mark.parametrize(
    ("text", "numbers"),
    [("1-26", list(range(1, 27))), ("9", [9]), ("3-5,12", [3, 4, 5, 12]), ("12,12", [12]), ("1-", [1])],
)
def test_families_are_named_by_number_and_range(text, numbers):
    """Families of triangle pairs have the numbers 1 to 26."""
    assert numbers_of(text, "family", range(1, 27)) == numbers


def test_cases_are_named_by_number_range_and_all():
    """Cases of whole bodies are numbered from 27 on, with gaps: from 33 to 37 there are two."""
    assert numbers_of("33-37", "case", [*CASE_NAMES]) == [33, 37]
    assert numbers_of("all", "case", [*CASE_NAMES]) == [*CASE_NAMES]
