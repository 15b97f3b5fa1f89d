import numpy as np
import pytest
from support.liquid_worlds import (
    COLUMN,
    MIX,
    NEUTRAL,
    TAP,
    glass,
    poured,
    run_in,
    still,
    tilted,
    turned,
    world,
)  # fmt: skip

from replay.effects.effect_summary import leading
from replay.errors import PlanError
from replay.pipeline.engine import compute
from sessions.model.scene import SceneBody

OPEN = [0.0, 0.0, *([90.0] * 100), 0.0, 0.0]


def test_the_end_point_is_where_the_acid_is_used_up():
    run = run_in(OPEN, MIX, NEUTRAL)["reaction"]
    (event,) = run.events
    assert event.name == "end-point" and event.values["volume_ml"] == pytest.approx(0.5, rel=1e-9)
    ph = run.series["flask/pH"]
    assert np.interp(event.time, ph.times, ph.values) == pytest.approx(7.0, abs=2.0)
    assert ph.values[0] == pytest.approx(1.0, abs=1e-6) and (np.diff(ph.values) >= 0.0).all() and ph.values[-1] > 11.0


def test_the_ph_halfway_to_the_end_point_of_a_weak_acid_is_its_pka():
    acid = glass("flask", 0.5, solute="HAc", molar=0.1)
    weak = ("reaction", {"equation": "C2H4O2 + NaOH -> C2H3NaO2 + H2O", "acids": {"C2H4O2": [4.756]}, "pkw": 14.0})
    acid.extra["properties"]["liquid"]["solute"] = "C2H4O2"
    effects = run_in(OPEN, MIX, weak, acid=acid)
    ph, volume = effects["reaction"].series["flask/pH"], effects["mixing"].series["flask/volume"]
    half = np.interp(0.75, volume.values, volume.times)
    assert np.interp(half, ph.times, ph.values) == pytest.approx(4.756, abs=0.01)


def test_before_the_end_point_there_is_none_and_alone_nothing_reacts():
    assert run_in([0.0, 10.0, 0.0], MIX, NEUTRAL)["reaction"].events == ()
    run = run_in([0.0, 0.0], MIX, NEUTRAL)["reaction"]
    assert run.events == () and run.series == {} and run.frames_run == 0


def test_a_reaction_with_a_rate_nears_the_end_of_its_limiting_reagent():
    zinc = glass("b", 0.0)
    zinc.extra["properties"]["solid"] = {"formula": "Zn", "mass_g": 0.05}
    slow = ("reaction", {"equation": "Zn + 2 HCl -> ZnCl2 + H2", "rate_per_s": 2.0})
    acid = glass("a", 60.0, solute="HCl", molar=2.0)
    run = poured([0.0, *([60.0] * 100)], (acid, zinc), ("mixing", {"in": ["b"]}), slow)["reaction"]
    extent = run.series["b/extent"]
    assert extent.values[0] == 0.0 and len(extent.times) == run.frames_run == 99 and extent.times[0] == 0.02
    assert extent.values[-1] == pytest.approx(-0.05 / 65.38 * np.expm1(-2.0 * 0.98), rel=1e-9)
    assert run.series["b/pH"].values[-1] < 0.0
    (event,) = run.events
    assert event.name == "gas" and event.values == {"moles": extent.values[-1], "formula": "H2"}
    assert event.time == pytest.approx(0.03) and event.end == pytest.approx(1.0)
    assert (
        leading({"reaction": run}) == event
        and run.series["b/H2 gone"].values[-1] == extent.values[-1]
        and run.series["b/H2 gone"].unit == "mol"
    )


@pytest.mark.parametrize(
    ("settings", "words"),
    [({"equation": "HCl + NaOH -> NaCl"}, "not balanced"), ({"equation": "salt"}, "has no ->"),
     ({"acids": {"HF": 3.2}}, "rising list"), ({"acids": {"HF": [5.0, 3.0]}}, "rising list"),
     ({"bases": {"NH3": [9.25]}}, "conjugate acid")],
)  # fmt: skip
def test_chemistry_that_cannot_be_is_refused_when_planned(settings, words):
    with pytest.raises(PlanError, match=words):
        run_in([0.0, 0.0], MIX, ("reaction", {**NEUTRAL[1], **settings}))


