import re

import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from support.small_worlds import verdict_column, verdicts

from replay.auditing.episodes import column_runs, episodes
from replay.auditing.outcome import Episode
from replay.prepare.frame_times import frame_ends

tables = hnp.arrays(np.bool_, st.tuples(st.integers(0, 30), st.integers(0, 4)))


@given(tables)
def test_runs_are_maximal_and_cover_exactly_the_true_frames(mask):
    """``mask``: frames by columns. Runs (column, first, last frame) never overlap or join, and give it again."""
    rebuilt = np.zeros_like(mask)
    for column, first, last in column_runs(mask.T):
        assert not rebuilt[first : last + 1, column].any()
        rebuilt[first : last + 1, column] = True
        assert first == 0 or not mask[first - 1, column]
        assert last == len(mask) - 1 or not mask[last + 1, column]
    assert np.array_equal(rebuilt, mask)


@given(tables)
def test_runs_are_in_order_of_time_then_column(mask):
    """Runs are (column, first, last frame)."""
    order = [(first, column) for column, first, _ in column_runs(mask.T).tolist()]
    assert order == sorted(order)


def test_episode_ends_at_the_first_frame_without_contact():
    """Each text is a frame of two pairs: C contact, I contained and ? candidate count as contact, . is clear.

    Episodes are (pair, first frame, last frame, start and end in seconds); frames are 0.5 s apart.
    """
    detection = verdicts(["C.", "CC", ".I", "C?", "C.", ".C"], step=0.5)
    actual = [(e.pair, e.first, e.last, e.start, e.end) for e in episodes(detection)]
    assert actual == [(0, 0, 1, 0.0, 1.0), (1, 1, 3, 0.5, 2.0), (0, 3, 4, 1.5, 2.5), (1, 5, 5, 2.5, 3.0)]


@example("C--C-CC")
@given(st.text(alphabet="C.-u", min_size=1, max_size=40))
def test_lost_poses_do_not_split_a_contact(letters):
    """A letter a frame: C contact, - lost pose, u undecided. A contact goes from C to C over C and - alone.

    ``frames`` are those in contact; ``cuts`` the stretches of lost poses within a contact and next to it.
    """
    expected = [
        (contact.start(1), contact.end(1) - 1, contact[1].count("C"), len(re.findall("-+", contact[0])))
        for contact in re.finditer("-*(C(?:[C-]*C)?)-*", letters)
    ]
    assert [(e.first, e.last, e.frames, e.cuts) for e in episodes(verdict_column(letters))] == expected


def test_a_jump_between_known_poses_joins_no_contacts():
    """A detector of intervals says NO_POSE of the way across a jump, though both bodies have a pose at its end."""
    known = np.ones((3, 2), dtype=bool)
    assert [(e.first, e.last, e.cuts) for e in episodes(verdict_column("C-C"), known)] == [(0, 0, 0), (2, 2, 0)]
    known[1, 0] = False
    assert [(e.first, e.last, e.cuts) for e in episodes(verdict_column("C-C"), known)] == [(0, 2, 1)]


def test_a_frame_before_a_gap_lasts_the_median_step():
    """Steps of 1.0, 1.5 and 6.5 s: the frame before the gap, and the last, last the median, 1.5 s."""
    assert frame_ends(np.array([0.0, 1.0, 2.5, 9.0])).tolist() == [1.0, 2.5, 4.0, 10.5]


def test_lost_frames_within_a_segment_of_a_contact_are_counted():
    """Poses are lost in frames 3 to 5 and 8; the segments hold all of them, some, one and none."""
    contact = Episode(pair=0, first=0, last=9, start=0.0, end=0.1, lost=((3, 5), (8, 8)), cuts=2)
    assert [contact.lost_within(*segment) for segment in ((0, 9), (4, 8), (5, 5), (0, 2), (6, 7))] == [4, 3, 1, 0, 0]
    assert (contact.frames_lost, contact.frames) == (4, 6)
