import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from support.small_worlds import framed

from replay.prepare.frame_order import in_order


@given(st.lists(st.integers(0, 30), min_size=1, max_size=40), st.integers(1, 9))
def test_the_frames_kept_are_the_running_maxima_and_every_other_is_counted(stamps, block):
    session = framed(stamps, np.ones((len(stamps), 1)))
    parts = list(in_order(session.blocks(block)))
    expected, repeated, backwards, latest = [], 0, 0, -1
    for number, stamp in enumerate(stamps):
        if stamp > latest:
            expected.append(number)
            latest = stamp
        else:
            repeated += stamp == latest
            backwards += stamp < latest
    assert np.concatenate([part.numbers for part in parts]).tolist() == expected
    assert np.concatenate([part.frames.stamp_ns for part in parts]).tolist() == [stamps[n] for n in expected]
    assert sum(part.repeated for part in parts) == repeated
    assert sum(part.backwards for part in parts) == backwards


def test_frames_in_order_are_handed_on_as_they_are():
    session = framed([1, 2, 3], np.ones((3, 1)))
    (part,) = in_order([session.frames])
    assert part.frames is session.frames
