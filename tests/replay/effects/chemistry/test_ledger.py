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
    """Vessels, reactions and what happens to them (pours, spills, drips) are drawn from the seed.

    After each event all elements, charges, volumes and the energy, the heat of reactions included, sum up as before.
    """
    assert_matter_and_energy_kept(seed, warm=True)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 112), ids="world {}".format)
def test_matter_is_conserved_with_and_without_heat(seed):
    """Vessels, reactions, pours and spills are drawn from the seed, with temperatures followed (``warm``) and without.

    After each event elements, charges, volumes and energy sum up as before.
    """
    assert_matter_and_energy_kept(seed, warm=True)
    assert_matter_and_energy_kept(seed, warm=False)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_scenes_conserve_matter_at_any_rate_order_and_names(seed):
    """A random scene, which has a rate of its own, is run again with its tables backwards, and with other names."""
    check_scene(seed)


def test_zinc_takes_only_protons_that_phosphate_loses_by_ph_7():
    """A mol of zinc lies in a mol of NaH2PO4, and dissolves by two protons a mol, until the pH is 7.

    There phosphate is H2PO4- and HPO4^2- in the ratio 10^(7.2 - 7): of its two protons it keeps 1.61 and loses 0.39.
    """
    components = dissolved_components("NaH2PO4")
    ledger = Ledger(["a"], [*components], [ZINC], solver_of([*components, *ZINC.changes]))
    ledger.fill("a", 10.0, {"Zn(s)": 1.0, **components})
    protons_at_ph_7 = 1.0 + 1.0 / (1.0 + 10.0 ** (7.0 - 7.198))
    (extent,) = ledger.pending_extents(ledger.amounts[0])
    assert extent == pytest.approx((2.0 - protons_at_ph_7) / 2.0, rel=1e-3)


def zinc_and_magnesium_in_acid(acid_mol, seconds):
    """A ledger after so long of a vessel with a mol of each metal; zinc reacts by 0.3 a second, magnesium by 0.9."""
    acid = {component: acid_mol * count for component, count in dissolved_components("HCl").items()}
    ledger = Ledger(["a"], [*acid], [ZINC, MAGNESIUM], solver=None)
    ledger.fill("a", 10.0, {"Zn(s)": 1.0, "Mg(s)": 1.0, **acid})
    ledger.advance(0, 1, seconds)
    return ledger


def test_metals_in_plenty_of_acid_decay_exponentially_by_their_rates():
    """A mol of zinc, with a rate of 0.3 a second, and a mol of magnesium, of 0.9, lie in 10 mol of acid.

    They need 4 mol, so the acid slows neither: after t seconds exp(-rate t) of each is left.
    """
    for seconds in [0.01, 1.0, 7.0]:
        ledger = zinc_and_magnesium_in_acid(acid_mol=10.0, seconds=seconds)
        zinc_mol, magnesium_mol = (ledger.amounts[0, ledger.column[metal]] for metal in ("Zn(s)", "Mg(s)"))
        assert zinc_mol == pytest.approx(np.exp(-0.3 * seconds), rel=1e-9), seconds
        assert magnesium_mol == pytest.approx(np.exp(-0.9 * seconds), rel=1e-9), seconds


def test_scarce_acid_goes_to_slow_reactions_by_their_rates():
    """A mol of zinc, with a rate of 0.3 a second, and a mol of magnesium, of 0.9, lie in 0.1 mol of acid.

    A mol of metal takes two of acid, so 0.05 mol of metal react in the end: 0.3 / 1.2, a quarter, is zinc. Of the acid
    exp(-1.2 t) is left after t seconds, by the sum of both rates.
    """
    for seconds in [0.01, 1.0, 7.0]:
        ledger = zinc_and_magnesium_in_acid(acid_mol=0.1, seconds=seconds)
        reacted_mol = 0.05 * -np.expm1(-(0.3 + 0.9) * seconds)
        assert ledger.extents[0] == pytest.approx([0.25 * reacted_mol, 0.75 * reacted_mol], rel=0.02), seconds


