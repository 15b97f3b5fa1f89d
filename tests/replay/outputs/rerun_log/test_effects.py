from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import rerun as rr
from rerun.chunk import RrdReader

from replay.effects.effects_runner import SKIPPED, EffectRun
from replay.effects.output import EffectEvent, EffectOutput, LaneSpan, Liquid, Series
from replay.effects.protocol import EffectSpec
from replay.outputs.rerun_log.effects import (
    log_effects,
    log_happened,
)
from replay.outputs.rerun_log.lanes import COLON
from replay.outputs.rerun_log.moments import read_moments
from replay.outputs.rerun_log.recording_file import RecordingWriter

TIMES = np.array([0.0, 0.5, 1.0])
OUTPUT = EffectOutput(
    events=(
        EffectEvent(0.25, "pours", ("cup",)),
        EffectEvent(0.5, "spill", ("cup",), message="3 mL beside", level="warning", point=(1.0, 2.0, 3.0)),
    ),
    series={"cup/volume": Series(TIMES, np.array([3.0, 2.0, np.nan]), "mL")},
    lanes={"cup": (LaneSpan(0.0, 0.5, "pours"), LaneSpan(0.5, 1.0, "spills")), SKIPPED: (LaneSpan(0.5, 1.0, SKIPPED),)},
    liquids={"cup": Liquid(TIMES, np.array([0.05, 0.03, 0.01]), 0.01, 0.02, np.full((3, 4), 200, dtype=np.uint8))},
)


def run_of(kind, output):
    return EffectRun(EffectSpec(kind, "x", lambda i: output), ("declared",), output, 0.1, {}, 3, 2)


RUNS = {"pour": run_of("pour", OUTPUT)}


@pytest.fixture(scope="module")
def entities(tmp_path_factory):
    """Entity path -> rows of the recording."""
    path = tmp_path_factory.mktemp("picture") / "effects.rrd"
    stream = rr.RecordingStream("test")
    stream.save(path)
    log_effects(RecordingWriter(stream, SimpleNamespace()), RUNS)
    stream.disconnect()
    rows = {}
    for chunk in RrdReader(str(path)).stream():
        rows.setdefault(str(chunk.entity_path), []).append(chunk.to_record_batch())
    return rows


def values(batches, name):
    for batch in batches:
        for field in batch.schema.names:
            if field.endswith(name):
                return batch.column(field).to_pylist()
    raise AssertionError(f"no {name} in {[batch.schema.names for batch in batches]}")


def test_every_part_of_an_effect_has_an_entity_and_nothing_else_has(entities):
    told = {path for path in entities if not path.startswith("/__")}
    assert told == {
        "/effects/pour/cup/volume", "/effects/pour/events", f"/1_cup{COLON}pour",
        "/world/effects/pour/1", "/world/cup/liquid",
    }  # fmt: skip


def test_values_and_words_arrive_as_they_are(entities):
    scalars = [row[0] for row in values(entities["/effects/pour/cup/volume"], "scalars")]
    assert scalars[:2] == [3.0, 2.0] and np.isnan(scalars[2])
    assert values(entities["/effects/pour/events"], ":text") == [["pours cup"], ["3 mL beside"]]


def test_a_liquid_is_a_cylinder_from_the_floor_to_its_level_and_unseen_when_empty(entities):
    batches = entities["/world/cup/liquid"]
    assert np.allclose(np.ravel(values(batches, "lengths")), [0.04, 0.02, 1e-6], atol=1e-7)
    assert np.allclose(np.array(values(batches, "centers")).reshape(-1, 3)[:, 1], [0.03, 0.02, 0.01])
    assert [colour & 255 for colour in np.ravel(values(batches, "colors"))] == [200, 200, 0]


ENDS = run_of("reaction", EffectOutput(events=(EffectEvent(0.1, "end-point", ("cup",), message="equivalent"),)))


@pytest.mark.parametrize(
    ("runs", "leads", "title", "opens"),
    [
        ({**RUNS, "reaction": ENDS}, True, "# Equivalent\n\nAt 0.1 s, one of 3 events.", 350_000_000),
        (RUNS, True, "# 3 mL beside\n\nAt 0.5 s, the last of 2 events.", 750_000_000),
        (RUNS, False, "# 3 mL beside\n\nAt 0.5 s, the last of 2 events.", None),
        ({"pour": replace(RUNS["pour"], output=EffectOutput())}, True, "## No effect found anything", None),
        ({}, True, "## What people did", None),
    ],
)
def test_the_answer_is_the_result_or_the_last_event_and_the_picture_opens_after_it(tmp_path, runs, leads, title, opens):
    stream = rr.RecordingStream("test")
    stream.save(tmp_path / "run.rrd")
    writer = RecordingWriter(stream, SimpleNamespace(ns=np.array([0, 1_000_000_000])))
    log_happened(writer, runs, leads=leads)
    stream.disconnect()
    rows = {
        str(chunk.entity_path): [chunk.to_record_batch()] for chunk in RrdReader(str(tmp_path / "run.rrd")).stream()
    }
    assert values(rows["/happened"], ":text") == [[title]]
    assert [one.session_ns for one in read_moments(tmp_path / "run.rrd")] == ([] if opens is None else [opens])
