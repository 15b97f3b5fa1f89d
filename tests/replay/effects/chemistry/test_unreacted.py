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
from replay.errors import PlanError

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


def titrated(flask, burette, *equations):
    """The reaction of 10 mL in the flask into which the burette runs, 18 mL in 8 s; both: solute -> mol/L."""
    reactions = [("reaction", {"equation": equation}) for equation in equations]
    degrees = [0.0, 0.0, *([90.0] * 40), 0.0]
    return effects_of_tap_degrees(
        degrees,
        MIXING_IN_FLASK,
        *reactions,
        flask=glass("flask", volume_ml=10.0, solutes=flask),
        burette=glass("burette", volume_ml=50.0, solutes=burette, cavity=BURETTE_COLUMN),
        step_ns=200_000_000,
        settings={"full_area_m2": 1.2e-6},
    )["reaction"]


NOT_PROCEEDING = [
    ({"FeSO4": 0.05}, {"KMnO4": 0.02}, IRON, NONE_CAME + DIOXIDE),
    ({"Na2C2O4": 0.05}, {"KMnO4": 0.02}, IN_LYE, "it needs hydroxide, and none came into flask"),
    ({"FeSO4": 0.05, "H2SO4": 0.05, "NaOH": 0.2}, {"KMnO4": 0.02}, IRON, NONE_FREE),
    ({"KI": 0.05}, {"H2O2": 0.02}, PEROXIDE, NONE_CAME),
    ({"KI": 0.05, "NaOH": 0.1}, {"H2O2": 0.02}, PEROXIDE, NONE_CAME),
    ({"KI": 0.05, "NaOH": 0.1}, {"H2O2": 0.02, "HCl": 0.01}, PEROXIDE, NONE_FREE),
    ({"Na2SO3": 0.05, "NaOH": 0.5}, {"HCl": 0.05}, SULFITE, "no SO2 forms, there is too little acid"),
    ({"Na2SO3": 0.01}, {"HCl": 0.05}, SULFITE, "all SO2 stays dissolved, there is too little for bubbles"),
    (IODINE, {"HCl": 0.001}, IODATE, "it needs hydroxide, and none came into flask"),
    (IODINE, {"NaOH": 0.001, "HCl": 0.002}, IODATE, "it needs hydroxide, and none is free in flask"),
]


@pytest.mark.parametrize(("flask", "burette", "equation", "reason"), NOT_PROCEEDING)
def test_reaction_that_does_not_proceed_states_the_reason(flask, burette, equation, reason):
    """18 mL of what is in the ``burette`` run into 10 mL in the ``flask``, solute -> mol/L.

    Both reagents meet, but acid or hydroxide is lacking for the equation, or for bubbles of its gas.
    """
    (event,) = titrated(flask, burette, equation).output.events_named("no-reaction")
    assert reason in event.text and event.text.startswith(equation)


@pytest.mark.parametrize(
    ("flask", "burette", "equation", "text"),
    [
        ({"KI": 0.05}, {"H2SO4": 0.02}, PEROXIDE, "nobody brings 'H2O2'"),
        ({"FeSO4": 0.05, "NaOH": 0.1}, {"H2O2": 0.02}, "2 Fe(OH)2 + H2O2 -> 2 Fe(OH)3",
         "nobody brings .*its ions are there"),
    ],
    ids=["no peroxide", "its ions only"],
)  # fmt: skip
def test_equation_whose_reagent_nobody_brings_is_refused(flask, burette, equation, text):
    """``flask``, ``burette``: solute -> mol/L. Nobody brings peroxide, or Fe(OH)2, of which only the ions are there.

    The scene is refused before it runs.
    """
    with pytest.raises(PlanError, match=text):
        titrated(flask, burette, equation)


@pytest.mark.slow
@pytest.mark.parametrize("flask", [{"FeSO4": 0.05, "H2SO4": 0.05}, {"FeSO4": 0.05, "CH3COOH": 0.5}])
def test_enough_acid_is_reported_as_no_lack(flask):
    """Permanganate runs into 10 mL of the flask, mol/L: MnO4- + 5 Fe2+ + 8 H+.

    Half a mmol of iron(II) needs 0.8 mmol of protons; either acid has more, 1 and 5 mmol: all iron(II) is oxidised.
    """
    names = {event.name for event in titrated(flask, {"KMnO4": 0.02}, IRON).events}
    assert "end-point" in names and not names & {"no-reaction", "stopped"}