def ledger_of_salt_water(process=(), warmth=UNFOLLOWED_WARMTH):
    """A ledger of 10 mL with a mol of chloride in a, a millilitre of water in b, nothing in c."""
    ledger = Ledger("abc", ["Cl-"], process, solver=None, warmth=warmth)
    ledger.fill("a", 10.0, {"Cl-": 1.0, WATER: 0.55})
    ledger.fill("b", 1.0, {WATER: 0.055})
    ledger.begin(0.0)
    return ledger


def test_a_vessel_in_a_chain_gives_its_former_contents():
    """Vessel a has 10 mL with a mol of chloride, b 1 mL of water; in each of 3 frames a gives b 1 mL, and b gives c 1.

    What b gives in a frame is what it had before: first its own water, so that two of three tenths come to c.
    """
    ledger, frames = ledger_of_salt_water(), np.arange(1, 4)
    ledger.flow(frames, frames * 0.01, [("a", "b"), ("b", "c")], np.ones((3, 2)), np.zeros(2, dtype=bool))
    in_a, in_b, in_c, *_ = ledger.amounts[:, ledger.column["Cl-"]]
    assert [in_a, in_b, in_c] == pytest.approx([0.7, 0.1, 0.2])


def test_a_flow_without_reaction_has_a_row_per_frame():
    """The ledger has a reaction of zinc, and no zinc; a pours into b for 100 frames after the first."""
    ledger, frames = ledger_of_salt_water([ZINC]), np.arange(1, 101)
    ledger.flow(frames, frames * 0.01, [("a", "b")], np.full((100, 1), 0.1), np.zeros(1, dtype=bool))
    assert len(ledger.history("b").times) == 1 + 100


def test_a_pour_leaves_the_heat_of_the_glass_behind():
    """Half of 10 mL with a mol of chloride, 10 K above the room, goes from glass a to c: 0.5 mol and 5 x 4.18 x 10 J.

    The glass, of 41.8 J/K, keeps its own heat.
    """
    warmth = Warmth(per_ml=4.18, glass={"a": 41.8}, excess={"a": 10.0}, loss=0.0, most=np.inf, room=20.0)
    ledger, c = ledger_of_salt_water(warmth=warmth), 2
    step(ledger, frame=1, time=0.01, moves=[("a", "c", 5.0)])
    assert ledger.amounts[c, ledger.column["Cl-"]] == pytest.approx(0.5)
    assert ledger.amounts[c, ledger.column[HEAT_COLUMN]] == pytest.approx(5.0 * 4.18 * 10.0)


@pytest.mark.parametrize(
    ("excess_k", "warmer_k", "latent_k"),
    [(100.0, 80.0, 20.0), (-30.0, -20.0, -10.0)],
    ids=["20 K beyond boiling", "10 K beyond freezing"],
)
def test_liquid_stays_between_freezing_and_boiling(excess_k, warmer_k, latent_k):
    """A millilitre of water, 4.18 J/K, would be ``excess_k`` above a room of 20 degC; it is poured out in two frames.

    It boils at 80 K above the room and freezes at 20 K below; heat beyond that makes steam or ice (``latent_k``).
    """
    warmth = Warmth(per_ml=4.18, glass={}, excess={"b": excess_k}, loss=0.0, most=80.0, room=20.0)
    ledger, c = ledger_of_salt_water(warmth=warmth), 2
    for frame in (1, 2):
        step(ledger, frame, time=0.01 * frame, moves=[("b", "c", 0.5)])
    assert ledger.amounts[c, ledger.column[HEAT_COLUMN]] == pytest.approx(4.18 * warmer_k)
    assert ledger.amounts[c, ledger.column[LATENT_HEAT_COLUMN]] == pytest.approx(4.18 * latent_k)


def test_reaction_heat_counts_where_known_and_followed():
    """``joule``: that a mol of magnesium takes up in acid, NaN if not known, below 0 as it gives heat off.

    ``warmth``: settings of an effect heat, or that none follows the temperature; ``expected``: joule that the ledger
    counts for a mol.
    """
    for case, (warmth, joule, expected) in {
        "no heat effect": (UNFOLLOWED_WARMTH, -466.9e3, 0.0),
        "known": (Warmth(per_ml=4.18, glass={}, excess={}, loss=0.0, most=np.inf), -466.9e3, -466.9e3),
        "unknown": (Warmth(per_ml=4.18, glass={}, excess={}, loss=0.0, most=np.inf), np.nan, 0.0),
    }.items():
        process = replace(MAGNESIUM, joule=joule)
        assert Ledger("a", ["Cl-"], [process], solver=None, warmth=warmth).reactions.process_joule(0) == expected, case


