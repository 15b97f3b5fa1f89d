"""Events planted in the nine experiments, with tracker noise, are reported once and no others."""

import tomllib
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from replay.effects.effect_plan import plan
from replay.effects.effect_summary import leading_event
from replay.engine import compute
from replay.studies.synthetic_sessions import synthetic_session

pytestmark = pytest.mark.slow

POURED = ("acid-dilution", "silver-chloride", "gas-collection")
SEEDS = (0, 1)

BY_EYE = {"abs": 1.0, "rel": 0.02}
"""Within 1 mL or 2 %, whichever is less strict: what the eye reads off a beaker."""
EXPECTED = tomllib.loads(Path(__file__).with_name("planted.toml").read_text("utf-8"))["found"]


@cache
def replayed(name, seed=0):
    """A run over a made-up experiment, and what was planted in it."""
    session, truth = synthetic_session(name, seed=seed)
    return compute(session, detectors=()), truth


def planted(truth, kind):
    """Planted facts of a kind, in order of time."""
    return sorted((fact for fact in truth.facts if fact.kind == kind), key=lambda fact: fact.start)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(("name", "row"), [(name, row) for row in EXPECTED for name in row["experiments"]])
def test_every_planted_event_is_reported_once(name, row, seed):
    """A row of the table: events, the facts they report, and how near each value must be."""
    result, truth = replayed(name, seed)
    reported, facts = result.effects[row["effect"]].output.events_named(row["event"]), planted(truth, row["fact"])
    if row["effect"] == "grasp":
        declared = plan(result.session.scene).steps["grasp"].declared
        requested = {frozenset(pair) for item in declared for pair in item["between"]}
        facts = [item for item in facts if frozenset(item.bodies) in requested]
    assert len(reported) == len(facts) > 0
    for actual, true in zip(reported, facts, strict=True):
        assert not true.bodies or set(actual.bodies) & set(true.bodies)
        assert "begin" not in row or actual.time == pytest.approx(true.start, abs=row["begin"])
        assert "end" not in row or actual.end == pytest.approx(true.end, abs=row["end"])
        for key, near in row.get("values", {}).items():
            expected = true.values[near["planted"]]
            assert actual.values[key] == pytest.approx(expected, near.get("rel"), near.get("abs"))


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("name", POURED)
def test_every_planted_pour_is_reported_with_its_volume(name, seed):
    """Pours above 0.5 mL are those planted; drops may be reported beside them, and no millilitre is lost."""
    result, truth = replayed(name, seed)
    run, facts = result.effects["pour"], planted(truth, "pour")
    reported = run.output.events_named("pour")
    large = [event for event in reported if event.values["volume_ml"] > 0.5]
    assert [event.bodies for event in large] == [(f.values["source"], f.values["target"]) for f in facts]
    assert sum(event.values["volume_ml"] for event in reported if event not in large) < 0.5
    for event, fact in zip(large, facts, strict=True):
        assert event.time == pytest.approx(fact.start, abs=0.05)
        assert event.values["volume_ml"] == pytest.approx(fact.values["volume_ml"], **BY_EYE)
        left = run.series[f"{fact.values['source']}/volume"]
        assert left.values[left.times <= fact.end + 1.0][-1] == pytest.approx(fact.values["left_ml"], **BY_EYE)
    ends = [series.values[-1] for series in run.series.values()]  # what is in the vessels, and what was spilled
    assert sum(ends) == pytest.approx(sum(item.volume_ml for item in run.output.data.vessels.values()), rel=1e-9)
    assert 0 < run.frames_run < 0.06 * run.frames


def test_the_indicator_changes_at_the_end_point():
    """A made-up titration says at how many mL of the burette its end point is: within 0.05 mL, about a drop."""
    result, truth = replayed("titration")
    (change,), (fact,) = result.effects["colour"].output.events_named("colour-change"), planted(truth, "end_point")
    volume = result.effects["burette"].series["burette/delivered"]
    observed = float(volume.values[volume.times <= change.time][-1])
    assert observed == pytest.approx(fact.values["volume_ml"], abs=0.05) and change.end is not None


def test_all_marble_dissolves_in_acid_that_is_in_excess():
    """The made-up experiment says what pH is left."""
    result, truth = replayed("marble")
    (event,), (fact,) = result.effects["precipitation"].output.events_named("dissolved"), planted(truth, "dissolve")
    assert event.values["left_g"] == 0.0
    assert result.effects["reaction"].series["marble/pH"].values[-1] == pytest.approx(fact.values["ph"], abs=0.02)


@pytest.mark.parametrize("seed", SEEDS)
def test_gas_that_leaves_while_the_jar_stands_is_as_planted(seed):
    """Planted are the mol of H2 that leave before the jar is over the flask, and until it is taken away."""
    result, truth = replayed("gas-collection", seed)
    (fact,), gone = planted(truth, "collect"), result.effects["reaction"].series["flask/H2 gone"]
    entered, left = np.interp([fact.start, fact.end], gone.times, gone.values)
    assert entered == pytest.approx(fact.values["leaked_before_mol"], rel=0.02)
    assert left - entered == pytest.approx(fact.values["collected_mol"], rel=0.02)
    (event,) = result.effects["reaction"].output.events_named("gas")
    assert event.values["moles"] == gone.values[-1] > left


def test_the_warmth_of_the_calorimeter_is_the_result():
    """The temperature, of all events, leads the summary."""
    assert "warms from 20.00 to 24.4" in leading_event(replayed("ammonia-calorimetry")[0].effects).text