@pytest.mark.slow
def test_reaction_stops_when_acid_runs_out_with_iron_left():
    """10 mL have 0.1 mmol of protons for 0.5 mmol of iron(II), which needs 0.8 mmol: an eighth, 0.0625 mmol, reacts.

    The redox potential has rows while iron has both its forms and permanganate is used up, the pH to the end.
    """
    reaction = titrated({"FeSO4": 0.05, "H2SO4": 0.005}, {"KMnO4": 0.02}, IRON)
    (event,) = reaction.output.events_named("stopped")
    assert "stops in flask for want of acid: 0.438 mmol Fe^2+ and" in event.text and event.text.endswith(DIOXIDE)
    assert reaction.series["flask/potential"].times[-1] < reaction.series["flask/pH"].times[-1]


def solid_in_water(formula):
    """Glass b with 10 mL of water and half a gram of a solid."""
    return glass("b", volume_ml=10.0, properties={"solid": {"formula": formula, "mass_g": 0.5}})


def test_reagent_that_never_came_is_named():
    """Glass a with 1 mol/L of ``solute`` stands beside glass b with the other reagent, and nothing is poured.

    In b a solid in water counts as a reagent that is there, and so do the ions of a salt: only ``solute`` is lacking.
    """
    for solute, other, equation in [
        ("HCl", solid_in_water("Zn"), "Zn + 2 HCl -> ZnCl2 + H2"),
        ("HCl", solid_in_water("CaCO3"), "CaCO3 + 2 HCl -> CaCl2 + H2O + CO2"),
        ("Na2S2O3", solid_in_water("AgCl"), "AgCl + 2 Na2S2O3 -> Na3Ag(S2O3)2 + NaCl"),
        ("AgNO3", glass("b", volume_ml=10.0, solute="NaCl", molar=0.1), "AgNO3 + NaCl -> AgCl + NaNO3"),
    ]:
        bodies = (glass("a", volume_ml=60.0, solute=solute, molar=1.0), other)
        upright, reaction = [0.0] * 3, ("reaction", {"equation": equation})
        output = effects_of_tilt_degrees(upright, bodies, ("mixing", {"in": ["b"]}), reaction)["reaction"].output
        texts = [event.text for event in output.events_named("no-reaction")]
        assert texts == [f"{equation} does not proceed: {solute} never came to its other reagents"], equation


def test_reagent_that_another_equation_makes_is_not_missing():
    """Peroxide from the burette makes iodine of the iodide in the flask (mol/L), in acid; nobody brings iodine.

    An equation that takes this iodine lacks only the hydroxide, as acid is all that came.
    """
    output = titrated({"KI": 0.05, "HCl": 0.2}, {"H2O2": 0.02}, PEROXIDE, IODATE).output
    texts = [event.text for event in output.events_named("no-reaction")]
    assert texts == [f"{IODATE} does not proceed: it needs hydroxide, and none came into flask"]


METALS = [
    ("Cu", {"AgNO3": 0.1}, "Cu + 2 AgNO3 -> Cu(NO3)2 + 2 Ag", "by 0.1 mmol, until no Cu is left; 0.0216 g Ag come"),
    ("Ag", {"Cu(NO3)2": 0.1}, "2 Ag + Cu(NO3)2 -> 2 AgNO3 + Cu", "does not proceed: its free energy is +88 kJ/mol"),
    ("CuO", {"H2SO4": 1.0}, "CuO + H2SO4 -> CuSO4 + H2O", "0.00795 g CuO dissolve in b"),
    ("Au", {"HNO3": 4.0}, "Au + 4 HNO3 -> Au(NO3)3 + NO + 2 H2O", "Au dissolves in no acid without chloride"),
    ("CuS", {"HCl": 1.0}, "CuS + 2 HCl -> CuCl2 + H2S", "does not proceed: CuS hardly dissolves in it"),
]


