"""The picture says of every frame which bodies were in doubt, and lists what was found in words."""

from dataclasses import replace

import numpy as np
import pytest
from rerun.chunk import RrdReader
from support.planted_faults import FAULTS, clean

from replay.outputs.rerun_log.findings import finding_lanes, finding_list
from replay.outputs.rerun_log.recording import write_recording
from replay.pipeline.engine import compute


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


def test_without_an_examination_there_is_neither_lane_nor_list(doubtful):
    bare = replace(doubtful, treatment=None)
    assert finding_lanes(bare) is None
    assert finding_list(bare) == "Nothing suspicious found."