def balance(pkw=14.0, strong=0.0, weak=()):
    """pH by bisection of the charge balance: ``strong`` base less acid, ``weak`` (mol/L, pKa) anions, in mol/L."""
    low, high = -3.0, 18.0
    for _ in range(100):
        ph = 0.5 * (low + high)
        charge = 10.0**-ph - 10.0 ** (ph - pkw) + strong
        charge -= sum(molar * (1.0 - 1.0 / (1.0 + 10.0 ** (ph - pka))) for molar, pka in weak)
        low, high = (ph, high) if charge > 0.0 else (low, ph)
    return low


@pytest.mark.parametrize(
    ("solutes", "strong", "weak"),
    [({"CH3COOH": 0.1}, 0.0, ((0.1, 4.756),)), ({"H2SO4": 0.1}, -0.1, ((0.1, 1.99),)),
     ({"CH3COOH": 0.1, "CH3COONa": 0.2}, 0.2, ((0.3, 4.756),)), ({"NH3": 0.1, "NH4Cl": 0.1}, 0.0, ()),
     ({"HCl": 0.05, "CH3COONa": 0.1}, 0.05, ((0.1, 4.756),))],
)  # fmt: skip
def test_acids_buffers_and_mixtures_are_known_without_a_table(solutes, strong, weak):
    """A drop of water is run in; the pH is that of an own bisection, with the drop's dilution."""
    acid = glass("flask", 50.0, solutes=solutes)
    acid.extra["properties"]["liquid"].pop("solute")
    acid.extra["properties"]["liquid"].pop("molar")
    water = glass("burette", 50.0, cavity=COLUMN, solutes={"NaOH": 0.0})
    water.extra["properties"]["liquid"].pop("solute")
    first = next(iter(solutes))
    equation = {"NH3": "NH3 + H2O -> NH4+ + OH-", "H2SO4": "H2SO4 + 2 NaOH -> Na2SO4 + 2 H2O"}.get(
        first, f"{first} + NaOH -> Na{first[1:]} + H2O" if first == "HCl" else "CH3COOH + NaOH -> CH3COONa + H2O"
    )
    effects = run_in(
        [0.0, 0.0, 90.0, 0.0], MIX, ("reaction", {"equation": equation, "pkw": 14.0}), acid=acid, base=water
    )
    share = 50.0 / effects["mixing"].series["flask/volume"].values[-1]
    expected = balance(14.0, strong * share, [(molar * share, pka) for molar, pka in weak])
    if "NH3" in solutes:
        expected = 9.25 + np.log10(1.0)
    assert effects["reaction"].series["flask/pH"].values[-1] == pytest.approx(expected, abs=0.002)


def test_acid_spent_on_magnesium_neutralises_nothing_more():
    """All HCl is spent on an excess of magnesium; poured into NaOH the pH is that of the NaOH alone."""
    spent, base = glass("a", 60.0, solute="HCl", molar=1.0), glass("b", 10.0, solute="NaOH", molar=0.5)
    spent.extra["properties"]["solid"] = {"formula": "Mg", "mass_g": 7.0}
    zinc = ("reaction", {"equation": "Mg + 2 HCl -> MgCl2 + H2"})
    effects = poured([0.0, 60.0, 60.0], (spent, base), ("mixing", {"in": ["a", "b"]}), zinc, NEUTRAL)
    volume = effects["mixing"].series["b/volume"].values[-1]
    assert not effects["reaction"].output.named("end-point")
    assert effects["reaction"].series["b/pH"].values[-1] == pytest.approx(14.0 + np.log10(5.0 / volume), abs=1e-6)


