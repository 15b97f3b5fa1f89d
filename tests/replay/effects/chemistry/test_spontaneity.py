"""Free energies of equations against standard potentials and constants of others, and what follows from them."""

from types import SimpleNamespace

import numpy as np
import pytest
from support.liquid_worlds import MIXING_IN_FLASK, glass, poses_at_rest, session_with_effects

from replay.effects.chemistry.contents import Contents, contents_of_scene
from replay.effects.chemistry.ledger_columns import UNFOLLOWED_WARMTH
from replay.effects.chemistry.processes import Process
from replay.effects.chemistry.recipe import recipe_of
from replay.effects.chemistry.spontaneity import (
    constant_of,
    energy_in_water,
    reason_not_to_proceed,
    stops_early,
    strongest_acid,
)
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


def session_of_flask(equation, solutes, count=4):
    """A session of a flask of 50 mL with these solutes (mol/L), which stands for so many frames, with an equation."""
    flask = glass("flask", volume_ml=50.0, solutes=solutes)
    reaction = ("reaction", {"equation": equation})
    return session_with_effects({"flask": poses_at_rest(count)}, (flask,), MIXING_IN_FLASK, reaction)


def test_free_energies_follow_from_potentials_and_constants():
    """An equation between ``solutes`` of a flask; its free energy, from tables, agrees within 5 % or 5 kJ/mol.

    ``kilojoule``: a mol, -n F E of standard potentials or RT ln 10 pK of constants of handbooks.
    """
    for equation, solutes, kilojoule in ENERGIES:
        scene = session_of_flask(equation, dict.fromkeys(solutes, 0.1)).scene
        tables = {kind: step.declared for kind, step in plan(scene).steps.items()}
        (reaction,) = recipe_of(tables, contents_of_scene(scene, "scene.toml")).reactions
        assert reaction.free_energy_j / 1e3 == pytest.approx(kilojoule, rel=0.05, abs=5.0), equation


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
    """A flask has 0.1 mol/L of each of ``solutes``; an event says where their equation stops at its equilibrium.

    No warning "assumed" says that it ran to its end although its free energy would let it stop before.
    """
    session = session_of_flask(equation, dict.fromkeys(solutes, 0.1))
    output = compute(session).effects["reaction"].output
    events = output.events_named("equilibrium")
    assert len(events) == is_reported
    assert all("stops at its equilibrium in flask" in event.text for event in events)
    assert not output.events_named("assumed")


@pytest.mark.parametrize(
    ("equation", "halogen", "lye", "halogens_at_a_time"),
    [
        ("Cl2 + 2 NaOH -> NaCl + NaClO + H2O", "Cl2", "NaOH", 1),
        ("Cl2 + 2 OH- -> Cl- + ClO- + H2O", "Cl2", "KOH", 1),
        ("3 Br2 + 6 OH- -> 5 Br- + BrO3- + 3 H2O", "Br2", "NaOH", 3),
    ],
)
def test_halogens_react_with_lye(equation, halogen, lye, halogens_at_a_time):
    """All of 0.01 mol/L of a halogen in 50 mL reacts with 0.1 mol/L of lye.

    A free energy of the halogen with water instead, +62 kJ/mol of chlorine, would forbid it.
    """
    session = session_of_flask(equation, {halogen: 0.01, lye: 0.1})
    extent = compute(session).effects["reaction"].series["flask/extent"].values[-1]
    halogen_mol = 0.01 * 50e-3
    assert extent == pytest.approx(halogen_mol / halogens_at_a_time)


def test_reaction_with_a_rate_ends_at_its_equilibrium():
    """Iron(III) and iodide: about 67 % of what could react does, at once, and by 5 a second after 12 s.

    The rate takes 0.2 s; in 60 times as long it agrees with the equilibrium to a thousandth.
    """
    mol_per_litre, millilitres = 0.01, 50.0
    flask = glass("flask", millilitres, solutes={"Fe(NO3)3": mol_per_litre, "KI": mol_per_litre, "HNO3": 0.1})
    most_mol = mol_per_litre * millilitres / 1000 / 2  # the equation takes two ions of each at a time

    def extent_after_12_s(**rate):
        reaction = ("reaction", {"equation": "2 Fe3+ + 2 I- -> 2 Fe2+ + I2", **rate})
        session = session_with_effects(
            {"flask": poses_at_rest(count=120)}, (flask,), MIXING_IN_FLASK, reaction, step_ns=100_000_000
        )
        return compute(session).effects["reaction"].series["flask/extent"].values[-1]

    at_once = extent_after_12_s()
    assert extent_after_12_s(rate_per_s=5.0) == pytest.approx(at_once, rel=1e-3)
    assert 0.4 * most_mol < at_once < 0.96 * most_mol  # loose: neither little nor all


