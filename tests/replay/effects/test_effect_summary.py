import re
from importlib import resources

import numpy as np
import pytest
from support.small_worlds import unit_cubes_on_x

from replay.effects import EFFECTS
from replay.effects.effect_summary import effect_summary, event_lines, leading_event, titration_curves
from replay.effects.effects_runner import EffectRun
from replay.effects.equivalence import Equivalence
from replay.effects.output import EffectEvent, EffectOutput, Series
from replay.effects.protocol import EffectSpec
from replay.engine import compute
from sessions.model.scene import Scene, SceneBody, SceneEffect
from sessions.synthetic.scenes import SCENES

FALLS = SceneEffect("breakage", {"between": ["a", "b"], "speed_m_s": 1.0})
SCENE = Scene(bodies=(SceneBody("a"), SceneBody("b")), effects=(FALLS,))


POSITIONS_OF_5_TOUCHES = [3.0, 3.0, *(([0.9] * 4 + [3.0] * 20) * 5)]
"""Metres between unit cubes, which touch five times for four frames."""


@pytest.fixture(scope="module")
def five_touches():
    """A run with the effect breakage, which needs that of contacts."""
    count = len(POSITIONS_OF_5_TOUCHES)
    return compute(unit_cubes_on_x({"a": [0] * count, "b": POSITIONS_OF_5_TOUCHES}, scene=SCENE), detectors=())


def test_document_has_a_record_of_each_effect(five_touches):
    """Two cubes touch five times; the scene declares breakage, which needs the effect contact and runs about contacts.

    A record has the number of events by name, frames in which the effect ran, what sets it off, and its digest.
    """
    records = five_touches.document.effects
    assert list(records) == ["contact", "breakage"] and records["contact"].events == {"contact": 5}
    assert records["breakage"].frames_run < records["breakage"].frames == len(POSITIONS_OF_5_TOUCHES)
    assert records["breakage"].trigger
    assert records["contact"].digest == five_touches.effects["contact"].output.digest


def test_each_effect_has_its_fraction_of_the_time(five_touches):
    """A half where the whole run took twice the time of the effect contact; 0 where the run's time is 0."""
    contact_s = five_touches.effects["contact"].seconds
    for run_s, fraction in ((2 * contact_s, 0.5), (0.0, 0.0)):
        assert effect_summary(five_touches.effects, run_s)["contact"]["fraction"] == pytest.approx(fraction)


def test_event_lines_are_in_order_and_end_in_a_count(five_touches):
    """Three lines of events are allowed, and so a fourth says how many more there are; all have room without it."""
    allowed = 3
    *lines, last = event_lines(five_touches.effects, allowed)
    times = [float(line.split(" s: ")[0]) for line in lines]
    events = sum(len(run.events) for run in five_touches.effects.values())
    assert events >= 5, "a contact for each touch"
    assert times == sorted(times) and len(times) == allowed and last == f"and {events - allowed} more"
    assert len(event_lines(five_touches.effects, events)) == events


def effect_run(kind, *events, **series):
    """The run of an effect of this kind with these events and series."""
    return EffectRun(
        EffectSpec(kind, "x", lambda i: None),
        (),
        EffectOutput(events, series),
        seconds=0.1,
        counters={},
        frames=3,
        frames_run=3,
    )


def test_the_weightiest_result_leads_else_the_last_event():
    """A pour at 0 s, an end point at 1 s and a change of colour at 2 s: the end point is the result of a titration.

    Without it the last event leads, and without events none.
    """
    pour = EffectEvent(time=0.0, name="pour", bodies=("flask",))
    end_point = EffectEvent(time=1.0, name="end-point", bodies=("flask",))
    change = EffectEvent(time=2.0, name="colour-change", bodies=("flask",))
    runs = {"pour": effect_run("pour", pour), "colour": effect_run("colour", change)}
    assert leading_event(runs | {"reaction": effect_run("reaction", end_point)}) is end_point
    assert leading_event(runs) is change
    assert leading_event({"pour": effect_run("pour", pour)}) is pour
    assert leading_event({}) is None


def end_points_by_curve(ends, **series):
    """Quantity of each curve of a flask that gets 10 mL in 10 s on its first 2 mL -> mL of its end points."""
    volume = Series(np.array([0.0, 10.0]), np.array([2.0, 12.0]), "mL")
    end_points = [EffectEvent(time, "end-point", ("flask",), end=None, values={"of": kind}) for kind, time in ends]
    values = {f"flask/{name}": Series(np.array([0.0, 10.0]), np.zeros(2), unit) for name, unit in series.items()}
    values["beaker/pH"] = Series(np.array([0.0, 10.0]), np.zeros(2), "pH")
    runs = {
        "mixing": effect_run("mixing", **{"flask/volume": volume}),
        "reaction": effect_run("reaction", *end_points, **values),
    }
    return {curve.quantity: list(curve.ends_ml) for curve in titration_curves(runs)}


ACIDS, REDOX = Equivalence.ACID_AND_BASE, Equivalence.OXIDANT_AND_REDUCTANT
METALS = Equivalence.METAL_AND_ANION


def test_titration_curve_is_of_the_quantity_with_an_end_point():
    """``ends``: kind and second of each end point; a mL a second runs in. ``series``: name -> unit of what is known.

    ``expected``: quantity of each curve that is drawn -> mL of the end points on it. The curve of an end point is of
    what it is defined by, such as the pH of acid and base; without end points the pH is drawn.
    """
    for case, (ends, series, expected) in {
        "pH without end": ([], {"pH": "pH"}, {"pH": []}),
        "acid": ([(ACIDS, 4.0)], {"pH": "pH", "temperature": "degC"}, {"pH": [4.0]}),
        "redox hides pH": ([(REDOX, 5.0)], {"pH": "pH", "potential": "V"}, {"redox potential": [5.0]}),
        "both end points": (
            [(REDOX, 5.0), (ACIDS, 4.0)],
            {"pH": "pH", "potential": "V"},
            {"redox potential": [5.0], "pH": [4.0]},
        ),
        "reagent left": ([(REDOX, 5.0)], {"Fe^2+ left": "mol"}, {"mol of Fe^2+ left": [5.0]}),
        "metal": ([(METALS, 6.0)], {"pAg": "pAg"}, {"pAg": [6.0]}),
    }.items():
        assert end_points_by_curve(ends, **series) == expected, case


def test_titration_curves_need_reaction_and_mixing():
    """The reaction has the pH, mixing the volume: with either alone there is no curve."""
    assert titration_curves({"reaction": effect_run("reaction")}) == []
    assert titration_curves({"mixing": effect_run("mixing")}) == []


def test_the_table_of_costs_names_every_effect_of_each_session():
    """A row of the guide's table has a made-up scene, and its effects with their fractions of the time of a run.

    Its last cell begins with the number of effects that did not run: together these are all effects.
    """
    page = resources.files("replay.guide").joinpath("scenes-and-effects.md").read_text("utf-8")
    rows = re.findall(r"^\| `([\w-]+)` \| (.+ %) \| (.+?) \|$", page, flags=re.MULTILINE)
    assert {scene for scene, _fractions, _last_cell in rows} == set(SCENES)
    for scene, fractions, last_cell in rows:
        ran = re.findall(r"([a-z-]+) [\d.]+ %", fractions)
        not_run, *_ = last_cell.split(";")
        assert set(ran) <= set(EFFECTS), scene
        assert len(ran) + int(not_run) == len(EFFECTS), scene
