"""Free energies of equations against standard potentials and constants of others, and what follows from them."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.liquid_worlds import MIXING_IN_FLASK, glass, poses_at_rest, session_with_effects

from replay.effects.chemistry.contents import contents_of_scene
from replay.effects.chemistry.ledger_columns import UNFOLLOWED_WARMTH
from replay.effects.chemistry.processes import Process
from replay.effects.chemistry.recipe import recipe_of
from replay.effects.chemistry.spontaneity import reason_not_to_proceed
from replay.effects.effect_plan import plan
from replay.engine import compute
from sessions.model.scene import Scene, SceneEffect

FARADAY_KJ = 96.485
WATER_KJ = 79.89  # of H+ + OH- -> H2O
PK_KJ = 5.708  # RT ln 10 at 25 degC: of one step of pK

# Equation, solutes, kJ/mol. Potentials: CRC Handbook, 97th ed., Electrochemical Series (V); constants at 25 degC.
ENERGIES = [
    ("Ag+ + Fe2+ -> Ag + Fe3+", ("AgNO3", "FeSO4"), -FARADAY_KJ * (0.7996 - 0.771)),
    ("2 Fe3+ + 2 I- -> 2 Fe2+ + I2", ("FeCl3", "KI"), -2 * FARADAY_KJ * (0.771 - 0.621)),
    ("Cr2O7^2- + 14 H+ + 6 Cl- -> 2 Cr3+ + 3 Cl2 + 7 H2O", ("K2Cr2O7", "HCl"), -6 * FARADAY_KJ * (1.36 - 1.35827)),
    ("Cr2O7^2- + 14 H+ + 6 Fe2+ -> 2 Cr3+ + 6 Fe3+ + 7 H2O", ("K2Cr2O7", "FeSO4", "HCl"), -6 * FARADAY_KJ * 0.589),
    # Hydrolysis of chlorine: pK 3.36 (Wang and Margerum, Inorg. Chem. 33, 1994); pKa of HClO 7.53 (CRC).
    ("Cl2 + H2O -> HCl + HClO", ("Cl2",), PK_KJ * 3.36),
    ("Cl2 + 2 NaOH -> NaCl + NaClO + H2O", ("Cl2", "NaOH"), PK_KJ * (3.36 + 7.53) - 2 * WATER_KJ),
    ("Cl2 + 2 OH- -> Cl- + ClO- + H2O", ("Cl2", "KOH"), PK_KJ * (3.36 + 7.53) - 2 * WATER_KJ),
    # Br2(aq)/Br- 1.0873 and, in base, BrO3-/Br- 0.61: BrO3-/Br2 0.5145.
    ("3 Br2 + 6 OH- -> 5 Br- + BrO3- + 3 H2O", ("Br2", "NaOH"), -5 * FARADAY_KJ * (1.0873 - 0.5145)),
]


def flask(solutes, molar=0.1):
    """A flask of 50 mL with 0.1 mol/L of each solute."""
    return glass("flask", volume_ml=50.0, solutes=dict.fromkeys(solutes, molar))


def scene_with(equation, solutes):
    """A session of that flask, which stands for 4 frames, with this equation."""
    return session_with_effects(
        {"flask": poses_at_rest(count=4)}, (flask(solutes),), MIXING_IN_FLASK, ("reaction", {"equation": equation})
    )


@pytest.mark.parametrize(("equation", "solutes", "kilojoule"), ENERGIES, ids=lambda value: str(value)[:40])
def test_free_energies_follow_from_potentials_and_constants(equation, solutes, kilojoule):
    """Equal to -n F E of the potentials, or RT ln 10 pK of the constants, to 5 % or 5 kJ/mol."""
    scene = scene_with(equation, solutes).scene
    tables = {kind: step.declared for kind, step in plan(scene).steps.items()}
    (reaction,) = recipe_of(tables, contents_of_scene(scene, "scene.toml")).reactions
    assert reaction.free_energy_j / 1e3 == pytest.approx(kilojoule, rel=0.05, abs=5.0)


@pytest.mark.parametrize(
    ("equation", "solutes", "is_reported"),
    [
        # By the potentials of ``ENERGIES``, of 0.1 mol/L some 69 % and 64 % react.
        ("Ag+ + Fe2+ -> Ag + Fe3+", ("AgNO3", "FeSO4"), True),
        ("2 Fe3+ + 2 I- -> 2 Fe2+ + I2", ("FeCl3", "KI"), True),
        # K is 2, but in 0.1 mol/L of H+ to its 14th power: nothing reacts, so nothing stops.
        ("Cr2O7^2- + 14 H+ + 6 Cl- -> 2 Cr3+ + 3 Cl2 + 7 H2O", ("K2Cr2O7", "HCl"), False),
        # Esters: K = 4. Source: P. Atkins and J. de Paula, Physical Chemistry, 10th ed. With 55 mol/L of water less
        # than 1 % of the acid becomes ester, and more than 99 % of an ester becomes acid, which counts as all.
        ("CH3COOH + C2H5OH -> CH3COOC2H5 + H2O", ("CH3COOH", "C2H5OH", "HCl"), True),
        ("CH3COOC2H5 + H2O -> CH3COOH + C2H5OH", ("CH3COOC2H5", "HCl"), False),
        # To the end: lye takes the acid of the ester, and water takes sugar apart for good.
        ("CH3COOC2H5 + NaOH -> CH3COONa + C2H5OH", ("CH3COOC2H5", "NaOH"), False),
        ("C12H22O11 + H2O -> 2 C6H12O6", ("C12H22O11", "HCl"), False),
        # To the end: free energies of -115 and -92 kJ/mol, K of 1e20 and 1e16.
        ("I2 + 2 S2O3^2- -> 2 I- + S4O6^2-", ("I2", "KI", "Na2S2O3"), False),
        ("Br2 + 2 KI -> 2 KBr + I2", ("Br2", "KI"), False),
    ],
)
def test_equations_that_stop_at_an_equilibrium_are_reported(equation, solutes, is_reported):
    """A warning ``assumed`` would be that an equation ran to its end although its free energy lets it stop before."""
    output = compute(scene_with(equation, solutes)).effects["reaction"].output
    events = output.events_named("equilibrium")
    assert bool(events) == is_reported and not output.events_named("assumed")
    assert all("stops at its equilibrium in flask" in event.text for event in events)


@pytest.mark.parametrize("equation", [row[0] for row in ENERGIES if "OH" in row[0]])
def test_halogens_react_with_lye(equation):
    """All of 0.01 mol/L does; their free energy in water, +62 kJ/mol of chlorine, forbade it before."""
    solutes = {"Br2" if "Br2" in equation else "Cl2": 0.01, "NaOH" if "NaOH" in equation else "KOH": 0.1}
    body = glass("flask", volume_ml=50.0, solutes=solutes)
    session = session_with_effects(
        {"flask": poses_at_rest(count=4)}, (body,), MIXING_IN_FLASK, ("reaction", {"equation": equation})
    )
    extent = compute(session).effects["reaction"].series["flask/extent"].values[-1]
    halogen = 0.01 * 50e-3  # mol in 50 mL; the equation of bromine takes three at a time
    assert extent == pytest.approx(halogen / (3 if "3 Br2" in equation else 1))


def test_reaction_with_a_rate_ends_at_its_equilibrium():
    """Iron(III) and iodide: about 67 % of what could react does, with a rate as without.

    A rate of 5 a second takes 0.2 s; in 60 times as long it agrees with the equilibrium to a thousandth.
    """
    mol_per_litre, millilitres = 0.01, 50.0
    flask = glass("flask", millilitres, solutes={"Fe(NO3)3": mol_per_litre, "KI": mol_per_litre, "HNO3": 0.1})
    most = mol_per_litre * millilitres / 1000 / 2  # mol: the equation takes two ions of each at a time

    def extent_after_12_s(**rate):
        reaction = ("reaction", {"equation": "2 Fe3+ + 2 I- -> 2 Fe2+ + I2", **rate})
        session = session_with_effects(
            {"flask": poses_at_rest(count=120)}, (flask,), MIXING_IN_FLASK, reaction, step_ns=100_000_000
        )
        return compute(session).effects["reaction"].series["flask/extent"].values[-1]

    at_once = extent_after_12_s()
    assert extent_after_12_s(rate_per_s=5.0) == pytest.approx(at_once, rel=1e-3)
    assert 0.4 * most < at_once < 0.96 * most


def test_equilibrium_of_potentials_takes_at_most_five_queries_a_row():
    """Silver runs into iron(II): each of 60 rows is at the constant of the potentials, by PHREEQC's activities."""
    bodies = (
        glass("burette", volume_ml=50.0, solute="AgNO3", molar=0.1),
        glass("flask", volume_ml=0.5, solutes={"Fe(NO3)2": 0.05}),
    )
    effects = (SceneEffect("mixing", {"in": ["flask"]}), SceneEffect("reaction", {"equation": ENERGIES[0][0]}))
    scene = Scene(bodies=bodies, effects=effects)
    tables = {kind: step.declared for kind, step in plan(scene).steps.items()}
    book = recipe_of(tables, contents_of_scene(scene, "scene.toml")).ledger(0.0, UNFOLLOWED_WARMTH)
    book.begin(0.0)
    frames = np.arange(1, 61)
    book.flow(frames, 0.01 * frames, [("burette", "flask")], np.full((60, 1), 0.02), np.zeros(1, dtype=bool))
    book.end(61, 0.7)
    assert book.solver.queries < 5 * 61
    amounts = book.history("flask").amounts[1:]
    components = book.solver.mixture.components
    totals, water = amounts[:, [book.column[name] for name in components]], amounts[:, book.column["H2O"]]
    equilibria = book.solver.equilibrium(totals, water, np.full(len(amounts), 25.0))
    activity = dict(zip(components, equilibria.log_activity.T, strict=True))
    quotient = activity["Fe^3+"] - activity["Fe^2+"] - activity["Ag+"]
    # Potentials and free energies differ by 0.06.
    assert np.ptp(quotient) < 1e-5 and quotient[0] == pytest.approx((0.7996 - 0.771) / 0.05916, abs=0.1)


