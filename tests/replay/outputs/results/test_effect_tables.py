import json

import numpy as np
import pytest
from support.small_worlds import STEP_NS, cubes

from replay.outputs.results.parquet_tables import series_table
from replay.pipeline.engine import compute
from replay.pipeline.result_tables import EFFECT
from sessions import Event
from sessions.model.scene import Scene, SceneBody, SceneEffect

SCENE = Scene(bodies=(SceneBody("a"), SceneBody("b")), effects=(
    SceneEffect("contact", {"between": ["a", "b"]}),
    SceneEffect("hazard-proximity", {"of": "a", "hazard": "b", "distance": 1}),
))  # fmt: skip
PLACES = {"a": [0] * 8, "b": [3, 3, 0.9, 0.9, 0.9, 3, 3, 3]}


@pytest.fixture(scope="module")
def result():
    return compute(cubes(PLACES, scene=SCENE, events=[Event(3 * STEP_NS, "buttondown")]), detectors=(), start=0.01)


def test_events_of_effects_stand_among_the_recorded_ones_on_the_same_clock(result):
    rows = result.tables["events"].plain()
    rows = [row for row in rows if row["source"] != f"{EFFECT}hazard-proximity"]
    assert [row["source"] for row in rows] == ["effect/contact", "event"]
    contact = rows[0]
    assert (contact["stamp_ns"], contact["end_stamp_ns"]) == (2 * STEP_NS, 5 * STEP_NS)
    assert (contact["time"], contact["end_time"]) == (0.02, 0.05) and contact["body"] == "a b"
    report = json.loads(contact["values"])
    assert report["frames"] == 3 and len(report["point"]) == 3 and rows[1]["values"] == ""


def test_series_keep_every_value_to_the_last_bit(result):
    table = series_table(result)
    series = result.effects["hazard-proximity"].series["a-b/distance"]
    assert np.array_equal(table["value"].to_numpy(), series.values) and set(table["unit"].to_pylist()) == {"m"}
    assert np.array_equal(table["time"].to_numpy(), series.times)


def test_without_effects_the_tables_are_empty_and_whole():
    plain = compute(cubes(PLACES), detectors=())
    assert series_table(plain).num_rows == 0 and series_table(plain).column_names[-1] == "value"
    assert plain.tables["events"].rows == ()
