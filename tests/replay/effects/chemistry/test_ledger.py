"""Matter and energy are neither made nor lost, whatever is poured, spilled, dripped and reacted, in whatever order."""

import re
from collections import Counter

import numpy as np
import pytest

from replay.effects.chemistry.components import WATER, dissolved_components
from replay.effects.chemistry.database import database_of
from replay.effects.chemistry.formulas import atoms, charge_of
from replay.effects.chemistry.ledger import Ledger
from replay.effects.chemistry.ledger_columns import ADDED, HEAT, LATENT, NO_MATTER, STORED, UNFOLLOWED, Warmth
from replay.effects.chemistry.mixture import Phase, mixture_of
from replay.effects.chemistry.processes import Process
from replay.effects.chemistry.salts import SOLUBILITY, salt_of
from replay.effects.chemistry.solver import Solver

pytestmark = pytest.mark.filterwarnings("error::RuntimeWarning")

ZINC = Process("Zn + 2 H+", {"Zn(s)": -1.0, "H+": -2.0, "Zn^2+": 1.0, "H2(g)": 1.0}, 0.3, -153.89e3, 2.0)
MAGNESIUM = Process("Mg + 2 H+", {"Mg(s)": -1.0, "H+": -2.0, "Mg^2+": 1.0, "H2(g)": 1.0}, 0.9, -466.9e3, 2.0)
SOLIDS = {
    "AgCl": "Cerargyrite", "AgI": "Iodyrite", "CaCO3": "Calcite", "BaSO4": "Barite", "Mg(OH)2": "Brucite",
    "Fe(OH)3": "Ferrihydrite", "Cu(OH)2": "Cu(OH)2", "FeS": "FeS(ppt)",
}  # fmt: skip
WELL_SOLUBLE = ("KNO3", "NaCl", "NH4Cl", "CuSO4", "NaOH")
SALTS = (
    "HCl", "NaOH", "AgNO3", "KI", "Na2CO3", "NaHCO3", "CaCl2", "BaCl2", "MgCl2", "FeCl3", "CuSO4", "NH3", "NH4Cl",
    "CH3COOH", "NaH2PO4", "H2SO4", "FeSO4", "HF",
)  # fmt: skip
BESIDE = re.compile(rf"{ADDED}$|^({'|'.join(NO_MATTER)})$")
WATER_MOL_ML = 0.0555


def solver_of(columns, solids=(), gases=()):
    """PHREEQC with what may form."""
    data = database_of()
    phases = [Phase(f"{solid}(s)", dissolved_components(solid), data.phases[SOLIDS[solid]]) for solid in solids]
    phases += [Phase(f"{gas}(g)", dissolved_components(gas), data.phases[f"{gas}(g)"]) for gas in gases]
    return Solver(mixture_of(data, columns, phases))


def step(book, frame, time, moves):
    """Transfers of one frame, all from the state before it."""
    volumes = np.array([[volume for *_, volume in moves]])
    book.flow(
        np.array([frame]), np.array([time]), [(a, b) for a, b, _ in moves], volumes, np.zeros(len(moves), dtype=bool)
    )


def makeup(columns):
    """(columns, elements and charge): by the formulas alone."""
    rows = []
    for name in columns:
        formula = "" if BESIDE.search(name) else re.sub(r"\([sg]\)$", "", name)
        rows.append(Counter(atoms(formula)) if formula else Counter())
        rows[-1]["charge"] = charge_of(formula)
    kinds = sorted({kind for row in rows for kind in row})
    return np.array([[row[kind] for kind in kinds] for row in rows], dtype=float)


