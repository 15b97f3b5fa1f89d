"""Timings read back are those of the detection, in milliseconds; offline detectors are not dressed as online ones."""

from dataclasses import replace

import numpy as np
import pytest

from cdcore import detect_live
from replay.base.constants import BUDGET_MS
from replay.outputs.rerun_log.timing import cost_of, cost_text

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


def test_the_budget_is_a_frame_at_90_hz(read):
    assert {row[2][0] for row in read.column("timing/budget", "Scalars:scalars")} == {BUDGET_MS}
    assert pytest.approx(11.111, abs=1e-3) == BUDGET_MS


def test_counters_read_back_as_they_are(demo, read):
    for label, detection in demo.detections.items():
        for name, value in detection.work.items():
            assert read.column(f"counters/{label}/{name}", "Scalars:scalars")[0][2] == [float(value)]


def test_counters_per_pair_frame_are_summed_over_pairs(demo, write):
    table = np.arange(270 * 3, dtype=np.uint32).reshape(270, 3)
    counted = replace(demo.detections[ORACLE], work={"tests": table})
    seen = write(replace(demo, detections={**demo.detections, ORACLE: counted}))
    assert [row[2][0] for row in seen.column("counters/hybrid/tests", "Scalars:scalars")] == table.sum(axis=1).tolist()


def test_peaks_survive_zooming_out(read):
    assert read.column("timing/22.5Hz/1_total", "SeriesLines:aggregation_policy")


def test_the_table_names_every_detector_stage_and_counter(demo):
    text = cost_text(demo.detections, {SUBJECT: "misses in 3 of 9 contacts"})
    assert "misses in 3 of 9 contacts" in text
    for label, detection in demo.detections.items():
        assert all(word in text for word in (label, *detection.seconds, *detection.work))
