"""The part of a document that describes its session."""

from replay.document.session import DroppedFrames


def test_dropped_frames_of_both_kinds_are_added():
    assert DroppedFrames(repeated=3, backwards=2).total == 5
