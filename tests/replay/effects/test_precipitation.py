import pytest
from support.liquid_worlds import RADIUS, glass, poured, still, tilted, world

from replay.effects.models.equation import molar_mass
from replay.effects.vessels import COLOURS
from replay.errors import PlanError
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


def test_below_the_product_everything_stays_dissolved():
    effects = run(silver=1e-6, salt=1e-6)
    assert effects["precipitation"].events == () and effects["precipitation"].series["b/AgCl"].values[-1] == 0.0


def test_upright_nothing_is_solved():
    run_ = run(degrees=(0.0, 0.0))["precipitation"]
    assert run_.frames_run == 0 and run_.counters == {} and run_.events == ()


def test_a_salt_of_two_chlorides_brings_two_without_being_told():
    half = ("reaction", {"equation": "BaCl2 + 2 AgNO3 -> 2 AgCl(s) + Ba(NO3)2"})
    bodies = (glass("a", 60.0, solute="AgNO3", molar=0.1), glass("b", 40.0, solute="BaCl2", molar=0.05))
    moved = poured((0.0, 60.0, 60.0), bodies, MIX, half, ("precipitation", FALLS))
    moles = 0.1e-3 * moved["pour"].events[0].values["volume_ml"]
    assert moved["precipitation"].events[0].values["moles"] == pytest.approx(moles, rel=1e-4)


def test_silver_goes_to_the_iodide_and_is_not_counted_twice():
    """Of 1 mmol Ag+ with 1 mmol of each halide the sum of both solids is 1 mmol; by bisection of free silver."""
    litres = 0.06
    both = (
        ("reaction", {"equation": "Ag+ + Cl- -> AgCl(s)"}), ("reaction", {"equation": "Ag+ + I- -> AgI(s)"}),
        ("precipitation", FALLS),
        ("precipitation", {"solid": "AgI", "ksp": 8.52e-17, "colour": "yellow"}),
    )  # fmt: skip
    bodies = (
        glass("a", 20.0, solute="AgNO3", molar=0.05), glass("b", 20.0, solute="NaCl", molar=0.05),
        glass("c", 20.0, solute="KI", molar=0.05),
    )  # fmt: skip
    poses = {"a": tilted(TURNED), "b": still(9), "c": tilted([*TURNED[5:], *TURNED[:5]])}
    pours = ("pour", {"from": ["a", "c"], "into": ["b"]})
    found = compute(world(poses, bodies, pours, MIX, *both, step_ns=SLOW_NS)).effects["precipitation"]
    chloride, iodide = (found.series[f"b/{name}"].values[-1] for name in ("AgCl", "AgI"))

    def silver(free):
        solids = [max(0.0, 1e-3 - ksp / free * litres) for ksp in (FALLS["ksp"], 8.52e-17)]
        return free * litres + sum(solids) - 1e-3, solids

    low, high = 1e-30, 1.0
    for _ in range(400):
        middle = (low * high) ** 0.5
        low, high = (low, middle) if silver(middle)[0] > 0.0 else (middle, high)
    assert [chloride / molar_mass("AgCl"), iodide / molar_mass("AgI")] == pytest.approx(
        silver(low)[1], rel=1e-6, abs=1e-12
    )
    first = found.series["b/AgCl"]
    assert first.values.max() / molar_mass("AgCl") == pytest.approx(1e-3, rel=1e-3)


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


def test_a_solid_that_no_reaction_makes_is_refused():
    with pytest.raises(PlanError, match=r"\[\[effect\]\] 4 .*solid: no reaction makes 'AgI'; there are: AgCl, NaNO3"):
        run(solid="AgI")


def test_a_colour_nobody_knows_is_refused():
    with pytest.raises(PlanError, match="colour is 'whitish'"):
        run(colour="whitish")


def test_a_solid_has_one_solubility_product_and_a_table_that_stands_twice_counts_once():
    bodies = (glass("a", 60.0, solute="AgNO3", molar=0.1), glass("b", 40.0, solute="NaCl", molar=0.1))
    first = ("precipitation", FALLS)
    once = poured([0.0, 60.0, 60.0], bodies, MIX, SILVER, first, first)["precipitation"]
    assert len(once.events) == 1
    with pytest.raises(PlanError, match=r"ksp is 1e-05 and \[\[effect\]\] 4 \('precipitation'\) says 1.77e-10"):
        poured([0.0, 60.0], bodies, MIX, SILVER, first, ("precipitation", {**FALLS, "ksp": 1e-5}))


def test_what_falls_out_while_acid_meets_base_falls_out_too():
    barium = {"solid": "BaSO4", "ksp": 1.08e-10, "colour": "white"}
    bodies = (glass("a", 60.0, solute="Ba(OH)2", molar=0.1), glass("b", 10.0, solute="H2SO4", molar=0.1))
    equation = {"equation": "Ba(OH)2 + H2SO4 -> BaSO4 + 2 H2O"}
    run_ = poured([0.0, *([60.0] * 60)], bodies, MIX, ("reaction", equation), ("precipitation", barium))
    assert run_["precipitation"].series["b/BaSO4"].values[-1] == pytest.approx(0.23339, rel=1e-3)