@pytest.mark.sampled(5)
@pytest.mark.parametrize(("solid", "solutes", "equation", "text"), METALS, ids=[row[0] for row in METALS])
def test_fate_of_a_solid_becomes_an_event(solid, solutes, equation, text):
    """More of a solution (mol/L) than needed is poured on 0.1 mmol of a solid; ``text``: of the only event about it.

    Copper makes 0.2 mmol, 21.6 mg, of silver; 0.1 mmol of CuO are 7.95 mg. The event leads the summary of the run.
    """
    powder = {"solid": {"formula": solid, "mass_g": 1e-4 * molar_mass(solid)}}
    bodies = (glass("a", volume_ml=60.0, solutes=solutes), glass("b", volume_ml=1.0, properties=powder))
    effects = effects_of_tilt_degrees(
        [0.0, *([60.0] * 20)], bodies, ("mixing", {"in": ["b"]}), ("reaction", {"equation": equation})
    )
    names = ("reacted", "solid-change", "no-reaction")
    (event,) = [event for name in names for event in effects["reaction"].output.events_named(name)]
    assert text in event.text and (event.name == "solid-change" or event.text.startswith(equation))
    assert leading_event(effects) == event


@pytest.mark.slow
def test_acid_freed_by_a_hydroxide_is_no_equilibrium():
    """Permanganate oxidises iron(II) and uses up the acid; iron(III) hydroxide falls out and frees acid again.

    The event says that the equation stops for want of acid, not that it is at an equilibrium.
    """
    output = titrated({"FeSO4": 0.05, "H2SO4": 0.005}, {"KMnO4": 0.02}, IRON, "Fe3+ + 3 H2O -> Fe(OH)3 + 3 H+").output
    assert output.events_named("stopped")
    assert not output.events_named("equilibrium")


@pytest.mark.slow
@pytest.mark.parametrize(("acid_molar", "events"), [(0.02, 1), (0.5, 0)], ids=["little acid", "as manuals say"])
def test_permanganate_in_too_little_acid_is_reported(acid_molar, events):
    """18 mL of permanganate, 0.09 mmol, run into 10 mL of oxalate and use up 0.72 mmol of protons, 8 each.

    0.02 mol/L of H2SO4 has 0.4 mmol at most: the pH rises beyond 4, from where on this program says that MnO2 forms,
    and not Mn2+ as in the equation. 0.5 mol/L, which laboratory manuals take, has more than 5 mmol.
    """
    output = titrated({"Na2C2O4": 0.05, "H2SO4": acid_molar}, {"KMnO4": 0.005}, OXALATE).output
    texts = [event.text for event in output.events_named("assumed")]
    assert len(texts) == events
    assert all("permanganate makes MnO2" in text for text in texts)


def test_a_cold_solution_is_saturated_by_its_own_temperature():
    """5 g of solid KNO3 lie in 20 mL of 10 degC with 1.8 mol/L of it and 1 mol/L of KCl, which has K+ too.

    At 10 degC 21 g of KNO3, 2.1 mol/kg, saturate water; at the room's 25 degC it would be 38 g. The pH is a series,
    though nothing reacts.
    """
    powder = {"solid": {"formula": "KNO3", "mass_g": 5.0}, "temperature_c": 10.0}
    flask = glass("flask", volume_ml=20.0, solutes={"KNO3": 1.8, "KCl": 1.0}, properties=powder)
    tables = (
        ("reaction", {"equation": "KNO3(s) -> K+ + NO3-", "rate_per_s": 0.5}),
        ("heat", {"of": "liquids", "ambient_c": 25.0, "loss_w_per_k": 0.0}),
    )
    session = session_with_effects({"flask": poses_at_rest(count=4)}, (flask,), MIXING_IN_FLASK, *tables)
    output = compute(session).effects["reaction"].output
    (event,) = output.events_named("no-reaction")
    assert event.text.endswith("flask is saturated with KNO3")
    assert "flask/pH" in output.series


