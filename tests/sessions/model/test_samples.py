import numpy as np
import pytest

from sessions.errors import SessionError
from sessions.model.session import Status, Track, checked_stamps


def test_status_numbers_belong_to_the_file_format():
    """Session files hold the numbers, which therefore must not change."""
    assert [(status.name, status.value) for status in Status] == [
        ("ABSENT", 0),
        ("VALID", 1),
        ("LOST", 2),
        ("HELD", 3),
        ("INTERPOLATED", 4),
    ]


def test_a_track_keeps_read_only_copies_of_its_arrays():
    """Two samples are made a track; later changes of its arrays do not reach it, and its own cannot be changed.

    Samples of which nothing else is said are valid.
    """
    times, positions = np.array([1, 2]), np.ones((2, 3))
    track = Track(times, positions, np.zeros((2, 4)))
    times[0], positions[0] = -5, 7
    assert track.times_ns.tolist() == [1, 2]
    assert track.positions[0].tolist() == [1, 1, 1]
    assert track.valid.tolist() == [True, True]
    assert len(track) == 2
    for array in (track.times_ns, track.positions, track.quaternions_xyzw, track.valid):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


@pytest.mark.parametrize(("stamps", "text"), [([5, 3], "does not come after"), ([5, 2**63], "beyond")])
def test_falling_or_overflowing_unsigned_stamps_are_refused(stamps, text):
    """Unsigned, 3 after 5 would be a large step; 2**63 does not fit a signed number."""
    with pytest.raises(SessionError, match=text):
        checked_stamps(np.array(stamps, dtype=np.uint64), "it")
