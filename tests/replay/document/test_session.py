"""The record of a session: frames that were dropped."""

from replay.document.session import DroppedFrames


def test_dropped_frames_of_both_kinds_are_added():
    """Frames whose stamp repeats the one before, or goes backwards."""
    assert DroppedFrames(repeated=3, backwards=2).total == 3 + 2