def a_world(seed, warm):
    """Random vessels, one after the other random steps and flows; the ledger after each."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(3, 7))
    names = [f"v{number}" for number in range(count)]
    solids = [str(name) for name in rng.choice([*SOLIDS], int(rng.integers(0, 4)), replace=False)]
    gases = ["CO2", "H2S"] if rng.random() < 0.5 else []
    salts = [str(name) for name in rng.choice(WELL_SOLUBLE, int(rng.integers(0, 3)), replace=False)]
    processes = [ZINC] if rng.random() < 0.4 else []
    fills, columns = [], {"Zn(s)", "Zn^2+", "H2(g)", "H2O", "CO3^2-"}
    for _ in names:
        litres = rng.choice([1e-6, 0.05, 2.0]) * rng.uniform(0.1, 1.0)
        present = Counter()
        for salt in rng.choice(SALTS, 2, replace=False):
            molar = 10.0 ** rng.uniform(-6.0, 0.0)
            for component, many in dissolved_components(str(salt)).items():
                present[component] += many * molar * litres
        present[WATER] += 500.0 * litres * WATER_MOL_ML
        columns |= set(present)
        for salt in salts:
            present[f"{salt}(s)"] = float(rng.choice([0.0, 1e-3, 1.0]))
        present["Zn(s)"] = float(rng.choice([0.0, 1e-3])) if processes else 0.0
        fills.append((litres * 500.0, present))
    columns |= {component for formula in (*solids, *salts) for component in dissolved_components(formula)}
    solver = solver_of(sorted(columns), solids, gases)
    glasses = {name: float(rng.choice([0.0, 30.0])) for name in names}
    starts = {name: float(rng.uniform(-10.0, 40.0)) for name in names}
    warmth = Warmth(4.18, glasses, starts, 0.0, 80.0, room=20.0) if warm else UNFOLLOWED
    crystals = [salt_of(salt, SOLUBILITY[salt]) for salt in salts]
    book = Ledger(names, sorted(columns), processes, solver, crystals, float(rng.choice([0.0, 0.3, 1.0])), warmth)
    for name, (volume, present) in zip(names, fills, strict=True):
        book.fill(name, volume, present)
    book.begin(0.0)
    yield book
    frame = 0
    for _ in range(int(rng.integers(1, 13))):
        frame += int(rng.integers(1, 200))
        source, target = rng.choice(len(names)), rng.choice(len(names) + 1)
        pair = (names[source], [*names, ""][target])
        present = float(book.volume_ml[book.at[names[source]]]) * float(rng.choice([0.0, 1e-9, 0.3, 1.0]))
        if source == target or present <= 0.0:
            book.advance(book.at[names[source]], frame, frame * 0.01)
        elif rng.random() < 0.5:
            step(book, frame, frame * 0.01, [(*pair, present)])
        else:
            count = int(rng.integers(1, 50))
            frames = frame + np.arange(count)
            components = rng.dirichlet(np.ones(count)) * present
            book.flow(frames, frames * 0.01, [pair], components[:, None], np.zeros(1, dtype=bool))
            frame += count
        yield book


def energy(book):
    """J of everything: warmth, what is dissolved, solids, gases that left, and what zinc has given off."""
    mixture = book.solver.mixture
    solid = book.amounts[:, book.phases] @ mixture.joule[len(mixture.species) :]
    solid += book.amounts[:, book.salt_columns] @ np.array([salt.joule for salt in book.salts])
    return book.amounts[:, [book.column[name] for name in (HEAT, STORED, LATENT)]].sum(axis=1) + solid


def check_conservation(seed, warm):
    first, given = None, 0.0
    for book in a_world(seed, warm):
        components = makeup(book.columns)
        now = book.amounts @ components
        sums, scale = now.sum(axis=0), (np.abs(book.amounts) @ np.abs(components)).sum(axis=0)
        volume = book.volume_ml.sum()
        if first is None:
            first, start = (sums, volume), energy(book).sum() if warm else 0.0
            before = book.extents.sum()
        assert np.all(np.abs(sums - first[0]) <= 1e-12 * scale), seed
        assert abs(volume - first[1]) <= 1e-12 * max(volume, 1e-300), seed
        assert (book.volume_ml >= 0.0).all(), seed
        if warm:
            given = -ZINC.joule * (book.extents.sum() - before) if len(book.processes) else 0.0
            exchanged = np.abs(
                book.amounts[:, [book.column[HEAT], book.column[STORED], book.column[LATENT]]]
            ).sum() + abs(given)
            assert abs(energy(book).sum() - start - given) <= 1e-9 * exchanged, seed
    for history in map(book.history, book.vessels):
        assert (np.diff(history.times)[np.diff(history.frames) >= 0] > 0.0).all(), seed


@pytest.mark.sampled(3)
@pytest.mark.parametrize("seed", [2, 0, 1, 3, 4, 5, 6, 7])
def test_elements_charge_volume_and_energy_are_conserved_after_every_event(seed):
    check_conservation(seed, warm=True)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 112))
def test_conservation_holds_with_and_without_heat_in_more_worlds(seed):
    check_conservation(seed, warm=True)
    check_conservation(seed, warm=False)


def test_an_equation_leaves_protons_of_weaker_acids():
    """At pH 7 phosphate is H2PO4- and HPO4^2- in the ratio 10^(7.2 - 7): of two protons it holds 1.62."""
    components = dissolved_components("NaH2PO4")
    book = Ledger(["a"], [*components], [ZINC], solver_of([*components, *ZINC.changes]))
    book.fill("a", 10.0, {"Zn(s)": 1.0, **components})
    volume_before = 1.0 + 1.0 / (1.0 + 10.0 ** (7.0 - 7.198))
    assert book.pending(book.amounts[0])[0] == pytest.approx((2.0 - volume_before) / 2.0, rel=1e-3)


@pytest.mark.parametrize("seconds", [0.01, 1.0, 7.0])
def test_two_slow_reactions_last_as_long_as_time_does(seconds):
    components = dissolved_components("HCl")
    book = Ledger(["a"], [*components], [ZINC, MAGNESIUM], None)
    book.fill(
        "a",
        10.0,
        {"Zn(s)": 1.0, "Mg(s)": 1.0, **{component: 10.0 * amount for component, amount in components.items()}},
    )
    book.advance(0, 1, seconds)
    left = [book.amounts[0, book.column[metal]] for metal in ("Zn(s)", "Mg(s)")]
    assert left == pytest.approx(np.exp([-0.3 * seconds, -0.9 * seconds]), rel=1e-9)
    # Of too little acid each gets by its rate, and what is left falls by the sum of both.
    scarce = Ledger(["a"], [*components], [ZINC, MAGNESIUM], None)
    scarce.fill(
        "a", 10.0, {"Zn(s)": 1.0, "Mg(s)": 1.0, **{component: 0.1 * amount for component, amount in components.items()}}
    )
    scarce.advance(0, 1, seconds)
    assert scarce.extents[0] == pytest.approx(0.05 * np.array([0.25, 0.75]) * -np.expm1(-1.2 * seconds), rel=0.02)


def plain(process=(), warmth=UNFOLLOWED):
    """Salt water in a, a millilitre of water in b, nothing in c."""
    book = Ledger("abc", ["Cl-"], process, None, warmth=warmth)
    book.fill("a", 10.0, {"Cl-": 1.0, WATER: 0.55})
    book.fill("b", 1.0, {WATER: 0.055})
    book.begin(0.0)
    return book


def test_a_vessel_in_a_chain_gives_its_former_contents():
    book, frames = plain(), np.arange(1, 4)
    book.flow(frames, frames * 0.01, [("a", "b"), ("b", "c")], np.ones((3, 2)), np.zeros(2, dtype=bool))
    assert book.amounts[:3, book.column["Cl-"]] == pytest.approx([0.7, 0.1, 0.2])


def test_a_flow_without_reaction_has_a_row_per_frame():
    book, frames = plain([ZINC]), np.arange(1, 101)
    book.flow(frames, frames * 0.01, [("a", "b")], np.full((100, 1), 0.1), np.zeros(1, dtype=bool))
    assert len(book.history("b").times) == 101


def test_a_pour_leaves_the_heat_of_the_glass_behind():
    book = plain(warmth=Warmth(4.18, {"a": 41.8}, {"a": 10.0}, 0.0, np.inf, room=20.0))
    step(book, 1, 0.01, [("a", "c", 5.0)])
    assert book.amounts[2, [book.column["Cl-"], book.column[HEAT]]] == pytest.approx([0.5, 209.0])
