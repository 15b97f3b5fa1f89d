"""Matter and energy are neither made nor lost, whatever is poured, spilled, dripped and reacted, in whatever order."""

from dataclasses import replace

import numpy as np
import pytest
from oracles.random_liquids import ZINC, assert_matter_and_energy_kept, check_scene, solver_of, step

from replay.effects.chemistry.components import WATER, dissolved_components
from replay.effects.chemistry.ledger import Ledger
from replay.effects.chemistry.ledger_columns import HEAT_COLUMN, LATENT_HEAT_COLUMN, UNFOLLOWED_WARMTH, Warmth
from replay.effects.chemistry.processes import Process
from replay.effects.chemistry.salts import salt_of, solubility_of

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")

MAGNESIUM = Process(
    "Mg + 2 H+", {"Mg(s)": -1.0, "H+": -2.0, "Mg^2+": 1.0, "H2(g)": 1.0}, rate=0.9, joule=-466.9e3, acid=2.0
)


@pytest.mark.sampled(3)
@pytest.mark.parametrize("seed", [2, 0, 1, 3, 4, 5, 6, 7])
def test_elements_charge_volume_and_energy_are_conserved_after_every_event(seed):
    """Vessels, reactions and what happens to them are drawn from the seed, and summed up after each event."""
    assert_matter_and_energy_kept(seed, warm=True)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 112), ids="world {}".format)
def test_matter_is_conserved_with_and_without_heat(seed):
    """The same with temperatures followed (``warm``) and without."""
    assert_matter_and_energy_kept(seed, warm=True)
    assert_matter_and_energy_kept(seed, warm=False)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_scenes_conserve_matter_at_any_rate_order_and_names(seed):
    """A random scene, which has a rate of its own, is run again with its tables backwards, and with other names."""
    check_scene(seed)


def test_zinc_takes_only_protons_that_phosphate_loses_by_ph_7():
    """At pH 7 phosphate is H2PO4- and HPO4^2- in the ratio 10^(7.2 - 7): of two protons it holds 1.62."""
    components = dissolved_components("NaH2PO4")
    book = Ledger(["a"], [*components], [ZINC], solver_of([*components, *ZINC.changes]))
    book.fill("a", 10.0, {"Zn(s)": 1.0, **components})
    volume_before = 1.0 + 1.0 / (1.0 + 10.0 ** (7.0 - 7.198))
    assert book.pending_extents(book.amounts[0])[0] == pytest.approx((2.0 - volume_before) / 2.0, rel=1e-3)


@pytest.mark.parametrize("seconds", [0.01, 1.0, 7.0])
def test_two_slow_reactions_last_as_long_as_time_does(seconds):
    """Zinc reacts by 0.3 per second, magnesium by 0.9; 10 mol of acid are plenty, 0.1 mol too little.

    A mol of either metal takes two of acid: of 0.1 mol of acid 0.05 mol react, a quarter of it zinc.
    """
    components = dissolved_components("HCl")
    book = Ledger(["a"], [*components], [ZINC, MAGNESIUM], solver=None)
    book.fill(
        "a",
        10.0,
        {"Zn(s)": 1.0, "Mg(s)": 1.0, **{component: 10.0 * amount for component, amount in components.items()}},
    )
    book.advance(0, 1, seconds)
    left = [book.amounts[0, book.column[metal]] for metal in ("Zn(s)", "Mg(s)")]
    assert left == pytest.approx(np.exp([-0.3 * seconds, -0.9 * seconds]), rel=1e-9)
    # Of too little acid each gets by its rate, and what is left falls by the sum of both.
    scarce = Ledger(["a"], [*components], [ZINC, MAGNESIUM], solver=None)
    scarce.fill(
        "a", 10.0, {"Zn(s)": 1.0, "Mg(s)": 1.0, **{component: 0.1 * amount for component, amount in components.items()}}
    )
    scarce.advance(0, 1, seconds)
    assert scarce.extents[0] == pytest.approx(0.05 * np.array([0.25, 0.75]) * -np.expm1(-1.2 * seconds), rel=0.02)


def ledger_of_salt_water(process=(), warmth=UNFOLLOWED_WARMTH):
    """A ledger of 10 mL with a mol of chloride in a, a millilitre of water in b, nothing in c."""
    book = Ledger("abc", ["Cl-"], process, solver=None, warmth=warmth)
    book.fill("a", 10.0, {"Cl-": 1.0, WATER: 0.55})
    book.fill("b", 1.0, {WATER: 0.055})
    book.begin(0.0)
    return book


def test_a_vessel_in_a_chain_gives_its_former_contents():
    """In each of 3 frames a, 10 mL with 1 mol, gives b 1 mL, and b gives c 1 mL: its own water first."""
    book, frames = ledger_of_salt_water(), np.arange(1, 4)
    book.flow(frames, frames * 0.01, [("a", "b"), ("b", "c")], np.ones((3, 2)), np.zeros(2, dtype=bool))
    assert book.amounts[:3, book.column["Cl-"]] == pytest.approx([0.7, 0.1, 0.2])


def test_a_flow_without_reaction_has_a_row_per_frame():
    """The ledger has a reaction of zinc, and no zinc; a pours into b for 100 frames after the first."""
    book, frames = ledger_of_salt_water([ZINC]), np.arange(1, 101)
    book.flow(frames, frames * 0.01, [("a", "b")], np.full((100, 1), 0.1), np.zeros(1, dtype=bool))
    assert len(book.history("b").times) == 101


