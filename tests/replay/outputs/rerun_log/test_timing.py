"""Timings read back are those of the detection, in milliseconds; offline detectors are not dressed as online ones."""

from dataclasses import replace

import numpy as np
import pytest

from cdcore import detect_live
from replay.outputs.rerun_log.timing import cost_of

ORACLE, SUBJECT = "hybrid", "22.5Hz"


def test_an_online_detector_has_a_row_for_each_look(demo, read):
    seconds = demo.detections[SUBJECT].seconds
    looks = np.flatnonzero(np.sum(list(seconds.values()), axis=0) > 0)
    for stage, values in seconds.items():
        rows = read.column(f"timing/22.5Hz/{stage}", "Scalars:scalars")
        assert [row[1] for row in rows] == looks.tolist()
        assert np.allclose([row[2][0] for row in rows], np.asarray(values)[looks] * 1e3)


def test_asked_live_every_frame_has_its_time_and_the_quantiles_are_of_looks(demo, write):
    live = detect_live(demo.detectors[SUBJECT], demo.assembly.motion)
    seen = write(replace(demo, detections={**demo.detections, SUBJECT: live}))
    for stage, values in live.seconds.items():
        rows = seen.column(f"timing/22.5Hz/{stage}", "Scalars:scalars")
        assert [row[1] for row in rows] == list(range(270))
        assert np.allclose([row[2][0] for row in rows], values * 1e3)
    assert len(cost_of(live).per_frame) == len(cost_of(demo.detections[SUBJECT]).per_frame) == 68


def test_the_total_is_the_sum_of_the_stages(demo, read):
    stages = [
        [row[2][0] for row in read.column(f"timing/22.5Hz/{stage}", "Scalars:scalars")]
        for stage in demo.detections[SUBJECT].seconds
    ]
    total = [row[2][0] for row in read.column("timing/22.5Hz/1_total", "Scalars:scalars")]
    assert np.allclose(total, np.sum(stages, axis=0))


def test_an_offline_detector_is_a_mean_over_the_session(demo, read):
    rows = read.column("timing/hybrid/meshes", "Scalars:scalars")
    mean = float(demo.detections[ORACLE].seconds["meshes"]) * 1e3 / 270
    assert [row[1] for row in rows] == [0, 269]
    assert [row[2][0] for row in rows] == pytest.approx([mean, mean])
    assert "all at once" in cost_of(demo.detections[ORACLE]).words()


def test_counters_read_back_as_they_are(demo, read):
    for label, detection in demo.detections.items():
        for name, value in detection.work.items():
            assert read.column(f"counters/{label}/{name}", "Scalars:scalars")[0][2] == [float(value)]
