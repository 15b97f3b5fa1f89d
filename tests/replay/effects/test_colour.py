from support.liquid_worlds import MIX, NEUTRAL, glass, run_in

from replay.effects.vessels import COLOURS

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