@pytest.mark.parametrize(("base", "is_reported"), [("NH3", True), ("NaOH", False)])
def test_aluminium_that_ammonia_dissolves_is_reported(base, is_reported):
    """In textbooks ammonia leaves the fresh hydroxide; by PHREEQC two thirds of it dissolve in 0.5 mol/L."""
    body = glass("flask", volume_ml=50.0, solutes={"AlCl3": 0.025, base: 0.5})
    reaction = ("reaction", {"equation": "Al3+ + 3 OH- -> Al(OH)3"})
    output = (
        compute(session_with_effects({"flask": poses_at_rest(count=2)}, (body,), MIXING_IN_FLASK, reaction))
        .effects["reaction"]
        .output
    )
    assert len(output.events_named("fresh")) == is_reported


@pytest.mark.parametrize(
    ("equation", "solutes", "name"),
    [
        ("H+ + OH- -> H2O", {"Cl2": 0.02}, "assumed"),
        ("I2 + I- -> I3-", {"I2": 0.001, "KI": 0.1}, None),
        ("H4SiO4 + 2 NaOH -> Na2SiO3 + 3 H2O", {"H4SiO4": 0.001, "NaOH": 0.1}, None),
        ("3 C2H5OH + 2 CrO4^2- + 10 H+ -> 3 C2H4O + 2 Cr3+ + 8 H2O", {"C2H5OH": 0.1, "K2CrO4": 0.01, "HCl": 0.5}, None),
    ],
)
def test_chlorine_is_reported_and_known_products_are_not_refused(equation, solutes, name):
    """``name``: of the event that warns; none where the products are known."""
    body = glass("flask", volume_ml=50.0, solutes=solutes)
    session = session_with_effects(
        {"flask": poses_at_rest(count=2)}, (body,), MIXING_IN_FLASK, ("reaction", {"equation": equation})
    )
    events = compute(session).effects["reaction"].output.events_named("assumed")
    assert bool(events) == (name is not None)