def test_nothing_is_told_of_a_reaction_before_its_liquid_moves():
    zinc = glass("b", 0.0)
    zinc.extra["properties"]["solid"] = {"formula": "Zn", "mass_g": 0.05}
    slow = ("reaction", {"equation": "Zn + 2 HCl -> ZnCl2 + H2", "rate_per_s": 2.0})
    acid = glass("a", 60.0, solute="HCl", molar=2.0)
    run = poured([*([0.0] * 50), *([60.0] * 50)], (acid, zinc), ("mixing", {"in": ["b"]}), slow)["reaction"]
    assert run.series["b/pH"].times[0] == pytest.approx(0.51) == run.series["b/extent"].times[0]
    assert run.output.lanes["b"][0].start == pytest.approx(0.51, abs=0.011)
    quick = poured(
        [*([0.0] * 50), *([60.0] * 50)],
        (acid, zinc),
        ("mixing", {"in": ["b"]}),
        (slow[0], {"equation": slow[1]["equation"]}),
    )
    assert quick["reaction"].output.lanes["b"][0].start == pytest.approx(0.51)


def titrated(flask, beaker_ml, *, molar=0.1, seconds=700):
    """A beaker is poured into the flask at once, then base runs in from the burette."""
    count = seconds
    poses = {
        "burette": still(count, (0.0, 0.15, 0.0)),
        "tap": turned([*([0.0] * 20), *([90.0] * (count - 40)), *([0.0] * 20)]),
        "flask": still(count), "a": tilted([*([0.0] * 5), *([170.0] * 5), *([0.0] * (count - 10))]),
    }  # fmt: skip
    solute = {"solute": "HCl", "molar": molar} if molar else {}
    bodies = (
        glass("burette", 50.0, solute="NaOH", molar=0.1, cavity=COLUMN), flask, SceneBody("tap"),
        glass("a", beaker_ml, **solute),
    )  # fmt: skip
    wide = {"from": ["a"], "into": ["flask"]}
    told = (("burette", {**TAP, "full_area_m2": 6e-6}), ("pour", wide), MIX, NEUTRAL)
    return compute(world(poses, bodies, *told)).effects["reaction"]


def test_a_flask_that_was_empty_at_first_has_an_end_point():
    (event,) = titrated(glass("flask", 0.0), 5.0).events
    assert event.values["volume_ml"] == pytest.approx(5.0, abs=0.01)


def test_a_rinse_does_not_count_to_what_was_titrated():
    (event,) = titrated(glass("flask", 5.0, solute="HCl", molar=0.1), 20.0, molar=0.0).events
    assert event.values["volume_ml"] == pytest.approx(5.0, abs=0.01) and "after 5.00 mL" in event.text
    assert event.values["overshot_ml"] > 0.0


@pytest.mark.parametrize(
    ("settings", "acid", "words"),
    [({}, {"solute": "HCL"}, "unknown element L; did you mean 'HCl'"),
     ({"acids": {"HCI": [1.0]}}, {}, "acids: nobody brings 'HCI'; did you mean 'HCl'"),
     ({"equation": "HCl + KOH -> KCl + H2O"}, {}, "equation: nobody brings 'KOH'; there are: HCl, NaOH"),
     ({}, {"solutes": {"C4H8O2": 0.1}}, "the pH needs data of 'C4H8O2' in 'flask'"),
     ({"equation": "NaCl + KNO3 -> KCl + NaNO3"}, {"solutes": {"NaCl": 1.0, "KNO3": 1.0}}, "nothing happens")],
)  # fmt: skip
def test_what_fits_nothing_is_refused_with_the_nearest_name(settings, acid, words):
    told = {"solute": "HCl", "molar": 0.1, **acid}
    with pytest.raises(PlanError, match=words):
        run_in([0.0, 0.0], MIX, ("reaction", {**NEUTRAL[1], **settings}), acid=glass("flask", 0.5, **told))


@pytest.mark.parametrize(
    ("settings", "words"),
    [({"equation": "HCl + NaOH -> NaCl + H2O"}, "acids and bases meet at once"),
     ({"equation": "CH3COOH + NaOH -> CH3COONa + H2O"}, "acids and bases meet at once"),
     ({"equation": "NH3 + HCl -> NH4Cl"}, "acids and bases meet at once"),
     ({"equation": "AgNO3 + NaCl -> AgCl + NaNO3"}, "a solid with a solubility product falls out at once")],
)  # fmt: skip
def test_a_rate_that_would_change_nothing_is_refused(settings, words):
    there = dict.fromkeys(("HCl", "NaOH", "CH3COOH", "NH3", "AgNO3", "NaCl"), 0.1)
    silver = ("precipitation", {"solid": "AgCl", "ksp": 1.77e-10, "colour": "white"})
    more = (silver,) if "Ag" in settings["equation"] else ()
    reaction = ("reaction", {**settings, "rate_per_s": 0.5})
    with pytest.raises(PlanError, match=f"rate_per_s: {words}; leave it out"):
        run_in(OPEN, MIX, reaction, *more, acid=glass("flask", 5.0, solutes=there))