def test_a_pour_leaves_the_heat_of_the_glass_behind():
    """5 mL at 10 K above the room carry 5 * 4.18 * 10 J; the glass, of 41.8 J/K, keeps its own."""
    warmth = Warmth(per_ml=4.18, glass={"a": 41.8}, excess={"a": 10.0}, loss=0.0, most=np.inf, room=20.0)
    book = ledger_of_salt_water(warmth=warmth)
    step(book, frame=1, time=0.01, moves=[("a", "c", 5.0)])
    assert book.amounts[2, [book.column["Cl-"], book.column[HEAT_COLUMN]]] == pytest.approx([0.5, 209.0])


@pytest.mark.parametrize(("excess", "warmer", "latent"), [(100.0, 80.0, 20.0), (-30.0, -20.0, -10.0)])
def test_liquid_stays_between_freezing_and_boiling(excess, warmer, latent):
    """Kelvin above a room of 20 degC: water boils at 80 and freezes at -20; what is beyond makes steam or ice."""
    warmth = Warmth(per_ml=4.18, glass={}, excess={"b": excess}, loss=0.0, most=80.0, room=20.0)
    book = ledger_of_salt_water(warmth=warmth)
    for frame in (1, 2):
        step(book, frame, time=0.01 * frame, moves=[("b", "c", 0.5)])
    poured = book.amounts[2, [book.column[HEAT_COLUMN], book.column[LATENT_HEAT_COLUMN]]]
    # A millilitre of water, 4.18 J/K.
    assert poured == pytest.approx([4.18 * warmer, 4.18 * latent])


@pytest.mark.parametrize(
    ("warmth", "joule", "expected"),
    [
        (UNFOLLOWED_WARMTH, -466.9e3, 0.0),
        (Warmth(per_ml=4.18, glass={}, excess={}, loss=0.0, most=np.inf), -466.9e3, -466.9e3),
        (Warmth(per_ml=4.18, glass={}, excess={}, loss=0.0, most=np.inf), np.nan, 0.0),
    ],
    ids=["no heat effect", "known", "unknown"],
)
def test_reaction_heat_counts_where_known_and_followed(warmth, joule, expected):
    """``joule``: that a mol of the reaction takes, NaN if unknown; ``warmth``: followed by an effect heat, or not."""
    process = replace(MAGNESIUM, joule=joule)
    assert Ledger("a", ["Cl-"], [process], solver=None, warmth=warmth).reactions.process_joule(0) == expected


def test_an_equilibrium_goes_on_while_another_equation_takes_its_product():
    """The first stops at even amounts and the second uses up what it makes: each round halves what is left."""
    to_bromide = Process("", {"Cl-": -1.0, "Br-": 1.0}, log_k=0.0)
    to_iodide = Process("", {"Br-": -1.0, "I-": 1.0})
    book = Ledger("a", ["Cl-", "Br-", "I-"], [to_bromide, to_iodide], solver=None)
    amounts = np.zeros((1, len(book.columns)))
    amounts[0, [book.column["Cl-"], book.column[WATER]]] = 1.0, 55.5
    assert book.reactions.run_processes(amounts)[0] == pytest.approx([1.0, 1.0], abs=1e-5)
    assert amounts[0, book.column["I-"]] == pytest.approx(1.0, abs=1e-5)


@pytest.mark.parametrize(("rate_per_s", "silver_chloride"), [(None, 1.0), (0.1, 0.0)])
def test_solid_dissolving_at_a_rate_feeds_no_equation_at_once(rate_per_s, silver_chloride):
    """A mol of salt stands in a litre with a mol of silver, which takes chloride as soon as some is dissolved."""
    salt = salt_of("NaCl", solubility_of("NaCl"))
    to_chloride = Process("", {"Ag+": -1.0, "Cl-": -1.0, "AgCl(s)": 1.0})
    dissolving = Process("", {"NaCl(s)": -1.0, "Na+": 1.0, "Cl-": 1.0}, rate_per_s, salt=salt)
    processes = [to_chloride] if rate_per_s is None else [to_chloride, dissolving]
    book = Ledger("a", ["Ag+"], processes, None, [salt])
    book.fill("a", 1000.0, {"NaCl(s)": 1.0, "Ag+": 1.0, WATER: 55.5})
    amounts, _ = book.reactions.react(book.amounts[:1], np.array([25.0]))
    assert amounts[0, book.column["AgCl(s)"]] == pytest.approx(silver_chloride)
    assert amounts[0, book.column["NaCl(s)"]] == pytest.approx(1.0 - silver_chloride if rate_per_s else 0.0)


def test_traces_beside_much_solid_keep_their_digits():
    """A mol of barium with sulfate in excess leaves 0.04 umol dissolved: as PHREEQC says, no difference of mols."""
    ions = {"Ba^2+": 1.0, "SO4^2-": 1.5, "Na+": 3.0, "Cl-": 2.0}
    solver = solver_of([*ions], solids=["BaSO4"])
    book = Ledger("a", [*ions], [], solver)
    book.fill("a", 1000.0, {**ions, WATER: 55.5})
    amounts, _ = book.reactions.react(book.amounts[:1], np.array([25.0]))
    totals = np.array([[ions.get(name, 0.0) for name in solver.mixture.components]])
    species = solver.equilibrium(totals, np.array([55.5]), np.array([25.0])).species
    dissolved = (species @ solver.mixture.powers)[0, solver.mixture.components.index("Ba^2+")]
    assert 0.0 < dissolved < 1e-7
    assert amounts[0, book.column["Ba^2+"]] == pytest.approx(dissolved, rel=1e-12, abs=0.0)
