import pytest
from support.liquid_worlds import RADIUS, glass, poured, still, tilted, world

from replay.effects.vessels import COLOURS
from replay.pipeline.engine import compute

MIX = ("mixing", {"in": ["b"]})
SILVER = ("reaction", {"equation": "AgNO3 + NaCl -> AgCl + NaNO3"})
TURNED = [0.0, 0.0, 120.0, 120.0, 120.0, 0.0, 0.0, 0.0, 0.0]
FALLS = {"solid": "AgCl", "ksp": 1.77e-10, "colour": "white"}
SLOW_NS = 100_000_000
"""A step in which a glass can be emptied."""


def run(silver=0.1, salt=0.1, degrees=(0.0, 60.0, 60.0), reaction=SILVER, **more):
    bodies = (glass("a", 60.0, solute="AgNO3", molar=silver), glass("b", 40.0, solute="NaCl", molar=salt))
    return poured(degrees, bodies, MIX, reaction, ("precipitation", {**FALLS, **more}))


def test_the_scarcer_ion_falls_out_almost_all_at_once():
    effects = run()
    (event,) = effects["precipitation"].events
    moles = 0.1e-3 * effects["pour"].events[0].values["volume_ml"]
    assert event.time == pytest.approx(0.01) and event.values["moles"] == pytest.approx(moles, rel=1e-4)
    assert event.values["mass_g"] == pytest.approx(moles * 143.32, rel=1e-4)
    assert effects["precipitation"].series["b/AgCl"].values[0] == 0.0
    drawn = effects["precipitation"].output.liquids["b"].rgba
    assert tuple(drawn[0]) == COLOURS["colourless"] and tuple(drawn[-1]) == COLOURS["white"]


def test_a_solid_stays_when_its_liquid_is_decanted_and_a_declared_share_goes_along():
    bodies = (glass("a", 20.0, solute="AgNO3", molar=0.1), glass("b", 20.0, solute="NaCl", molar=0.1), glass("c"))
    decanted = tilted([*([0.0] * 5), 120.0, 120.0, 120.0, 0.0], (RADIUS, 0.1, 0.0))
    poses = {"a": tilted(TURNED), "b": decanted, "c": still(9, (RADIUS, 0.0, 0.0))}
    mix = ("mixing", {"in": ["b", "c"]})

    def grams(share):
        pour = ("pour", {"from": ["a", "b"], "into": ["b", "c"], "solids_along": share})
        session = world(poses, bodies, pour, mix, SILVER, ("precipitation", FALLS), step_ns=SLOW_NS)
        series = compute(session).effects["precipitation"].series
        return series["b/AgCl"].values[-1], series["c/AgCl"].values[-1]

    stays, goes = grams(0.0)
    assert stays == pytest.approx(2e-3 * 143.32, rel=1e-3) and goes == 0.0
    stays, goes = grams(0.25)
    assert goes == pytest.approx(0.25 * 2e-3 * 143.32, rel=1e-3) and stays + goes == pytest.approx(0.28664, rel=1e-3)