def test_equilibrium_of_potentials_takes_at_most_five_queries_a_row():
    """Silver runs into iron(II) in 60 steps: Ag+ + Fe2+ -> Ag + Fe3+, of potentials 0.7996 and 0.771 V.

    In each the quotient of PHREEQC's activities is the same, and its log10 the difference of the potentials by
    0.05916 V; PHREEQC computes at most five solutions a step.
    """
    bodies = (
        glass("burette", volume_ml=50.0, solute="AgNO3", molar=0.1),
        glass("flask", volume_ml=0.5, solutes={"Fe(NO3)2": 0.05}),
    )
    effects = (SceneEffect("mixing", {"in": ["flask"]}), SceneEffect("reaction", {"equation": ENERGIES[0][0]}))
    scene = Scene(bodies=bodies, effects=effects)
    tables = {kind: step.declared for kind, step in plan(scene).steps.items()}
    ledger = recipe_of(tables, contents_of_scene(scene, "scene.toml")).ledger(0.0, UNFOLLOWED_WARMTH)
    ledger.begin(0.0)
    steps = 60
    frames, volume_ml = np.arange(1, 1 + steps), np.full((steps, 1), 0.02)
    ledger.flow(frames, 0.01 * frames, [("burette", "flask")], volume_ml, over=np.zeros(1, dtype=bool))
    ledger.end(steps + 1, 0.7)
    assert ledger.solver.queries < 5 * (steps + 1)
    _at_start, *rows = ledger.history("flask").amounts
    amounts, components = np.array(rows), ledger.solver.mixture.components
    totals, water = amounts[:, [ledger.column[name] for name in components]], amounts[:, ledger.column["H2O"]]
    equilibria = ledger.solver.equilibrium(totals, water, np.full(len(amounts), 25.0))
    log_activity = dict(zip(components, equilibria.log_activity.T, strict=True))
    log_quotient = log_activity["Fe^3+"] - log_activity["Fe^2+"] - log_activity["Ag+"]
    assert np.ptp(log_quotient) < 1e-5
    # Potentials and free energies, of which the constant is computed, differ by 0.06.
    assert log_quotient[0] == pytest.approx((0.7996 - 0.771) / 0.05916, abs=0.1)


@pytest.mark.parametrize(("base", "events"), [("NH3", 1), ("NaOH", 0)])
def test_aluminium_that_ammonia_dissolves_is_reported(base, events):
    """Aluminium and 0.5 mol/L of a base: in textbooks ammonia leaves the fresh hydroxide, and lye dissolves it.

    By PHREEQC two thirds of it dissolve in the ammonia: an event "fresh" says so.
    """
    session = session_of_flask("Al3+ + 3 OH- -> Al(OH)3", {"AlCl3": 0.025, base: 0.5}, count=2)
    assert len(compute(session).effects["reaction"].output.events_named("fresh")) == events


@pytest.mark.parametrize(
    ("equation", "solutes", "events"),
    [
        ("H+ + OH- -> H2O", {"Cl2": 0.02}, 1),
        ("I2 + I- -> I3-", {"I2": 0.001, "KI": 0.1}, 0),
        ("H4SiO4 + 2 NaOH -> Na2SiO3 + 3 H2O", {"H4SiO4": 0.001, "NaOH": 0.1}, 0),
        ("3 C2H5OH + 2 CrO4^2- + 10 H+ -> 3 C2H4O + 2 Cr3+ + 8 H2O", {"C2H5OH": 0.1, "K2CrO4": 0.01, "HCl": 0.5}, 0),
    ],
    ids=["chlorine", "triiodide", "silicate", "acetaldehyde"],
)
def test_chlorine_is_reported_and_known_products_are_not_refused(equation, solutes, events):
    """``solutes``: mol/L in a flask. A warning says of chlorine that its own reaction with water is not computed.

    There is none of the others, whose products the tables know.
    """
    session = session_of_flask(equation, solutes, count=2)
    assert len(compute(session).effects["reaction"].output.events_named("assumed")) == events


ENDS = {
    "gold without chloride": (np.nan, {"Au(s)": -1.0}, "Au HNO3 -> AuNO3", "Au dissolves in no acid without chloride"),
    "gold with chloride": (np.nan, {"Au(s)": -1.0}, "Au HCl -> AuCl3 H2", ""),
    "gold comes out": (np.nan, {"Au(s)": 1.0}, "HNO3 -> Au", ""),
    "zinc": (-1e6, {"Zn(s)": -1.0}, "Zn HCl -> ZnCl2 H2", ""),
    "copper makes hydrogen": (1e6, {"Cu(s)": -1.0}, "Cu HCl -> CuCl2 H2", "Cu is nobler than hydrogen"),
    "copper makes none": (1e6, {"Cu(s)": -1.0}, "Cu HCl -> CuCl2", "its free energy is +1000 kJ/mol"),
    "sulfur comes out": (1e6, {"S(s)": 1.0}, "H2S -> S H2", "its free energy is +1000 kJ/mol"),
}  # fmt: skip


