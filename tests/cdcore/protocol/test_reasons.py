"""Every undecided verdict has a reason: the one noted, that of its pair, or that there is none."""

import pickle

import numpy as np
import pytest

from cdcore import Detection, Verdict, join
from cdcore.protocol.detection import NO_REASON

UNRESOLVED, INVALID, NO_POSE, CLEAR = Verdict.UNRESOLVED, Verdict.INVALID, Verdict.NO_POSE, Verdict.CLEAR
TEXTS = ("partly: inside undecided: cup has holes", "refused: not supported", "decided")


def detection(verdict, reasons=(), containment=TEXTS, start=0):
    """A detection of three pairs with these verdicts, a second apart."""
    verdict = np.array(verdict, dtype=np.uint8)
    times = start + np.arange(len(verdict), dtype=float)
    return Detection(
        "d", ("a", "b", "c"), np.array([[0, 1], [0, 2], [1, 2]]), times, verdict,
        containment=containment, reasons=dict(reasons),
    )  # fmt: skip


def test_undecided_verdicts_get_the_reason_of_their_pair():
    """Two frames of three pairs, whose texts about containment are TEXTS."""
    answer = detection([[UNRESOLVED, INVALID, CLEAR], [CLEAR, CLEAR, UNRESOLVED]])
    assert answer.reasons == {
        (0, 0): "inside undecided: cup has holes",
        (0, 1): "not supported",
        (1, 2): NO_REASON,
    }
    assert len(answer.reasons) == 3
    assert detection([[UNRESOLVED, CLEAR, CLEAR]], containment=()).reasons == {(0, 0): NO_REASON}


def test_a_noted_reason_comes_before_that_of_the_pair():
    """Unnoted, they would be those for a mesh with holes and for a missing pose."""
    answer = detection([[UNRESOLVED, NO_POSE, CLEAR]], {(0, 0): "half a turn", (0, 1): "lost"})
    assert answer.reasons == {(0, 0): "half a turn", (0, 1): "lost"}


@pytest.mark.parametrize("position", [(0, 2), (5, 0), (-1, 0), (0, 3)])
def test_decided_or_absent_pairs_have_no_reason(position):
    """``position``: (frame, pair) of one frame with three pairs; the third is clear."""
    answer = detection([[UNRESOLVED, INVALID, CLEAR]])
    assert position not in answer.reasons
    with pytest.raises(KeyError):
        answer.reasons[position]


def test_reasons_stay_with_their_frames_in_blocks_and_selections():
    """The second block begins at frame 1; (frame, pair) are the keys."""
    first, second = (
        detection([[UNRESOLVED, CLEAR, CLEAR]], {(0, 0): "noted"}),
        detection([[UNRESOLVED, CLEAR, CLEAR], [CLEAR, INVALID, CLEAR]], start=1),
    )
    joined = join([first, second])
    expected = {(0, 0): "noted", (1, 0): "inside undecided: cup has holes", (2, 1): "not supported"}
    assert joined.reasons == expected
    assert joined.take(np.array([0, 2])).reasons == {(0, 0): "noted", (1, 1): "not supported"}
    assert pickle.loads(pickle.dumps(joined)).reasons == expected
