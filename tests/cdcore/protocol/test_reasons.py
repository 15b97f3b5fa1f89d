"""Every undecided verdict has a reason: the noted one, that of its pair, or that there is none."""

import pickle

import numpy as np
import pytest

from cdcore import Detection, Verdict, join
from cdcore.protocol.detection import NO_REASON

UNRESOLVED, INVALID, NO_POSE, CLEAR = Verdict.UNRESOLVED, Verdict.INVALID, Verdict.NO_POSE, Verdict.CLEAR
TEXTS = ("partly: inside undecided: cup has holes", "refused: not supported", "decided")
"""What detections of these tests say about containment of their three pairs."""


def detection(verdict, reasons=(), containment=TEXTS, start=0):
    """A detection of three pairs with these verdicts, a second apart."""
    verdict = np.array(verdict, dtype=np.uint8)
    times = start + np.arange(len(verdict), dtype=float)
    return Detection(
        "d", ("a", "b", "c"), np.array([[0, 1], [0, 2], [1, 2]]), times, verdict,
        containment=containment, reasons=dict(reasons),
    )  # fmt: skip


def test_undecided_verdicts_get_the_reason_of_their_pair():
    """A detection has a text for two of its pairs: inside of pair 0 is undecided, as cup has holes; pair 1 is not
    supported. Pair 2 has none.

    Reasons are by frame and pair; where the pair's text has none, NO_REASON says so.
    """
    answer = detection([[UNRESOLVED, INVALID, CLEAR], [CLEAR, CLEAR, UNRESOLVED]])
    assert answer.reasons == {
        (0, 0): "inside undecided: cup has holes",
        (0, 1): "not supported",
        (1, 2): NO_REASON,
    }
    assert len(answer.reasons) == 3


def test_undecided_verdict_of_a_silent_detection_has_no_reason():
    """A detection of three pairs that says nothing about containment: NO_REASON says so."""
    assert detection([[UNRESOLVED, CLEAR, CLEAR]], containment=()).reasons == {(0, 0): NO_REASON}


def test_a_noted_reason_comes_before_that_of_the_pair():
    """Unnoted, pair 0 would get that cup has holes, and NO_POSE no reason: it is no undecided verdict of the mesh."""
    noted = {(0, 0): "half a turn", (0, 1): "lost"}
    assert detection([[UNRESOLVED, NO_POSE, CLEAR]], reasons=noted).reasons == noted


@pytest.mark.parametrize(
    "frame_and_pair",
    [
        pytest.param((0, 2), id="clear"),
        pytest.param((5, 0), id="no such frame"),
        pytest.param((-1, 0), id="negative frame"),
        pytest.param((0, 3), id="no such pair"),
    ],
)
def test_decided_or_absent_pairs_have_no_reason(frame_and_pair):
    """A frame with three pairs, of which the third is clear."""
    answer = detection([[UNRESOLVED, INVALID, CLEAR]])
    assert frame_and_pair not in answer.reasons
    with pytest.raises(KeyError):
        answer.reasons[frame_and_pair]


def joined_detection():
    """A block of frame 0, with a noted reason, and one of frames 1 and 2, joined."""
    first = detection([[UNRESOLVED, CLEAR, CLEAR]], reasons={(0, 0): "noted"})
    second = detection([[UNRESOLVED, CLEAR, CLEAR], [CLEAR, INVALID, CLEAR]], start=1)
    return join([first, second])


def test_reasons_stay_with_their_frames_in_blocks():
    """A block of frame 0, whose reason was noted, and one of frames 1 and 2, whose reasons are those of pair 0 and pair
    1.

    Reasons of the joined detection are by frame and pair, and so they are after pickling.
    """
    expected = {(0, 0): "noted", (1, 0): "inside undecided: cup has holes", (2, 1): "not supported"}
    assert joined_detection().reasons == expected
    assert pickle.loads(pickle.dumps(joined_detection())).reasons == expected


def test_reasons_stay_with_their_frames_in_selections():
    """Pairs are undecided in frames 0 (noted why), 1 and 2 (as pair 1 is not supported); frames 0 and 2 become frames 0
    and 1.
    """
    selected = joined_detection().take(np.array([0, 2]))
    assert selected.reasons == {(0, 0): "noted", (1, 1): "not supported"}
