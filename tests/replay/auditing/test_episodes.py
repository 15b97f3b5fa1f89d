import re

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from support.small_worlds import verdict_column, verdicts

from replay.auditing.episodes import column_runs, episodes
from replay.auditing.outcome import Episode

tables = hnp.arrays(np.bool_, st.tuples(st.integers(0, 30), st.integers(0, 4)))
"""Truth values of up to 30 frames by 4 columns."""


@given(tables)
def test_runs_are_maximal_and_cover_exactly_the_true_frames(mask):
    """Runs are (column, first, last frame) of ``mask``, frames by columns.

    No two overlap, the frames before and after a run are false, and together they are the true frames.
    """
    rebuilt = np.zeros_like(mask)
    for column, first, last in column_runs(mask.T):
        assert not rebuilt[first : last + 1, column].any()
        rebuilt[first : last + 1, column] = True
        assert first == 0 or not mask[first - 1, column]
        assert last == len(mask) - 1 or not mask[last + 1, column]
    assert np.array_equal(rebuilt, mask)


@given(tables)
def test_runs_are_in_order_of_time_then_column(mask):
    """Runs are (column, first, last frame); their order is that of (first, column)."""
    order = [(first, column) for column, first, _ in column_runs(mask.T).tolist()]
    assert order == sorted(order)


def test_episode_ends_at_the_first_frame_without_contact():
    """Each text is a frame of two pairs: C contact, I contained and ? candidate count as contact, . is clear.

    Frames are 0.5 s apart: contact in frames 0 and 1 of pair 0 is from 0.0 to 1.0 s, the time of frame 2.
    """
    detection = verdicts(["C.", "CC", ".I", "C?", "C.", ".C"], step=0.5)
    actual = [{"pair": e.pair, "frames": (e.first, e.last), "seconds": (e.start, e.end)} for e in episodes(detection)]
    assert actual == [
        {"pair": 0, "frames": (0, 1), "seconds": (0.0, 1.0)},
        {"pair": 1, "frames": (1, 3), "seconds": (0.5, 2.0)},
        {"pair": 0, "frames": (3, 4), "seconds": (1.5, 2.5)},
        {"pair": 1, "frames": (5, 5), "seconds": (2.5, 3.0)},
    ]


@example("C--C-CC")
@given(st.text(alphabet="C.-u", min_size=1, max_size=40))
def test_lost_poses_do_not_split_a_contact(letters):
    """A letter a frame: C contact, - lost pose, u undecided, . clear. A contact goes from C to C over C and - alone.

    Its ``frames`` are those in contact; its ``cuts`` the segments of lost poses within it or next to it.
    """
    expected = []
    for contact in re.finditer("-*(C(?:[C-]*C)?)-*", letters):
        first, last = contact.start(1), contact.end(1) - 1
        frames, cuts = contact[1].count("C"), len(re.findall("-+", contact[0]))
        expected.append((first, last, frames, cuts))
    assert [(e.first, e.last, e.frames, e.cuts) for e in episodes(verdict_column(letters))] == expected


@pytest.mark.parametrize(
    ("second_body_has_pose", "expected"),
    [
        pytest.param(True, [(0, 0, 0), (2, 2, 0)], id="a jump"),
        pytest.param(False, [(0, 2, 1)], id="a lost pose"),
    ],
)
def test_a_jump_between_known_poses_joins_no_contacts(second_body_has_pose, expected):
    """Contact, no pose (-) and contact: one contact with one cut, from frame 0 to 2, where a body lost its pose.

    A detector of intervals says - of the way across a jump too, though both bodies have a pose there: two contacts.
    """
    frames, bodies = 3, 2
    known = np.ones((frames, bodies), dtype=bool)
    known[1, 1] = second_body_has_pose
    assert [(e.first, e.last, e.cuts) for e in episodes(verdict_column("C-C"), known)] == expected


@pytest.mark.parametrize(
    ("first", "last", "lost"),
    [
        pytest.param(0, 9, 4, id="all"),
        pytest.param(4, 8, 3, id="4, 5 and 8"),
        pytest.param(5, 5, 1, id="5"),
        pytest.param(0, 2, 0, id="none before"),
        pytest.param(6, 7, 0, id="none between"),
    ],
)
def test_lost_frames_within_a_segment_of_a_contact_are_counted(first, last, lost):
    """A contact of ten frames has lost poses in frames 3 to 5 and 8; so many are in frames ``first`` to ``last``."""
    contact = Episode(pair=0, first=0, last=9, start=0.0, end=0.1, lost=((3, 5), (8, 8)), cuts=2)
    assert contact.lost_within(first, last) == lost
    assert (contact.frames_lost, contact.frames) == (4, 10 - 4)
