"""Lanes say exactly when, numbers say which, and of every frame which bodies were in doubt."""

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from rerun.chunk import RrdReader
from support.planted_faults import FAULTS, clean

from cdcore import Verdict
from replay.comparison.outcome import Outcome
from replay.outputs.palette import INVENTED, MISSED, OUTCOMES
from replay.outputs.rerun_log.columns import packed
from replay.outputs.rerun_log.findings import KIND_LOOKS, finding_lanes, finding_list
from replay.outputs.rerun_log.lanes import audit_lanes
from replay.outputs.rerun_log.recording import write_recording
from replay.pipeline.engine import compute
from replay.pipeline.run_result import RunResult

SUBJECT = "22.5Hz"


def states_at(lane: list[tuple[int, str]], stamps: np.ndarray) -> list[str]:
    times = [ns for ns, _ in lane]
    return [lane[k][1] for k in np.searchsorted(times, stamps, side="right") - 1]


def test_an_audit_lane_says_the_outcome_of_every_frame(demo: RunResult, read: Any) -> None:
    stamps = demo.assembly.stamp_ns - demo.assembly.stamp_ns[0]
    comparison = demo.comparisons[SUBJECT]
    lanes = audit_lanes("lanes", demo.assembly, comparison)
    assert list(lanes) == ["lanes/1_missed", "lanes/2_beaker-rod", "lanes/3_bench-rod", "lanes/4_rod-hand_held"]
    for path, column in lanes.items():
        if column is not None:
            words = [OUTCOMES[code][0] if code else "" for code in comparison.outcome[:, column].tolist()]
            assert states_at(read.lane(path), stamps) == words


def test_a_detector_lane_says_the_verdict_of_every_frame(demo: RunResult, read: Any) -> None:
    stamps = demo.assembly.stamp_ns - demo.assembly.stamp_ns[0]
    for label, detection in demo.detections.items():
        path = next(p for p in read.entities if p.startswith("/detectors/1_") and p.endswith(label))
        words = [Verdict(code).name if code else "" for code in detection.verdict[:, 0].tolist()]
        assert states_at(read.lane(path[1:]), stamps) == words


def test_between_two_states_lies_a_reset_of_one_nanosecond(demo: RunResult, read: Any) -> None:
    lane = read.lane("lanes/2_beaker-rod")
    touching = [(a, b) for a, b in pairwise(lane) if a[1] and b[1]]
    assert not touching
    resets = [b[0] - a[0] for a, b in pairwise(lane) if not a[1] and b[1] and b[0] - a[0] == 1]
    assert resets


def test_the_last_state_lasts_one_frame(demo: RunResult, write: Any) -> None:
    whole = np.full_like(demo.comparisons[SUBJECT].outcome, Outcome.MISSED)
    seen = write(replace(demo, comparisons={SUBJECT: replace(demo.comparisons[SUBJECT], outcome=whole)}))
    stamps = demo.assembly.stamp_ns - demo.assembly.stamp_ns[0]
    lane = seen.lane("lanes/2_beaker-rod")
    assert lane[-2:] == [(0, "MISSED"), (int(stamps[-1]) + 11_111_111, "")]


def test_lanes_are_on_the_session_timeline_alone(read: Any) -> None:
    names = {name for batch in read.entities["/lanes/2_beaker-rod"] for name in batch.schema.names}
    assert "session" in names
    assert "frame" not in names


def test_the_red_of_a_lane_is_the_red_of_the_picture(read: Any) -> None:
    values = read.column("lanes/2_beaker-rod", "StateConfiguration:values")[0][2]
    colours = read.column("lanes/2_beaker-rod", "StateConfiguration:colors")[0][2]
    assert colours[values.index("MISSED")] == packed([MISSED])[0]


def test_every_lane_has_a_row_at_the_start(read: Any) -> None:
    lanes = [path for path in read.entities if path.startswith(("/lanes/", "/detectors/"))]
    assert lanes
    assert all(read.lane(path[1:])[0][0] == 0 for path in lanes)


@pytest.mark.parametrize("number", [0, 4])
def test_the_number_lane_shows_the_number_at_the_miss(demo: RunResult, read: Any, number: int) -> None:
    miss = demo.misses[SUBJECT][number]
    low, _, high = states_at(read.lane("lanes/1_missed"), np.array([round(miss.start * 1e9)]))[0].partition("-")
    assert int(low) <= miss.number <= int(high or low)


@pytest.fixture(scope="module")
def doubtful():
    draft = clean()
    FAULTS["frozen pose"](draft, 1, 300)
    FAULTS["nan position"](draft, 0, 500)
    FAULTS["1 s gap"](draft, 0, 700)
    return compute(draft.session(), detectors="sphere", oracle="none", policy=["not-finite=drop"])


def lane(path, entity):
    """(nanoseconds, state) of a lane, in order."""
    rows = []
    for chunk in RrdReader(path).stream().filter(content=f"/{entity}").to_chunks():
        batch = chunk.to_record_batch()
        states = [name for name in batch.schema.names if name.endswith("StateChange:state")]
        if states and "session" in batch.schema.names:
            times = batch.column("session").cast("int64").to_pylist()
            rows += zip(times, (value[0] for value in batch.column(states[0]).to_pylist()), strict=True)
    return sorted(rows)


def test_a_lane_says_the_doubt_of_every_frame(doubtful, tmp_path):
    write_recording(doubtful, tmp_path / "run.rrd")
    assert finding_lanes(doubtful) == ("findings/lanes/flask", "findings/lanes/hand-left", "findings/lanes/time")
    rows = lane(tmp_path / "run.rrd", "findings/lanes/hand-left")
    stamps = doubtful.assembly.stamp_ns - doubtful.assembly.stamp_ns[0]
    times = [time for time, _ in rows]
    states = [rows[k][1] for k in np.searchsorted(times, stamps, side="right") - 1]
    assert [k for k, state in enumerate(states) if state == "frozen"] == list(range(300, 360))
    assert states[360] == "teleport" and not any(states[:300]) and not any(states[361:])


def test_the_list_explains_each_code_once(doubtful):
    text = finding_list(doubtful)
    assert text.count("**frozen**") == 1 and "| warning | frozen | hand-left | 3.333 to 3.989 |" in text
    assert "nothing for 1.01 s" in text


def test_without_an_examination_there_is_neither_lane_nor_list(doubtful):
    bare = replace(doubtful, treatment=None)
    assert finding_lanes(bare) is None
    assert finding_list(bare) == "Nothing is wrong with this recording."


def test_no_doubt_wears_the_colour_of_a_miss():
    colours = [colour for _, colour in KIND_LOOKS.values()]
    assert len(set(colours)) == len(colours) and MISSED not in colours and INVENTED not in colours
