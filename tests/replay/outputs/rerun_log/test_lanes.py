"""Lanes say exactly when, the worst pair first, and no change is lost between neighbours."""

from itertools import pairwise

import numpy as np

from replay.outputs.palette import OUTCOMES
from replay.outputs.rerun_log.lanes import pair_lanes

SUBJECT = "22.5Hz"


def states_at(lane, stamps):
    times = [ns for ns, _ in lane]
    return [lane[k][1] for k in np.searchsorted(times, stamps, side="right") - 1]


def test_a_lane_says_the_outcome_of_every_frame_and_its_name_has_nothing_to_escape(demo, read):
    stamps = demo.assembly.stamp_ns - demo.assembly.stamp_ns[0]
    comparison = demo.comparisons[SUBJECT]
    lanes = pair_lanes(demo, SUBJECT)
    names = [path.rpartition("/")[2] for path in lanes]
    assert names == ["1_beaker-rod", "2_bench-rod", "3_rod-hand_held"]
    for path, column in lanes.items():
        words = [OUTCOMES[code][0] if code else "" for code in comparison.outcome[:, column].tolist()]
        assert states_at(read.lane(path), stamps) == words
        assert all("" in (before, after) for (_, before), (_, after) in pairwise(read.lane(path))), (
            "else merged to grey"
        )
