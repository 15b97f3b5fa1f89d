import numpy as np
import pytest
from support.liquid_worlds import COLUMN, MIX, NEUTRAL, glass, poured, run_in

from replay.effects.vessels import COLOURS
from replay.errors import PlanError
from sessions.model.scene import SceneBody

PINK = {
    "in": "flask", "indicator": "phenolphthalein", "from_ph": 8.2, "to_ph": 10.0, "acid_colour": "colourless",
    "base_colour": "pink",
}  # fmt: skip
ACID, BASE = glass("a", 20.0, solute="HCl", molar=0.1), glass("b", 20.0, solute="NaOH", molar=0.1)
OPEN = [0.0, 0.0, *([90.0] * 100), 0.0, 0.0]


def run(degrees=OPEN, acid=None, **more):
    return run_in(degrees, MIX, NEUTRAL, ("colour", {**PINK, **more}), acid=acid)["colour"]


def test_it_turns_once_from_acid_to_base_and_so_does_the_glass():
    run_ = run()
    (event,) = run_.events
    assert event.name == "colour-change" and event.values["to"] == "pink" and event.end >= event.time
    shade = run_.output.liquids["flask"].rgba
    assert tuple(shade[0]) == COLOURS["colourless"] and tuple(shade[-1]) == COLOURS["pink"]
    assert [span.word for span in run_.output.lanes["flask"]][::2][0] == "colourless"
    assert run_.series["flask/phenolphthalein"].values[[0, -1]].tolist() == [0.0, 1.0]


def test_a_range_that_the_ph_passes_backwards_turns_backwards():
    backwards = run_in(
        OPEN, MIX, NEUTRAL, ("colour", PINK),
        base=glass("burette", 50.0, solute="HCl", molar=0.1, cavity={"capacity_ml": 50.0, "floor": 0.15, "mark": 0.65}),
        acid=glass("flask", 0.5, solute="NaOH", molar=0.1),
    )["colour"]  # fmt: skip
    assert [event.values["to"] for event in backwards.events] == ["colourless"]


def test_stopping_inside_the_range_is_a_change_that_does_not_end():
    run_ = run(from_ph=2.0, to_ph=14.0)
    assert [(event.end, event.values["to"]) for event in run_.events] == [(None, "pink")]


def test_short_of_the_range_nothing_changes():
    run_ = run([0.0, 10.0, 0.0])
    assert run_.events == () and np.all(run_.series["flask/phenolphthalein"].values == 0.0)


def test_a_vessel_without_a_ph_and_a_range_that_falls_are_refused():
    salt = ("reaction", {"equation": "Ag+ + Cl- -> AgCl(s)"})
    silver = glass("flask", 0.5, solute="AgNO3", molar=0.1)
    with pytest.raises(PlanError, match="gives 'flask' a pH"):
        run_in(
            OPEN, MIX, salt, ("colour", PINK), acid=silver, base=glass("burette", 50.0, solute="NaCl", cavity=COLUMN)
        )
    with pytest.raises(PlanError, match="from_ph is not below to_ph"):
        run(from_ph=10.0, to_ph=8.2)


def test_where_only_water_came_there_is_no_colour_and_the_run_goes_on():
    shelf = glass("cup", 20.0, solutes={"HCl": 0.1, "NaOH": 0.1})
    bodies, more = (glass("a", 60.0), glass("b"), shelf), (NEUTRAL, ("colour", {**PINK, "in": "b"}))
    effects = poured([0.0, 60.0, 60.0], bodies, *more)
    assert effects["pour"].events and effects["colour"].events == () and "b/pH" not in effects["reaction"].series


@pytest.mark.parametrize("vessel", ["tap", "cup"])
def test_a_vessel_that_nothing_is_mixed_in_is_refused_before_the_run(vessel):
    with pytest.raises(
        PlanError, match=rf"\('colour'\): in: nothing is mixed in '{vessel}'; name it in an effect mixing"
    ):
        poured([0.0, 60.0], (ACID, BASE, glass("cup"), SceneBody("tap")), NEUTRAL, ("colour", {**PINK, "in": vessel}))


def test_two_indicators_in_one_flask_have_a_lane_each():
    orange = {**PINK, "indicator": "methyl orange", "from_ph": 3.1, "to_ph": 4.4, "acid_colour": "red"}
    lanes = run_in(OPEN, MIX, NEUTRAL, ("colour", PINK), ("colour", orange))["colour"].output.lanes
    assert lanes["flask"][0].word == "red" and lanes["flask phenolphthalein"][0].word == "colourless"
