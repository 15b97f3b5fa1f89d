from dataclasses import replace

import numpy as np
import pytest
from support.small_worlds import cubes

from replay.outputs.results import parquet_tables as tables
from replay.outputs.results.parquet_tables import frame_table, timing_table
from replay.pipeline.engine import compute
from replay.prepare.flags import Flags
from sessions import Event, Interval, Scene, Session
from sessions.model.scene import SceneBody

PLACES = {"a": [0] * 12, "b": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3], "c": [9] * 12}


@pytest.fixture(scope="module")
def result():
    scene = Scene(bodies=(SceneBody("b", parent=""),))
    events = [Event(50_000_000, "buttondown", "trigger", "b")]
    intervals = [Interval(20_000_000, 90_000_000, "task", "stir", {"by": "p1"})]
    session = cubes(PLACES, scene=scene, events=events, intervals=intervals)
    # These cubes step metres in 10 ms: each such frame would be flagged as a teleport.
    found = compute(session, detectors="slow=discrete[rate_hz=20]", oracle="hybrid")
    return replace(found, flags=Flags(np.zeros_like(found.flags.bodies)))


def rows(table):
    return table.to_pylist()


def test_frame_rows_are_exactly_the_pair_frames_in_which_anything_happened(result):
    (table,) = frame_table(result)
    got = [(row["frame"], row["body_a"], row["body_b"]) for row in rows(table)]
    contact = result.detections["hybrid"].verdict[:, 0] + result.detections["slow"].verdict[:, 0]
    assert got == [(frame, "a", "b") for frame in np.flatnonzero(contact).tolist()]


def test_frame_rows_hold_verdicts_outcomes_misses_and_stamps(result):
    (table,) = frame_table(result)
    row = next(row for row in rows(table) if row["frame"] == 4)
    assert (row["stamp_ns"], row["time"], row["held"]) == (40_000_000, 0.04, False)
    assert (row["verdict/slow"], row["verdict/hybrid"], row["outcome/slow"]) == ("CLEAR", "CONTACT", "MISSED")
    assert row["miss/slow"] == 1
    assert next(row for row in rows(table) if row["frame"] == 10)["miss/slow"] is None
    assert isinstance(row["frame_seconds/slow"], float) and "frame_seconds/hybrid" not in row


def test_every_frame_has_its_seconds_by_stage_and_the_oracle_has_none(result):
    table = timing_table(result)
    stages = result.detections["slow"].seconds
    assert table.column_names == ["frame", "stamp_ns", "time", *(f"seconds/slow/{stage}" for stage in stages)]
    assert table["frame"].to_pylist() == list(range(12)) and table["time"].to_pylist()[4] == 0.04
    for stage, seconds in stages.items():
        assert table[f"seconds/slow/{stage}"].to_pylist() == seconds.tolist()


def test_a_long_frame_table_comes_in_parts_that_join_to_the_whole(result, monkeypatch):
    (whole,) = frame_table(result)
    monkeypatch.setattr(tables, "ROWS_PER_PART", 2)
    parts = list(frame_table(result))
    assert len(parts) == -(-whole.num_rows // 2)
    assert [row for part in parts for row in rows(part)] == rows(whole)


def test_a_run_in_which_nothing_happened_has_a_table_without_rows():
    quiet = compute(cubes({"a": [0, 0], "b": [5, 5.01]}), detectors="hybrid", oracle="hybrid")
    (table,) = frame_table(quiet)
    assert table.num_rows == 0 and "verdict/hybrid" in table.column_names
    assert all(not made.rows for made in quiet.tables.values())


def test_a_pair_frame_in_doubt_has_a_row_whatever_was_said_of_it_and_names_the_doubt():
    jump = compute(cubes({"a": [0] * 9, "b": [5] * 4 + [5.5] * 5}), detectors="hybrid", oracle="none")
    (table,) = frame_table(jump)
    assert [(row["frame"], row["flag"], row["verdict/hybrid"]) for row in rows(table)] == [(4, "teleport", "CLEAR")]


def test_events_and_spans_stand_on_the_sessions_clock(result):
    span, event = result.tables["events"].plain()
    assert (span["source"], span["name"], span["time"], span["end_time"]) == ("task", "stir", 0.02, 0.09)
    assert (span["message"], span["end_stamp_ns"]) == ("by=p1", 90_000_000)
    assert (event["source"], event["name"], event["body"], event["time"]) == ("event", "buttondown", "b", 0.05)
    assert event["end_time"] is None


def test_events_keep_the_sessions_clock_in_a_run_that_starts_later():
    made, begin = cubes(PLACES), 10**18
    poses = {name: (track.positions, track.quaternions_xyzw) for name, track in made.tracks.items()}
    events = [Event(begin + 50_000_000, "x")]
    session = Session.from_arrays(begin + made.frames.stamp_ns, poses, dict(made.meshes), events=events)
    late = compute(session, detectors="hybrid", oracle="none", start=0.03)
    assert late.tables["events"].plain()[0]["time"] == pytest.approx(0.05, abs=1e-12)


def test_every_column_says_what_it_holds_and_all_are_written_with_their_types(result):
    for made in result.tables.values():
        columns = made.columns
        assert len({column.name for column in columns}) == len(columns)
        assert all(len(column.meaning) > 4 for column in columns)
        table = made.to_arrow()
        assert table.schema.names == [column.name for column in columns] and table.to_pylist() == made.plain()
        kinds = {str: "string", int: "int64", float: "double", bool: "bool"}
        assert [str(kind) for kind in table.schema.types] == [kinds[column.dtype] for column in columns]
