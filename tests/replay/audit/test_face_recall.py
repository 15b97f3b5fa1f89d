import numpy as np
import pytest
from small_worlds import cubes, verdict_column

from cdcore.protocol import FaceSets
from replay.audit.compare import compare
from replay.audit.face_recall import FaceRecall, face_recall
from replay.engine import compute


def test_pairs_of_faces_are_compared_where_both_decided_and_missed_frames_count():
    truth = FaceSets.from_lists([0, 1, 2], [0, 0, 0], [np.array([[0, 1], [0, 2]])] * 3)
    said = FaceSets.from_lists([0, 2], [0, 0], [np.array([[0, 2], [1, 1]]), np.array([[0, 1], [0, 2]])])
    comparison = compare(verdict_column("C.-"), verdict_column("CCC"))
    assert face_recall(said, truth, comparison) == FaceRecall(found=1, total=4, pair_frames=2, invented=1)


@pytest.mark.parametrize(("detector", "recall"), [("hybrid", 1.0), ("slow=discrete[rate_hz=20]", None)])
def test_a_run_compares_faces_when_asked(detector, recall):
    session = cubes({"a": [0] * 12, "b": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3]})
    result = compute(session, detectors=detector, oracle="exact", faces=True)
    (figures,) = result.summary["audit"].values()
    told = figures["faces"]
    assert told["pair_frames"] == 4 and told["recall"]["of"] == result.detections["exact"].face_counts.sum()
    assert told["recall"]["share"] == recall if recall else told["recall"]["share"] < 0.9


def test_a_detector_without_faces_and_a_run_that_did_not_ask_say_nothing():
    session = cubes({"a": [0, 0], "b": [3, 0.9]})
    assert compute(session, detectors="sphere", faces=True).summary["audit"]["sphere"]["faces"] is None
    assert compute(session, detectors="hybrid").summary["audit"]["hybrid"]["faces"] is None
