"""The schema in the repository is that of the summaries written, and refuses what is none."""

import copy
import json
from importlib.resources import files

import pytest
from jsonschema import Draft202012Validator
from support.small_worlds import cubes

from replay.pipeline.engine import compute
from replay.pipeline.summary import SCHEMA
from sessions.synthetic.analytic import make_analytic

SCHEMA_FILE = json.loads(files("replay.outputs.results").joinpath("summary.schema.json").read_text(encoding="utf-8"))
VALIDATOR = Draft202012Validator(SCHEMA_FILE)
PLACES = {"a": [0] * 12, "b": [3, 3, 3, 3, 0.9, 3, 3, 3, 0.9, 0.8, 0.9, 3]}


def as_json(result):
    return json.loads(json.dumps(result.summary, allow_nan=False))


def test_the_schema_is_one_and_has_the_number_of_the_code():
    Draft202012Validator.check_schema(SCHEMA_FILE)
    assert SCHEMA_FILE["$id"] == SCHEMA_FILE["properties"]["schema"]["const"] == SCHEMA


@pytest.mark.parametrize(
    "asked",
    [
        {"detectors": "slow=discrete[rate_hz=20],sphere,hybrid-qaco,collider"},
        {"detectors": "exact", "oracle": "continuous"},
        {"detectors": "hybrid", "oracle": "none"},
        {"detectors": ()},
    ],
)
def test_every_kind_of_run_fits_it(asked):
    assert [error.message for error in VALIDATOR.iter_errors(as_json(compute(cubes(PLACES), **asked)))] == []


def test_what_is_no_summary_does_not_fit():
    good = as_json(compute(make_analytic("fast-ball", seconds=1.0)[0], detectors="slow=discrete[rate_hz=20]"))
    for path, value in [
        (("audit", "slow", "missed", "share"), 1.5),
        (("audit", "slow", "pair_frames", "MISSED"), -1),
        (("audit", "slow", "surprise"), 1),
        (("detectors", "slow", "digest"), "short"),
        (("schema",), "vrlab-replay/run/2"),
    ]:
        bad = copy.deepcopy(good)
        at = bad
        for key in path[:-1]:
            at = at[key]
        at[path[-1]] = value
        assert not VALIDATOR.is_valid(bad), path
        del at[path[-1]]
        if path[-1] != "surprise":
            assert not VALIDATOR.is_valid(bad), path