@pytest.mark.parametrize(
    ("joule", "changes", "sides", "reason"),
    [
        (np.nan, {"Au(s)": -1.0}, "Au HNO3 -> AuNO3", "Au dissolves in no acid without chloride"),
        (np.nan, {"Au(s)": -1.0}, "Au HCl -> AuCl3 H2", ""),
        (np.nan, {"Au(s)": 1.0}, "HNO3 -> Au", ""),
        (-1e6, {"Zn(s)": -1.0}, "Zn HCl -> ZnCl2 H2", ""),
        (1e6, {"Cu(s)": -1.0}, "Cu HCl -> CuCl2 H2", "Cu is nobler than hydrogen"),
        (1e6, {"Cu(s)": -1.0}, "Cu HCl -> CuCl2", "its free energy is +1000 kJ/mol"),
        (1e6, {"S(s)": 1.0}, "H2S -> S H2", "its free energy is +1000 kJ/mol"),
    ],
)
def test_equation_that_does_not_proceed_has_its_reason(joule, changes, sides, reason):
    """``joule``: its free energy, if known; no reason where gold has chloride, or comes out, or energy is freed."""
    reagents, products = (side.split() for side in sides.split(" -> "))
    equation = SimpleNamespace(reagents=reagents, products=products)
    assert reason_not_to_proceed(joule, Process("", changes), equation) == reason
