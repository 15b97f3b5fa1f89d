"""Table I: the printed values and the statistics beside them."""

from unittest.mock import Mock

import numpy as np
import pytest

from replay.studies.paper.experiment import Size, run_paper
from replay.studies.paper.printed import PRINTED_FIGURES, PRINTED_LABEL
from replay.studies.paper.rows import ANSWER_DTYPE
from replay.studies.paper.table_one import budget, completion_table, mean_and_spread


@pytest.mark.slow
def test_values_printed_in_the_paper_have_a_marked_column(tables_of_small_experiment):
    """The heading ends in PRINTED_LABEL; in Table I the column has the faces detected of 100, as the paper prints."""
    for key in ("Table I", "F7ab", "F7c"):
        assert any(head.endswith(PRINTED_LABEL) for head in tables_of_small_experiment[key].head), key
    printed = tables_of_small_experiment["Table I"].column(PRINTED_LABEL)
    assert printed == [figures["detected"]["100"] for figures in PRINTED_FIGURES.values()]


def answers(*poses):
    """Answers in poses: (target, operations, seconds) of each; the faces and pairs matter to no budget."""
    any_counts = (1, 1, 1, 1, 1)
    rows = [(target, *any_counts, operations, seconds) for target, operations, seconds in poses]
    return np.array(rows, ANSWER_DTYPE)


@pytest.mark.parametrize(("fraction", "expected"), [(0.5, 30), (1.0, 60), (2.0, 120), (1e-9, 1)])
def test_budget_is_the_operations_done_in_hybrids_median_time(fraction, expected):
    """In poses of 100 faces hybrid takes 3 ms (median); obb does 300 + 500 operations in 10 + 30 ms, so 60 in 3 ms.

    The budget is a fraction of that, and one operation at least; poses of 200 faces do not count.
    """
    complete = {
        "hybrid": answers((100, 0, 0.002), (100, 0, 0.004), (200, 0, 9.0)),
        "obb": answers((200, 1, 0.03), (100, 300, 0.01), (100, 500, 0.03)),
    }
    assert budget(complete, "obb", target=100, fraction=fraction) == expected


def test_recall_pools_poses_and_a_whole_pose_has_every_pair():
    """Two poses of which everything is found, and one of which 5 of 20 faces and 2 of 12 pairs are, beside a wrong one.

    Recall and precision are of all poses together: faces 10 + 10 + 5 of 10 + 10 + 20, pairs 4 + 4 + 2.
    """
    # target, faces, true faces, pairs reported, true pairs, right pairs, operations, seconds
    whole = (100, 10, 10, 4, 4, 4, 0, 0.001)
    partial = (100, 5, 20, 3, 12, 2, 0, 0.004)
    (row,) = completion_table({"exact": np.array([whole, whole, partial], ANSWER_DTYPE)}).rows
    label, poses, whole_poses, faces, face_recall, pair_recall, precision, operations, milliseconds = row
    assert (label, poses, whole_poses) == ("exact", 3, 2)
    assert (faces, face_recall) == (25 / 3, 25 / 40)
    assert (pair_recall, precision) == (10 / 20, 10 / 11)
    assert (operations, milliseconds) == (None, pytest.approx(2.0)), "exact has no budget; 1, 1 and 4 ms"


@pytest.mark.parametrize(
    ("name", "mean", "deviation"),
    [("solid-style", 0.8659, 0.0472), ("rapid-style", 0.8803, 0.0615), ("hybrid-qaco", 0.9567, 0.0215)],
)
def test_table_1_means_and_deviations_match_hand_calculation(name, mean, deviation):
    """Table I of the paper prints how many of 100, 200, ... 1000 faces three algorithms detect.

    Mean and deviation of the ten fractions were worked out by hand, to four digits: no digit was copied wrongly.
    """
    fractions = [count / int(target) for target, count in PRINTED_FIGURES[name]["detected"].items()]
    assert len(fractions) == 10
    assert (np.mean(fractions), np.std(fractions)) == pytest.approx((mean, deviation), abs=5e-5)


def test_printed_figures_are_those_of_the_paper():
    """Its three algorithms; SOLID detects 88 + 186 + ... + 802 = 4,658 faces in all.

    Fig. 7 prints 99, 105 and 132 ms, the last for RAPID; ``time`` is a fraction of that.
    """
    assert PRINTED_FIGURES.keys() == {"solid-style", "rapid-style", "hybrid-qaco"}
    assert sum(PRINTED_FIGURES["solid-style"]["detected"].values()) == 4658
    assert PRINTED_FIGURES["hybrid-qaco"]["time"] == 99 / 132
    assert PRINTED_FIGURES["solid-style"]["time"] == round(105 / 132, 3)


def test_a_known_sample_has_the_known_mean_deviation_and_variance():
    """Eight values with the mean 5: squared deviations sum to 32, over seven degrees of freedom."""
    sample = np.array([2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0])
    number, mean, lower, upper, deviation, variance = mean_and_spread(sample)
    assert (number, mean) == (8, 5.0) and lower < mean < upper
    assert variance == pytest.approx(32 / 7) and deviation == pytest.approx((32 / 7) ** 0.5)


def test_exception_of_the_progress_display_ends_the_study():
    """Such as a reader's interruption: the display raises it at the first stage of an experiment without poses."""
    display = Mock(stage=Mock(side_effect=InterruptedError))
    with pytest.raises(InterruptedError):
        run_paper(Size(targets=(), poses=0, near=0), progress=display)
