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


def test_stopping_inside_the_range_is_a_change_that_does_not_end():
    run_ = run(from_ph=2.0, to_ph=14.0)
    assert [(event.end, event.values["to"]) for event in run_.events] == [(None, "pink")]


def test_a_vessel_without_a_ph_and_a_range_that_falls_are_refused():
    salt = ("reaction", {"equation": "Ag+ + Cl- -> AgCl(s)"})
    silver = glass("flask", 0.5, solute="AgNO3", molar=0.1)
    with pytest.raises(PlanError, match="gives 'flask' a pH"):
        run_in(
            OPEN, MIX, salt, ("colour", PINK), acid=silver, base=glass("burette", 50.0, solute="NaCl", cavity=COLUMN)
        )
    with pytest.raises(PlanError, match="from_ph is not below to_ph"):
        run(from_ph=10.0, to_ph=8.2)


@pytest.mark.parametrize("vessel", ["tap", "cup"])
def test_a_vessel_that_nothing_is_mixed_in_is_refused_before_the_run(vessel):
    with pytest.raises(
        PlanError, match=rf"\('colour'\): in: nothing is mixed in '{vessel}'; name it in an effect mixing"
    ):
        poured([0.0, 60.0], (ACID, BASE, glass("cup"), SceneBody("tap")), NEUTRAL, ("colour", {**PINK, "in": vessel}))
