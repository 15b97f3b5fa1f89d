"""The printed values are those of the paper: their means are what the specification's check of them says."""

import numpy as np

from replay.studies.paper.fixtures import TARGETS
from replay.studies.paper.printed import ACCURACY, OURS, TABLE_1, TIME_TO_RAPID, VARIANCE


def test_row_means_and_deviations_of_table_1_are_those_checked_by_hand():
    known = {"solid-style": (0.8659, 0.0472), "rapid-style": (0.8803, 0.0615), "hybrid-qaco": (0.9567, 0.0215)}
    for name, (mean, deviation) in known.items():
        shares = [TABLE_1[name][target] / target for target in TARGETS]
        assert abs(np.mean(shares) - mean) < 5e-5 and abs(np.std(shares) - deviation) < 5e-5
    assert sum(TABLE_1["solid-style"].values()) == 4658


def test_every_printed_row_has_a_row_here_and_all_counts_are_even():
    assert set(TABLE_1) == set(OURS) == set(ACCURACY) == set(VARIANCE) == set(TIME_TO_RAPID)
    assert all(count % 2 == 0 for row in TABLE_1.values() for count in row.values())
    assert (99 / 132, round(105 / 132, 3)) == (TIME_TO_RAPID["hybrid-qaco"], TIME_TO_RAPID["solid-style"])
