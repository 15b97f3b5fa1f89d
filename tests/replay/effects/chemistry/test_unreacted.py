"""Reasons of `replay.effects.chemistry.unreacted` are right in every state of acid, base and reagents."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.liquid_worlds import (
    BURETTE_COLUMN,
    MIXING_IN_FLASK,
    effects_of_tap_degrees,
    effects_of_tilt_degrees,
    glass,
    poses_at_rest,
    session_with_effects,
)

from replay.effects.chemistry.formulas import molar_mass
from replay.effects.chemistry.limits import Cause
from replay.effects.chemistry.processes import Process
from replay.effects.chemistry.unreacted import stop_events
from replay.effects.effect_summary import leading_event
from replay.engine import compute

IRON = "MnO4- + 5 Fe2+ + 8 H+ -> Mn2+ + 5 Fe3+ + 4 H2O"
PEROXIDE = "H2O2 + 2 I- + 2 H+ -> I2 + 2 H2O"
SULFITE = "Na2SO3 + 2 HCl -> 2 NaCl + H2O + SO2"
IODATE = "3 I2 + 6 OH- -> 5 I- + IO3- + 3 H2O"
NONE_CAME = "it needs acid, and none came into flask"
NONE_FREE = "it needs acid, and none is free in flask: a base takes it up, or the acid is too weak"
DIOXIDE = "; permanganate without acid makes MnO2: write the equation with MnO2, or add acid"
OXALATE = "2 MnO4- + 5 C2O42- + 16 H+ -> 2 Mn2+ + 10 CO2 + 8 H2O"
IN_LYE = "2 MnO4- + 3 C2O42- + 4 OH- -> 2 MnO2 + 6 CO32- + 2 H2O"
IN_WATER = "2 MnO4- + 6 I- + 4 H2O -> 2 MnO2 + 3 I2 + 8 OH-"
IODINE = {"I2": 0.0005, "KI": 0.1}


def run(flask, burette, *equations):
    """The reaction of 10 mL in the flask into which the burette runs, 18 mL in 8 s; both: solute -> mol/L."""
    reactions = [("reaction", {"equation": equation}) for equation in equations]
    degrees = [0.0, 0.0, *([90.0] * 240), 0.0]
    return effects_of_tap_degrees(
        degrees,
        MIXING_IN_FLASK,
        *reactions,
        flask=glass("flask", volume_ml=10.0, solutes=flask),
        burette=glass("burette", volume_ml=50.0, solutes=burette, cavity=BURETTE_COLUMN),
        step_ns=33_333_333,
        settings={"full_area_m2": 1.2e-6},
    )["reaction"]


STATES = [
    ({"FeSO4": 0.05}, {"KMnO4": 0.02}, IRON, NONE_CAME + DIOXIDE),
    ({"Na2C2O4": 0.05}, {"KMnO4": 0.02}, IN_LYE, "it needs hydroxide, and none came into flask"),
    ({"FeSO4": 0.05, "H2SO4": 0.05, "NaOH": 0.2}, {"KMnO4": 0.02}, IRON, NONE_FREE),
    ({"KI": 0.05}, {"H2O2": 0.02}, PEROXIDE, NONE_CAME),
    ({"KI": 0.05, "NaOH": 0.1}, {"H2O2": 0.02}, PEROXIDE, NONE_CAME),
    ({"KI": 0.05, "NaOH": 0.1}, {"H2O2": 0.02, "HCl": 0.01}, PEROXIDE, NONE_FREE),
    ({"KI": 0.05}, {"H2SO4": 0.02}, "H2O2 + 2 I- + 2 H+ -> I2 + 2 H2O", "nobody brings 'H2O2'"),
    (
        {"FeSO4": 0.05, "NaOH": 0.1},
        {"H2O2": 0.02},
        "2 Fe(OH)2 + H2O2 -> 2 Fe(OH)3",
        "nobody brings .*its ions are there",
    ),
    ({"Na2SO3": 0.05, "NaOH": 0.5}, {"HCl": 0.05}, SULFITE, "no SO2 forms, there is too little acid"),
    ({"Na2SO3": 0.01}, {"HCl": 0.05}, SULFITE, "all SO2 stays dissolved, there is too little for bubbles"),
    (IODINE, {"HCl": 0.001}, IODATE, "it needs hydroxide, and none came into flask"),
    (IODINE, {"NaOH": 0.001, "HCl": 0.002}, IODATE, "it needs hydroxide, and none is free in flask"),
]


@pytest.mark.parametrize(("flask", "burette", "equation", "reason"), STATES)
def test_reaction_that_does_not_proceed_states_the_reason(flask, burette, equation, reason):
    """``flask``, ``burette``: solute -> mol/L; a reagent that nobody brings is refused before the run."""
    if reason.startswith("nobody brings"):
        with pytest.raises(Exception, match=reason):
            run(flask, burette, equation)
        return
    (event,) = run(flask, burette, equation).output.events_named("no-reaction")
    assert reason in event.text and event.text.startswith(equation)


@pytest.mark.slow
@pytest.mark.parametrize("flask", [{"FeSO4": 0.05, "H2SO4": 0.05}, {"FeSO4": 0.05, "CH3COOH": 0.5}])
def test_enough_acid_is_reported_as_no_lack(flask):
    """Half a mmol of iron(II) needs 0.8 mmol of protons; of either acid more is in the 10 mL."""
    events = run(flask, {"KMnO4": 0.02}, IRON).events
    assert not {event.name for event in events} & {"no-reaction", "stopped"}


@pytest.mark.slow
def test_reaction_stops_when_acid_runs_out_with_iron_left():
    """0.1 mmol of protons for 0.5 mmol of iron(II), which needs 0.8 mmol: an eighth reacts.

    The potential has rows while iron has both its forms and permanganate is used up, the pH to the end.
    """
    run_of = run({"FeSO4": 0.05, "H2SO4": 0.005}, {"KMnO4": 0.02}, IRON)
    (event,) = run_of.output.events_named("stopped")
    assert "stops in flask for want of acid: 0.438 mmol Fe^2+ and" in event.text and event.text.endswith(DIOXIDE)
    assert run_of.series["flask/potential"].times[-1] < run_of.series["flask/pH"].times[-1]


METALS = [
    ("Cu", {"AgNO3": 0.1}, "Cu + 2 AgNO3 -> Cu(NO3)2 + 2 Ag", "by 0.1 mmol, until no Cu is left; 0.0216 g Ag come"),
    ("Ag", {"Cu(NO3)2": 0.1}, "2 Ag + Cu(NO3)2 -> 2 AgNO3 + Cu", "does not proceed: its free energy is +88 kJ/mol"),
    ("CuO", {"H2SO4": 1.0}, "CuO + H2SO4 -> CuSO4 + H2O", "0.00795 g CuO dissolve in b"),
    ("Au", {"HNO3": 4.0}, "Au + 4 HNO3 -> Au(NO3)3 + NO + 2 H2O", "Au dissolves in no acid without chloride"),
    ("CuS", {"HCl": 1.0}, "CuS + 2 HCl -> CuCl2 + H2S", "does not proceed: CuS hardly dissolves in it"),
]


@pytest.mark.sampled(5)
@pytest.mark.parametrize(("solid", "solutes", "equation", "words"), METALS, ids=[row[0] for row in METALS])
def test_fate_of_a_solid_becomes_an_event(solid, solutes, equation, words):
    """0.1 mmol of the solid, and more of the solution than it needs; by stoichiometry 0.2 mmol, 21.6 mg, of silver."""
    powder = {"solid": {"formula": solid, "mass_g": 1e-4 * molar_mass(solid)}}
    bodies = (glass("a", volume_ml=60.0, solutes=solutes), glass("b", volume_ml=1.0, properties=powder))
    effects = effects_of_tilt_degrees(
        [0.0, *([60.0] * 20)], bodies, ("mixing", {"in": ["b"]}), ("reaction", {"equation": equation})
    )
    names = ("reacted", "solid-change", "no-reaction")
    (event,) = [event for name in names for event in effects["reaction"].output.events_named(name)]
    assert words in event.text and (event.name == "solid-change" or event.text.startswith(equation))
    assert leading_event(effects) == event


@pytest.mark.slow
def test_acid_freed_by_a_hydroxide_is_no_equilibrium():
    """Iron(III) hydroxide falls out and frees acid again: the equation had stopped for want of it."""
    run_of = run({"FeSO4": 0.05, "H2SO4": 0.005}, {"KMnO4": 0.02}, IRON, "Fe3+ + 3 H2O -> Fe(OH)3 + 3 H+")
    assert run_of.output.events_named("stopped") and not run_of.output.events_named("equilibrium")


@pytest.mark.slow
@pytest.mark.parametrize(("acid", "is_reported"), [(0.02, True), (0.5, False)])
def test_permanganate_in_too_little_acid_is_reported(acid, is_reported):
    """In weak acid it becomes MnO2; laboratory manuals take 0.5 mol/L of sulfuric acid."""
    run_of = run({"Na2C2O4": 0.05, "H2SO4": acid}, {"KMnO4": 0.005}, OXALATE)
    texts = [event.text for event in run_of.output.events_named("assumed")]
    assert len(texts) == is_reported and all("permanganate makes MnO2" in text for text in texts)


def test_a_cold_solution_is_saturated_by_its_own_temperature():
    """At 10 degC 21 g of KNO3 saturate 100 g of water and 1 mol/kg of KCl is beside; at 25 degC 38 g would."""
    powder = {"solid": {"formula": "KNO3", "mass_g": 5.0}, "temperature_c": 10.0}
    body = glass("flask", volume_ml=20.0, solutes={"KNO3": 1.8, "KCl": 1.0}, properties=powder)
    tables = (
        ("reaction", {"equation": "KNO3(s) -> K+ + NO3-", "rate_per_s": 0.5}),
        ("heat", {"of": "liquids", "ambient_c": 25.0, "loss_w_per_k": 0.0}),
    )
    output = (
        compute(session_with_effects({"flask": poses_at_rest(count=4)}, (body,), MIXING_IN_FLASK, *tables))
        .effects["reaction"]
        .output
    )
    (event,) = output.events_named("no-reaction")
    assert event.text.endswith("flask is saturated with KNO3") and "flask/pH" in output.series


@pytest.mark.parametrize(("equations", "is_reported"), [((IN_WATER,), True), ((IN_WATER, IODATE), False)])
def test_iodine_that_stands_in_lye_is_reported(equations, is_reported):
    """Permanganate makes iodine of iodide in water, and 8 hydroxide ions: a pH of 12, where iodine disproportionates.

    Where an equation lets it (IODATE) nothing has to be reported.
    """
    output = run({"KI": 0.05}, {"KMnO4": 0.005}, *equations).output
    assert any("lye takes it apart" in event.text for event in output.events_named("assumed")) == is_reported


def stops(process, extent, limits, *, to_the_end=0.0, has_equilibrium=False):
    """Texts of the stops of a process that ran by ``extent`` mol, and could run so far by each cause."""
    history = SimpleNamespace(times=np.array([0.0, 1.0]), extents=np.array([[0.0], [extent]]), amounts=np.zeros((2, 1)))
    none = np.zeros(0, dtype=np.int64)
    matter = SimpleNamespace(
        recipe=SimpleNamespace(processes=[process], reagent=lambda row, column: column),
        histories={"flask": history},
        celsius=lambda vessel, times: np.full(len(times), 25.0),
        ledger=SimpleNamespace(
            reactions=SimpleNamespace(phases=none, gas=none.astype(bool), formation=np.zeros((0, 1))),
            limits=SimpleNamespace(
                has_equilibrium=lambda row: has_equilibrium,
                extent_to_the_end=lambda row, amounts, celsius: to_the_end,
                by_cause=lambda row, amounts, celsius: limits,
            ),
        ),
    )
    return [event.text for event in stop_events(matter)]


SLOW, AT_ONCE = Process("A -> B", {"A": -1.0}, rate=1.0), Process("A -> B", {"A": -1.0})


@pytest.mark.parametrize(
    ("process", "extent", "to_the_end", "has_equilibrium", "fraction"),
    [
        (AT_ONCE, 0.6, 0.4, True, "60 %"), (AT_ONCE, 0.01, 0.99, True, "1 %"),
        (AT_ONCE, 0.009, 0.991, True, "less than 1 %"),
        (AT_ONCE, 0.995, 0.005, True, ""), (AT_ONCE, 0.985, 0.015, True, "98 %"), (AT_ONCE, 0.0, 1.0, True, ""),
        (SLOW, 0.6, 0.4, True, ""), (AT_ONCE, 0.6, 0.4, False, ""),
    ],
)  # fmt: skip
def test_equilibrium_states_what_fraction_has_reacted(process, extent, to_the_end, has_equilibrium, fraction):
    """``extent`` mol have reacted and ``to_the_end`` could still; 0 and more than 99 % are not worth a word."""
    texts = stops(process, extent, {}, to_the_end=to_the_end, has_equilibrium=has_equilibrium)
    expected = f"A -> B stops at its equilibrium in flask: {fraction} has reacted, by its free energy"
    assert texts == [expected] * bool(fraction)


TWO = Process("2 A + B -> C", {"A": -2.0, "B": -1.0, "H+": -1.0})


@pytest.mark.parametrize(
    ("extent", "limits", "is_reported"),
    [
        (0.6, {"A": 0.2, "B": 0.5, Cause.ACID: 0.0}, True),
        (0.6, {"A": 0.2, "B": 0.5, Cause.HYDROXIDE: 0.0}, True),
        (0.6, {"A": 0.2, "B": 0.5, Cause.ACID: 0.1}, False),
        (0.6, {"A": 0.2, "B": 0.5, Cause.SATURATION: 0.0}, False),
        (0.6, {"A": 0.2, Cause.ACID: 0.0}, False),
        (0.6, {"A": 0.2, "B": 0.001, Cause.ACID: 0.0}, False),
        (0.6, {"A": 0.2, "B": 0.01, Cause.ACID: 0.0}, True),
        (1e-6, {"A": 0.2, "B": 0.5, Cause.ACID: 0.0}, False),
        (0.0, {"A": 0.2, "B": 0.5, Cause.ACID: 0.0}, False),
    ],
    ids=["acid", "hydroxide", "acid left", "saturated", "one reagent", "no B", "some B", "a trace", "did not run"],
)
def test_reaction_stopped_for_want_of_acid_names_what_is_left(extent, limits, is_reported):
    """``limits``: mol by which each reagent lets 2 A + B -> C run on: 0.2 by A are 400 mmol of it."""
    texts = stops(TWO, extent, limits)
    cause = next((name for name in limits if name in (Cause.ACID, Cause.HYDROXIDE)), "")
    amounts = f"400 mmol A and {1e3 * limits.get('B', 0.0):g} mmol B are left"
    assert texts == [f"2 A + B -> C stops in flask for want of {cause}: {amounts}"] * is_reported