@pytest.mark.parametrize(
    ("equations", "is_reported"),
    [((IN_WATER,), True), ((IN_WATER, IODATE), False)],
    ids=["iodine stays", "an equation makes iodate of it"],
)
def test_iodine_that_stands_in_lye_is_reported(equations, is_reported):
    """Permanganate makes iodine of iodide in water, and 8 hydroxide ions: a pH of 12, where iodine disproportionates.

    Where the scene has an equation for that nothing has to be reported.
    """
    events = titrated({"KI": 0.05}, {"KMnO4": 0.005}, *equations).output.events_named("assumed")
    assert any("lye takes it apart" in event.text for event in events) == is_reported


def texts_of_stops(process, extent, limits, *, to_the_end=0.0, has_equilibrium=False):
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


FRACTIONS = {
    "60 %": (AT_ONCE, 0.6, 0.4, True, "60 %"),
    "1 %": (AT_ONCE, 0.01, 0.99, True, "1 %"),
    "0.9 %": (AT_ONCE, 0.009, 0.991, True, "less than 1 %"),
    "99.5 %": (AT_ONCE, 0.995, 0.005, True, ""),
    "98.5 %": (AT_ONCE, 0.985, 0.015, True, "98 %"),
    "nothing": (AT_ONCE, 0.0, 1.0, True, ""),
    "with a rate": (SLOW, 0.6, 0.4, True, ""),
    "not at an equilibrium": (AT_ONCE, 0.6, 0.4, False, ""),
}  # fmt: skip


def test_equilibrium_states_what_fraction_has_reacted():
    """The equation A -> B has run by ``extent`` mol in a flask, and ``to_the_end`` mol of A are left, a mol in all.

    ``fraction``: of the mol has reacted, as the event states it. There is no event ("") of 0 or of 99 % and
    more, nor of an equation with a rate or without an equilibrium.
    """
    for case, (process, extent, to_the_end, has_equilibrium, fraction) in FRACTIONS.items():
        texts = texts_of_stops(process, extent, limits={}, to_the_end=to_the_end, has_equilibrium=has_equilibrium)
        expected = f"A -> B stops at its equilibrium in flask: {fraction} has reacted, by its free energy"
        assert texts == ([expected] if fraction else []), case


TWO_REAGENTS = Process("2 A + B -> C", {"A": -2.0, "B": -1.0, "H+": -1.0})


STOPS = {
    "acid": (0.6, {"A": 0.2, "B": 0.5, Cause.ACID: 0.0}, True),
    "hydroxide": (0.6, {"A": 0.2, "B": 0.5, Cause.HYDROXIDE: 0.0}, True),
    "acid left": (0.6, {"A": 0.2, "B": 0.5, Cause.ACID: 0.1}, False),
    "saturated": (0.6, {"A": 0.2, "B": 0.5, Cause.SATURATION: 0.0}, False),
    "one reagent": (0.6, {"A": 0.2, Cause.ACID: 0.0}, False),
    "no B": (0.6, {"A": 0.2, "B": 0.001, Cause.ACID: 0.0}, False),
    "some B": (0.6, {"A": 0.2, "B": 0.01, Cause.ACID: 0.0}, True),
    "a trace": (1e-6, {"A": 0.2, "B": 0.5, Cause.ACID: 0.0}, False),
    "did not run": (0.0, {"A": 0.2, "B": 0.5, Cause.ACID: 0.0}, False),
}


def test_reaction_stopped_for_want_of_acid_names_what_is_left():
    """2 A + B + H+ -> C has run by ``extent`` mol; ``limits``: mol by which each reagent, or acid, lets it run on.

    0.2 by A are 400 mmol of it. A stop is reported where the equation ran, by more than 1 in 10,000, more than 1 % of
    both reagents is left, and acid or hydroxide is used up.
    """
    for case, (extent, limits, is_reported) in STOPS.items():
        texts = texts_of_stops(TWO_REAGENTS, extent, limits)
        cause = next((name for name in limits if name in (Cause.ACID, Cause.HYDROXIDE)), "")
        amounts = f"400 mmol A and {1e3 * limits.get('B', 0.0):g} mmol B are left"
        expected = f"2 A + B -> C stops in flask for want of {cause}: {amounts}"
        assert texts == ([expected] if is_reported else []), case