def test_an_equilibrium_goes_on_while_another_equation_takes_its_product():
    """Made-up equations: Cl- -> Br- has a constant of 1, so it stops at even amounts; Br- -> I- runs to its end.

    Each round halves the chloride that is left; in the end all of the mol is iodide, by a mol of either equation.
    """
    to_bromide = Process("", {"Cl-": -1.0, "Br-": 1.0}, log_k=0.0)
    to_iodide = Process("", {"Br-": -1.0, "I-": 1.0})
    ledger = Ledger("a", ["Cl-", "Br-", "I-"], [to_bromide, to_iodide], solver=None)
    amounts = np.zeros((1, len(ledger.columns)))
    amounts[0, ledger.column["Cl-"]] = 1.0
    amounts[0, ledger.column[WATER]] = 55.5  # a kilogram
    assert ledger.reactions.run_processes(amounts)[0] == pytest.approx([1.0, 1.0], abs=1e-5)
    assert amounts[0, ledger.column["I-"]] == pytest.approx(1.0, abs=1e-5)


@pytest.mark.parametrize(
    ("rate_per_s", "silver_chloride"), [(None, 1.0), (0.1, 0.0)], ids=["dissolves at once", "dissolves at a rate"]
)
def test_solid_dissolving_at_a_rate_feeds_no_equation_at_once(rate_per_s, silver_chloride):
    """A mol of solid NaCl lies in a litre with a mol of Ag+, which takes chloride as soon as some is dissolved.

    ``silver_chloride``: mol of AgCl before any time has passed.
    """
    salt = salt_of("NaCl", solubility_of("NaCl"))
    to_chloride = Process("", {"Ag+": -1.0, "Cl-": -1.0, "AgCl(s)": 1.0})
    dissolving = Process("", {"NaCl(s)": -1.0, "Na+": 1.0, "Cl-": 1.0}, rate_per_s, salt=salt)
    processes = [to_chloride] if rate_per_s is None else [to_chloride, dissolving]
    ledger = Ledger("a", ["Ag+"], processes, None, [salt])
    ledger.fill("a", 1000.0, {"NaCl(s)": 1.0, "Ag+": 1.0, WATER: 55.5})
    amounts, _extents = ledger.reactions.react(ledger.amounts[:1], np.array([25.0]))
    assert amounts[0, ledger.column["AgCl(s)"]] == pytest.approx(silver_chloride)
    assert amounts[0, ledger.column["NaCl(s)"]] == pytest.approx(1.0 - silver_chloride)


def test_traces_beside_much_solid_keep_their_digits():
    """A mol of barium with 1.5 mol of sulfate in a litre leaves 0.04 umol of it dissolved, by PHREEQC.

    The ledger has that to 12 digits; a difference of two mol would have 9.
    """
    ions = {"Ba^2+": 1.0, "SO4^2-": 1.5, "Na+": 3.0, "Cl-": 2.0}
    solver = solver_of([*ions], solids=["BaSO4"])
    ledger = Ledger("a", [*ions], [], solver)
    ledger.fill("a", 1000.0, {**ions, WATER: 55.5})
    amounts, _extents = ledger.reactions.react(ledger.amounts[:1], np.array([25.0]))
    totals = np.array([[ions.get(name, 0.0) for name in solver.mixture.components]])
    species = solver.equilibrium(totals, np.array([55.5]), np.array([25.0])).species
    dissolved_mol = (species @ solver.mixture.powers)[0, solver.mixture.components.index("Ba^2+")]
    assert 0.0 < dissolved_mol < 1e-7
    assert amounts[0, ledger.column["Ba^2+"]] == pytest.approx(dissolved_mol, rel=1e-12, abs=0.0)
