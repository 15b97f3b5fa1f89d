"""The runner counts each wrong answer once, under the right word, and its gate knows who promised what."""

import numpy as np
import pytest
from support.optional import read_cases
from support.processes import Watched
from support.shapes import triangle_family

from cdcore import Verdict
from cdcore.errors import InvalidSettingError, UnknownDetectorError
from cdcore.triangles.decide import triangles_intersect
from replay.errors import OutputError, StressError
from replay.studies.stress import runner
from replay.studies.stress.bodies import CASE_NAMES
from replay.studies.stress.families import FAMILIES
from replay.studies.stress.runner import detectors_of, family_tally, numbers_of, stress

FLOOR = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]

CAVITY = 28
"""Number of the hard case of bodies in a closed cavity."""


def faces_above_floor(height):
    """A floor, and a triangle whose lowest corner is at this height."""
    return [FLOOR, [[0.2, 0.2, height], [0.3, 0.2, 1], [0.2, 0.3, 1]]]


PAIRS_ABOVE_AND_BELOW = np.array(
    [
        faces_above_floor(height=-0.1),
        faces_above_floor(height=0.1),
        faces_above_floor(height=-1e-6),
        faces_above_floor(height=1e-6),
        faces_above_floor(height=-0.1),
        faces_above_floor(height=0.1),
    ],
    dtype=float,
)
TRUTH = np.array([True, False, True, False, True, False])
OPPOSITE_OF_TRUTH = np.where(TRUTH, Verdict.CLEAR, Verdict.CONTACT).astype(np.uint8)
MIXED_VERDICTS = [
    Verdict.INVALID,
    Verdict.CANDIDATE,
    Verdict.UNRESOLVED,
    Verdict.CLEAR,
    Verdict.CANDIDATE,
    Verdict.NOT_FOUND,
]


@pytest.mark.parametrize(
    ("family", "verdict", "tau", "counts"),
    [
        (triangle_family("generic control"), OPPOSITE_OF_TRUTH, 2e-6, (2, 2, 2, 0, 0)),
        (triangle_family("generic control"), OPPOSITE_OF_TRUTH, 0.0, (3, 3, 0, 0, 0)),
        (triangle_family("generic control"), OPPOSITE_OF_TRUTH, 0.5e-6, (3, 3, 0, 0, 0)),
        (triangle_family("tiny"), OPPOSITE_OF_TRUTH, 2e-6, (3, 3, 0, 0, 0)),
        (
            triangle_family("generic control"),
            np.where(TRUTH, Verdict.CONTACT, Verdict.CLEAR).astype(np.uint8),
            2e-6,
            (0, 0, 0, 0, 0),
        ),
        (triangle_family("generic control"), np.array(MIXED_VERDICTS, dtype=np.uint8), 2e-6, (0, 0, 0, 2, 1)),
    ],
    ids=["wrong", "no tolerance", "a small tolerance", "no metres", "right", "refusals and volumes"],
)
def test_an_answer_is_counted_once_under_the_right_word(family, verdict, tau, counts):
    """Counts: missed, false, within tau, refused, unconfirmed. Two of six pairs meet or part by 1 um only."""
    assert np.array_equal(triangles_intersect(PAIRS_ABOVE_AND_BELOW), TRUTH)
    tally = family_tally("planted", family, 5, PAIRS_ABOVE_AND_BELOW, TRUTH, verdict, tau)
    assert (tally.missed, tally.invented, tally.within, tally.refused, tally.unconfirmed) == counts
    assert tally.failed == sum(counts[:4])


def test_progress_counts_families_and_cases():
    """Two families and one case: 3 of 3."""
    watched = Watched()
    stress("exact", families=FAMILIES[:2], cases=[CAVITY], pairs=2, progress=watched)
    assert watched.stages["stress"] == (3, 3)


