"""Table I: the printed values and the statistics beside them."""

from unittest.mock import Mock

import numpy as np
import pytest

from replay.studies.paper.experiment import Size, run_paper
from replay.studies.paper.printed import PRINTED_FIGURES, PRINTED_LABEL
from replay.studies.paper.rows import ANSWER_DTYPE
from replay.studies.paper.table_one import budget, completion_table, mean_and_spread


@pytest.mark.slow
def test_values_printed_in_the_paper_have_a_marked_column(small):
    """The column ends in PRINTED_LABEL; of Table I it has the faces detected at a target of 100."""
    for key in ("Table I", "F7ab", "F7c"):
        assert any(head.endswith(PRINTED_LABEL) for head in small[key].head)
    assert small["Table I"].column(PRINTED_LABEL) == [paper["detected"]["100"] for paper in PRINTED_FIGURES.values()]


def test_budget_is_the_operations_done_in_hybrids_median_time():
    """At target 100 hybrid takes 3 ms (median); obb does 800 operations in 40 ms, so 60 in 3 ms, and at least one."""
    requested = {
        "hybrid": [(100, 0, 0.002), (100, 0, 0.004), (200, 0, 9.0)],
        "obb": [(200, 1, 0.03), (100, 300, 0.01), (100, 500, 0.03)],
    }
    complete = {
        name: np.array([(target, 1, 1, 1, 1, 1, done, seconds) for target, done, seconds in rows], ANSWER_DTYPE)
        for name, rows in requested.items()
    }
    assert [budget(complete, "obb", 100, fraction) for fraction in (1e-9, 0.5, 1.0, 2.0)] == [1, 30, 60, 120]


WHOLE_ANSWER = (100, 10, 10, 4, 4, 4, 0, 0.001)
"""A pose of which every pair was found."""


def test_recall_pools_poses_and_a_whole_pose_has_every_pair():
    """Two poses with 10 of 10 pairs and one with 5 of 20: 25 of 40 pairs."""
    answers = np.array([WHOLE_ANSWER, WHOLE_ANSWER, (100, 5, 20, 3, 12, 2, 0, 0.004)], ANSWER_DTYPE)
    (row,) = completion_table({"exact": answers}).rows
    assert row == ("exact", 3, 2, 25 / 3, 25 / 40, 10 / 20, 10 / 11, None, pytest.approx(2.0))


def test_table_1_means_and_deviations_match_hand_calculation():
    """Means and deviations of the ten detected fractions that Table I of the paper prints."""
    known = {"solid-style": (0.8659, 0.0472), "rapid-style": (0.8803, 0.0615), "hybrid-qaco": (0.9567, 0.0215)}
    assert known.keys() == PRINTED_FIGURES.keys()
    for name, figures in known.items():
        fractions = [count / int(target) for target, count in PRINTED_FIGURES[name]["detected"].items()]
        assert len(fractions) == 10 and (np.mean(fractions), np.std(fractions)) == pytest.approx(figures, abs=5e-5)
    assert sum(PRINTED_FIGURES["solid-style"]["detected"].values()) == 4658
    assert (99 / 132, round(105 / 132, 3)) == (
        PRINTED_FIGURES["hybrid-qaco"]["time"],
        PRINTED_FIGURES["solid-style"]["time"],
    )


def test_a_known_sample_has_the_known_mean_deviation_and_variance():
    """Squared deviations from 5 sum to 32, over seven degrees of freedom."""
    number, mean, lower, upper, deviation, variance = mean_and_spread(
        np.array([2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0])
    )
    assert (number, mean) == (8, 5.0) and lower < mean < upper
    assert variance == pytest.approx(32 / 7) and deviation == pytest.approx((32 / 7) ** 0.5)


def test_exception_of_the_progress_display_ends_the_study():
    """Such as a reader's interruption, at the first stage."""
    watching = Mock(stage=Mock(side_effect=InterruptedError))
    with pytest.raises(InterruptedError):
        run_paper(Size((), poses=0, near=0), progress=watching)