def test_an_acid_has_one_pka():
    told = [{"equation": f"CH3COOH + {one}OH -> CH3COO{one} + H2O", "acids": {"CH3COOH": [pka]}}
            for one, pka in (("Na", 4.756), ("K", 3.0))]  # fmt: skip
    acid, base = glass("flask", 0.5, solute="CH3COOH", molar=0.1), {"NaOH": 0.1, "KOH": 0.1}
    with pytest.raises(PlanError, match=r"acids.CH3COOH is \[3.0\] and another table says \[4.756\]; give it once"):
        run_in(OPEN, MIX, *(("reaction", one) for one in told), acid=acid,
               base=glass("burette", 50.0, solutes=base, cavity=COLUMN))  # fmt: skip


def ph_of_hydrogen_carbonate(molar, sodium):
    """By its own bisection of the charge balance: pKa 6.35 and 10.33, ion product 13.995."""
    low, high = 0.0, 14.0
    for _ in range(60):
        ph = 0.5 * (low + high)
        h = 10.0**-ph
        gas, alone = h * 10.0**6.35, 10.0 ** (ph - 10.33)  # H2CO3 and CO3^2- for each HCO3-
        charge = sodium + h - 10.0 ** (ph - 13.995) - molar * (1.0 + 2.0 * alone) / (1.0 + alone + gas)
        low, high = (ph, high) if charge > 0.0 else (low, ph)
    return ph


def test_baking_soda_keeps_its_gas_until_acid_comes_and_ends_where_all_is_protonated():
    soda, gas = glass("flask", 10.0, solute="NaHCO3", molar=0.1), "NaHCO3 + HCl -> NaCl + H2O + CO2"
    acid = glass("burette", 50.0, solute="HCl", molar=0.1, cavity=COLUMN)
    degrees = [0.0, 0.0, *([90.0] * 1500), 0.0]
    run = run_in(degrees, MIX, ("reaction", {"equation": gas}), acid=soda, base=acid)["reaction"]
    assert run.series["flask/pH"].values[0] == pytest.approx(ph_of_hydrogen_carbonate(0.1, 0.1), abs=1e-9)
    (event,) = run.output.named("end-point")
    assert event.values["volume_ml"] == pytest.approx(10.0, rel=1e-9) and "HCl and NaHCO3 are" in event.text


def test_gas_that_leaves_is_told_of_every_vessel_without_a_jar_and_is_what_stays_dissolved_less():
    """Soda of 0.5 mol/L with acid in excess: a litre keeps 3.3e-4 mol/(m3 Pa) times an atmosphere of the CO2."""
    soda, acid = glass("b", 10.0, solute="NaHCO3", molar=0.5), glass("a", 60.0, solute="HCl", molar=1.0)
    gas = ("reaction", {"equation": "NaHCO3 + HCl -> NaCl + H2O + CO2"})
    effects = poured([0.0, *([60.0] * 50)], (acid, soda), ("mixing", {"in": ["b"]}), gas)
    volume = effects["mixing"].series["b/volume"].values
    (event,) = effects["reaction"].output.named("gas")
    # Gas that left stays away: most of it is gone in the first row with acid for all of the soda, at its volume.
    litres = 1e-3 * volume[volume >= 15.0][0]
    assert event.values["moles"] == pytest.approx(5e-3 - 3.3e-7 * 101325.0 * litres, rel=0.01)
    assert "4.35 mmol CO2 leave b as gas" in event.text
    flat = ("reaction", {"equation": "HCl + NaOH -> NaCl + H2O"})
    quiet = poured(
        [0.0, *([60.0] * 50)], (acid, glass("b", 10.0, solute="NaOH", molar=0.5)), ("mixing", {"in": ["b"]}), flat
    )
    assert not quiet["reaction"].output.named("gas")
