import pytest
from small_worlds import cubes

from replay.engine import compute


def test_everything_in_a_result_speaks_of_the_same_frames_and_pairs():
    result = compute(cubes({"a": [0] * 9, "b": [3, 0.9, 3] * 3}), detectors="sphere", oracle="hybrid")
    shape = (len(result.assembly.motion), len(result.assembly.pairs))
    assert all(detection.verdict.shape == shape for detection in result.detections.values())
    assert all(comparison.outcome.shape == shape for comparison in result.comparisons.values())
    assert set(result.episodes) == set(result.detections) == {"sphere", "hybrid"}
    assert set(result.misses) == set(result.comparisons) == {"sphere"}
    assert result.out is None


def test_a_result_cannot_be_changed():
    result = compute(cubes({"a": [0, 0], "b": [3, 0.9]}), detectors="hybrid", oracle="none")
    with pytest.raises(AttributeError):
        result.oracle = "mine"
    with pytest.raises(ValueError, match="read-only"):
        result.detections["hybrid"].verdict[0, 0] = 1