def test_failing_triangle_pairs_beyond_tolerance_are_written(tmp_path):
    """Rows 2 and 3 are within tau; the other four are written."""
    planted = (
        "lab.engine:Planted",
        triangle_family("generic control"),
        5,
        PAIRS_ABOVE_AND_BELOW,
        TRUTH,
        OPPOSITE_OF_TRUTH,
        2e-6,
    )
    tally = family_tally(*planted, tmp_path / "new")
    path = tmp_path / "new" / "family-01-lab-engine-planted-seed-5.npz"
    assert [*path.parent.iterdir()] == [path] and tally.file == str(path)
    cases = read_cases(path)
    assert (cases.detector, cases.family, cases.seed, cases.count) == ("lab.engine:Planted", 1, 5, 6)
    assert cases.row.tolist() == [0, 1, 4, 5]
    assert cases.triangles.tobytes() == PAIRS_ABOVE_AND_BELOW[[0, 1, 4, 5]].tobytes()
    assert np.array_equal(cases.truth, TRUTH[cases.row]) and np.array_equal(cases.verdict, OPPOSITE_OF_TRUTH[cases.row])
    (tmp_path / "taken").write_text("")
    with pytest.raises(OutputError, match="cannot be written"):
        family_tally(*planted, tmp_path / "taken")


@pytest.mark.slow
def test_exact_is_right_on_a_sample_of_every_family():
    """20 pairs of each of the 26 families."""
    result = stress("exact", pairs=20, seed=4_711)
    assert [tally.failed for tally in result.tallies] == [0] * 26
    assert result.broken == []


@pytest.mark.slow
def test_python_fcl_behind_hybrid_fails_where_products_overflow():
    """300 pairs of each: at points on a face all its errors are within tau, with huge coordinates none is."""
    points, overflow = stress(
        "hybrid",
        families=[triangle_family("point on a face"), triangle_family("products overflow")],
        pairs=300,
    ).tallies
    assert points.within > 50 and points.missed == points.invented == 0
    assert overflow.missed > 5 and overflow.invented > 5 and overflow.within == 0


@pytest.mark.parametrize("wrong", [{"pairs": 0}, {"seed": -1}, {"tau": -1e-6}, {"tau": np.inf}])
def test_no_pairs_and_negative_seeds_or_tolerances_are_refused(wrong):
    """``wrong``: arguments of the only call; an infinite tolerance is refused too."""
    with pytest.raises(StressError, match="give 1 pair or more, and neither seed nor tau below 0"):
        stress("exact", families=FAMILIES[:1], **{"pairs": 1, **wrong})


def test_stress_of_all_runs_detectors_that_decide_on_meshes(monkeypatch):
    """Spheres do not decide; names may be repeated, with blanks and a comma at the end."""
    monkeypatch.setattr(runner, "detector_names", lambda: ["sphere", "hybrid", "exact"])
    assert [spec.label for spec in detectors_of("all")] == ["hybrid", "exact"]
    assert [spec.label for spec in detectors_of("exact, hybrid,exact,")] == ["exact", "hybrid"]
    with pytest.raises(UnknownDetectorError, match="there are: sphere"):
        detectors_of("spoon")


def test_stress_takes_specs_and_screen_names():
    """A name of the screens (mesh50), a detector with settings, and a name of its own."""
    result = stress("mesh50,slow=discrete[rate_hz=20],paper", families=FAMILIES[:1], cases=[CAVITY], pairs=2)
    assert [tally.detector for tally in result.tallies[:3]] == ["mesh50", "slow", "paper"]
    with pytest.raises(InvalidSettingError, match="has no setting 'speed'"):
        stress("exact[speed=1]", families=FAMILIES[:1], pairs=1)


@pytest.mark.parametrize(
    ("text", "numbers"),
    [("1-26", list(range(1, 27))), ("9", [9]), ("3-5,12", [3, 4, 5, 12]), ("12,12", [12]), ("1-", [1])],
)
def test_families_are_named_by_number_and_range(text, numbers):
    """Triangle pairs have families 1 to 26, bodies have cases."""
    assert numbers_of(text, "family", range(1, 27)) == numbers
    assert numbers_of("33-37", "case", [*CASE_NAMES]) == [33, 37] and numbers_of("all", "case", [*CASE_NAMES]) == [
        *CASE_NAMES
    ]
