"""The record of a session: frames that were dropped."""

from replay.document.session import DroppedFrames


def test_dropped_frames_of_both_kinds_are_added():
    assert DroppedFrames(repeated=3, backwards=2).total == 5
