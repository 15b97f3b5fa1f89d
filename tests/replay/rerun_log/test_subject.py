"""The lanes beside the picture fit the screen, and the pair on which the cursor stands first is among them."""

from __future__ import annotations

import pytest

from replay.rerun_log.subject import LANES_IN_VIEW, Subject, lanes_in_view

LANES = {"lanes/1_missed": None, **{f"lanes/{k}_p": k for k in range(2, 14)}}


def subject(longest: int | None) -> Subject:
    return Subject("slow", "1 of 2 missed", LANES, longest, "", "", "", "", "", "", (), "")


@pytest.mark.parametrize("longest", [None, 2, LANES_IN_VIEW])
def test_the_worst_lanes_are_in_view(longest: int | None) -> None:
    assert lanes_in_view(subject(longest)) == list(LANES)[:LANES_IN_VIEW]


@pytest.mark.parametrize("longest", [LANES_IN_VIEW + 1, 13])
def test_the_lane_of_the_longest_cut_takes_the_place_of_the_least_bad_one(longest: int) -> None:
    assert lanes_in_view(subject(longest)) == [*list(LANES)[: LANES_IN_VIEW - 1], f"lanes/{longest}_p"]
