"""Details: the times and counters of a detector are those of its detection."""

import numpy as np


def test_counters_and_times_of_stages_are_those_of_the_detection(demo, read):
    for label, detection in demo.detections.items():
        for name, value in detection.work.items():
            path = f"counters/{label}/{name}"
            rows = read.column(path, "Scalars:scalars")
            assert [rows[0][2][0]] == [float(value)] if np.any(value) else rows == []
        total = read.column(f"timing/{label}/total", "Scalars:scalars")
        seconds = list(detection.seconds.values())
        if isinstance(seconds[0], np.ndarray):
            assert np.allclose([row[2][0] for row in total], 1e3 * np.sum(seconds, axis=0))
        else:
            mean = 1e3 * sum(seconds) / len(detection.times)
            assert [row[1] for row in total] == [0, len(detection.times) - 1]
            assert np.allclose([row[2][0] for row in total], mean)