def test_equation_that_does_not_proceed_has_its_reason():
    """``joule``: free energy of a mol of an equation, NaN if not known; ``sides``: its formulas without coefficients.

    ``changes``: mol of a solid that it makes or, below 0, takes; ``reason``: why it does not proceed, "" where it does.
    """
    for case, (joule, changes, sides, reason) in ENDS.items():
        reagents, products = (side.split() for side in sides.split(" -> "))
        equation = SimpleNamespace(reagents=reagents, products=products)
        assert reason_not_to_proceed(joule, Process("", changes), equation) == reason, case


VESSELS = {
    "one proton": ([(10.0, {"HCl": 0.02})], 2.0),
    "two protons": ([(10.0, {"H2SO4": 0.02})], 4.0),
    "of two vessels": ([(10.0, {"HCl": 0.02}), (10.0, {"HNO3": 0.03, "H2O": 0.5})], 3.0),
    "a weak acid": ([(10.0, {"CH3COOH": 0.02, "NaCl": 0.5})], 0.0),
    "a dry vessel": ([(0.0, {"HCl": 0.02})], 0.0),
    "no vessel": ([], 0.0),
}


def test_strongest_acid_has_the_most_protons_a_litre():
    """``vessels``: (millilitres, formula -> mol) of each; ``molar``: mol/L of protons in the most acid of them.

    H2SO4 has two protons, HCl and HNO3 one; weak acids, salts and a dry vessel do not count.
    """
    for case, (vessels, molar) in VESSELS.items():
        contents = {str(row): Contents(*vessel, solids={}, solubility={}) for row, vessel in enumerate(vessels)}
        assert strongest_acid(contents) == pytest.approx(molar), case


NO_ESTER = SimpleNamespace(reagents={}, products={})


def test_constant_follows_from_free_energies():
    """Ag+ + Fe2+ -> Ag + Fe3+ has 0.0286 V between its potentials; 0.0592 V are a power of ten of its constant.

    By the tables of free energies it is that within a power of ten.
    """
    changes = {"Ag+": -1.0, "Fe^2+": -1.0, "Ag(s)": 1.0, "Fe^3+": 1.0}
    log_k, is_ester = constant_of(changes, NO_ESTER)
    assert log_k == pytest.approx(0.0286 / 0.0592, abs=0.9) and not is_ester


def test_sulfide_and_thiosulfate_that_falls_apart_have_no_constant():
    """``changes``: mol that an equation makes, below 0 takes; its constant is NaN, that is, not known.

    Tables contradict each other on sulfide; thiosulfate does not stop at sulfur but makes acids of sulfur too.
    """
    for case, changes in {
        "sulfide": {"S^2-": -1.0, "S(s)": 1.0},
        "thiosulfate to sulfur": {"S2O3^2-": -1.0, "S(s)": 1.0},
    }.items():
        assert np.isnan(constant_of(changes, NO_ESTER)[0]), case


def test_ester_has_a_constant_of_four():
    """Acetic acid and ethanol make ethyl acetate and water with a constant of 4; the reverse has 1/4, -log10(4)."""
    for case, direction in {
        "made": 1,
        "taken apart": -1,
    }.items():
        sides = [dict.fromkeys(side, 1) for side in (("CH3COOH", "C2H5OH"), ("CH3COOC2H5", "H2O"))]
        reagents, products = sides[::direction]
        log_k, is_ester = constant_of({}, SimpleNamespace(reagents=reagents, products=products))
        assert log_k == pytest.approx(direction * np.log10(4.0), abs=0.01) and is_ester, case


def test_protons_in_neutral_water_count_unless_an_acid_brings_them():
    """A constant of 100 is -2 x 5.708 kJ; a mol of protons at pH 7 has 39.95 kJ less, about 7 x 5.708, than at pH 0.

    ``protons``: that a mol of the process makes, below 0 takes; ``acid``: above 0 where an acid brings those it takes,
    so that these count as at pH 0.
    """
    for acid, protons, kilojoule in [
        (0.0, -1.0, -11.416 + 39.95),
        (0.0, 1.0, -11.416 - 39.95),
        (1.0, -1.0, -11.416),
        (1.0, 1.0, -11.416 - 39.95),
    ]:
        process = Process("", {"H+": protons}, acid=acid, log_k=2.0)
        assert energy_in_water(process) / 1e3 == pytest.approx(kilojoule), (acid, protons)


def test_reaction_near_zero_energy_stops_early():
    """A reaction with more than -12 and up to 20 kJ/mol leaves some of its reagents.

    With less it is complete, with more it does not run: both limits are chosen. An energy that is not known (NaN) is no
    reason to stop early.
    """
    for joule, is_early in [
        (-20e3, False),
        (-12e3, False),
        (-11.9e3, True),
        (20e3, True),
        (20.1e3, False),
        (np.nan, False),
    ]:
        assert stops_early(joule) == is_early, joule
