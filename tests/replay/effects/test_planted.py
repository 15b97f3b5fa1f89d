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
    """A made-up experiment comes with facts, what was planted and when; each is one reported event, and no other is.

    A row of planted.toml has an effect's event, the fact that it reports, seconds by which begin and end may differ,
    and the values that must be near planted ones. Grasps count of pairs of which the scene declares grasps.
    """
    result, truth = replayed(name, seed)
    events, facts = result.effects[row["effect"]].output.events_named(row["event"]), planted(truth, row["fact"])
    if row["effect"] == "grasp":
        declared = plan(result.session.scene).steps["grasp"].declared
        declared_pairs = {frozenset(pair) for effect in declared for pair in effect["between"]}
        facts = [fact for fact in facts if frozenset(fact.bodies) in declared_pairs]
    assert len(events) == len(facts) > 0
    for event, fact in zip(events, facts, strict=True):
        assert not fact.bodies or set(event.bodies) & set(fact.bodies)
        assert "begin" not in row or event.time == pytest.approx(fact.start, abs=row["begin"])
        assert "end" not in row or event.end == pytest.approx(fact.end, abs=row["end"])
        for key, near in row.get("values", {}).items():
            expected = fact.values[near["planted"]]
            assert event.values[key] == pytest.approx(expected, near.get("rel"), near.get("abs"))


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("name", POURED)
def test_every_planted_pour_is_reported_with_its_volume(name, seed):
    """A made-up experiment with planted pours: those reported above 0.5 mL are these, in order, within 1 mL or 2 %.

    A second after a pour the source has what is planted to be left. Drops, 0.5 mL in all, may be reported beside them;
    no millilitre is lost, and the effect runs in less than 6 % of the frames.
    """
    drops_ml, after_s, most_frames = 0.5, 1.0, 0.06
    result, truth = replayed(name, seed)
    run, facts = result.effects["pour"], planted(truth, "pour")
    events = run.output.events_named("pour")
    large = [event for event in events if event.values["volume_ml"] > drops_ml]
    assert [event.bodies for event in large] == [(fact.values["source"], fact.values["target"]) for fact in facts]
    assert sum(event.values["volume_ml"] for event in events if event not in large) < drops_ml
    for event, fact in zip(large, facts, strict=True):
        assert event.time == pytest.approx(fact.start, abs=0.05)
        assert event.values["volume_ml"] == pytest.approx(fact.values["volume_ml"], **BY_EYE)
        left = run.series[f"{fact.values['source']}/volume"]
        assert left.values[left.times <= fact.end + after_s][-1] == pytest.approx(fact.values["left_ml"], **BY_EYE)
    last_ml = [series.values[-1] for series in run.series.values()]  # what is in the vessels, and what was spilled
    first_ml = [vessel.volume_ml for vessel in run.output.data.vessels.values()]
    assert sum(last_ml) == pytest.approx(sum(first_ml), rel=1e-9)
    assert 0 < run.frames_run < most_frames * run.frames


def test_the_indicator_changes_at_the_end_point():
    """A made-up titration says at how many mL of the burette its end point is: the colour begins to change there.

    Within 0.05 mL, about a drop; the change ends before the recording does.
    """
    result, truth = replayed("titration")
    (change,), (end_point,) = result.effects["colour"].output.events_named("colour-change"), planted(truth, "end_point")
    delivered = result.effects["burette"].series["burette/delivered"]
    delivered_ml = float(delivered.values[delivered.times <= change.time][-1])
    assert delivered_ml == pytest.approx(end_point.values["volume_ml"], abs=0.05)
    assert change.end is not None


def test_all_marble_dissolves_in_acid_that_is_in_excess():
    """The made-up experiment "marble" says which pH the acid that is left over must have."""
    result, truth = replayed("marble")
    (event,), (fact,) = result.effects["precipitation"].output.events_named("dissolved"), planted(truth, "dissolve")
    ph = result.effects["reaction"].series["marble/pH"]
    assert event.values["left_g"] == 0.0
    assert ph.values[-1] == pytest.approx(fact.values["ph"], abs=0.02)


@pytest.mark.parametrize("seed", SEEDS)
def test_gas_that_leaves_while_the_jar_stands_is_as_planted(seed):
    """In a made-up experiment H2 leaves a flask, over which a jar stands for a while.

    Planted are the mol that leave before the jar is there, and while it is; more leave after it is taken away, and the
    event has all.
    """
    result, truth = replayed("gas-collection", seed)
    (fact,), gone = planted(truth, "collect"), result.effects["reaction"].series["flask/H2 gone"]
    before_jar, with_jar_taken = np.interp([fact.start, fact.end], gone.times, gone.values)
    assert before_jar == pytest.approx(fact.values["leaked_before_mol"], rel=0.02)
    assert with_jar_taken - before_jar == pytest.approx(fact.values["collected_mol"], rel=0.02)
    (event,) = result.effects["reaction"].output.events_named("gas")
    assert event.values["moles"] == gone.values[-1] > with_jar_taken


def test_the_warmth_of_the_calorimeter_is_the_result():
    """The event of the warmest liquid leads the summary of a made-up experiment, with its two temperatures."""
    result, truth = replayed("ammonia-calorimetry")
    (fact,) = planted(truth, "temperature")
    assert f"warms from 20.00 to {fact.values['to_c']:.1f}" in leading_event(result.effects).text
