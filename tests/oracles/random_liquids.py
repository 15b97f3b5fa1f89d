"""Random vessels, poured, dripped and reacted: matter and energy are conserved, and order and names change nothing.

``python tests/oracles/random_liquids.py --count 60`` runs so many ledgers with and without heat, and so many scenes at
9 to 1000 Hz, each with its tables and bodies in the reverse order and with other names. It prints every seed that
fails. Sums are taken by the formulas of the columns alone.
"""

import argparse
import re
import sys
from collections import Counter
from pathlib import Path
from unittest.mock import patch

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parents[2]))

from support.liquid_worlds import glass, poses_at_rest, poses_of_tilted_glass, session_with_effects
from support.small_worlds import STEP_NS

from replay.effects.chemistry import matter as matter_room
from replay.effects.chemistry.components import WATER, dissolved_components
from replay.effects.chemistry.database import database_of
from replay.effects.chemistry.formulas import atoms, charge_of
from replay.effects.chemistry.ledger import Ledger
from replay.effects.chemistry.ledger_columns import (
    ADDED_SUFFIX,
    ENERGY_COLUMNS,
    ENTHALPY_COLUMN,
    HEAT_COLUMN,
    LATENT_HEAT_COLUMN,
    UNFOLLOWED_WARMTH,
    Flame,
    Warmth,
)
from replay.effects.chemistry.mixture import Phase, mixture_of
from replay.effects.chemistry.processes import Process
from replay.effects.chemistry.salts import SOLUBILITY_G_PER_100_G, salt_of
from replay.effects.chemistry.solver import Solver
from replay.effects.effect_plan import plan
from replay.effects.effect_summary import event_lines
from replay.engine import compute
from replay.errors import PlanError
from sessions.model.scene import SceneBody

ZINC = Process("Zn + 2 H+", {"Zn(s)": -1.0, "H+": -2.0, "Zn^2+": 1.0, "H2(g)": 1.0}, 0.3, -153.89e3, 2.0)
SOLIDS = {
    "AgCl": "Cerargyrite", "AgI": "Iodyrite", "CaCO3": "Calcite", "BaSO4": "Barite", "Mg(OH)2": "Brucite",
    "Fe(OH)3": "Ferrihydrite", "Cu(OH)2": "Cu(OH)2", "FeS": "FeS(ppt)",
}  # fmt: skip
WELL_SOLUBLE = ("KNO3", "NaCl", "NH4Cl", "CuSO4", "NaOH")
SALTS = (
    "HCl", "NaOH", "AgNO3", "KI", "Na2CO3", "NaHCO3", "CaCl2", "BaCl2", "MgCl2", "FeCl3", "CuSO4", "NH3", "NH4Cl",
    "CH3COOH", "NaH2PO4", "H2SO4", "FeSO4", "HF",
)  # fmt: skip
BESIDE = re.compile(rf"{ADDED_SUFFIX}$|^({'|'.join(ENERGY_COLUMNS)})$")
WATER_MOL_ML = 0.0555
BOILS_K = 80.0
"""Above the room."""


def solver_of(columns, solids=(), gases=()):
    """PHREEQC with what may form."""
    data = database_of()
    phases = [Phase(f"{solid}(s)", dissolved_components(solid), data.phases[SOLIDS[solid]]) for solid in solids]
    phases += [Phase(f"{gas}(g)", dissolved_components(gas), data.phases[f"{gas}(g)"]) for gas in gases]
    return Solver(mixture_of(data, columns, phases))


def step(ledger, frame, time, moves):
    """Transfers of one frame, all from the state before it."""
    volumes = np.array([[volume for *_, volume in moves]])
    ledger.flow(
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
    per_ml = 4.18 if seed % 2 else None
    flames = a_flame(seed, [name for name in names if glasses[name]])
    warmth = Warmth(per_ml, glasses, starts, 0.0, BOILS_K, room=20.0, flames=flames) if warm else UNFOLLOWED_WARMTH
    crystals = [salt_of(salt, SOLUBILITY_G_PER_100_G[salt]) for salt in salts]
    ledger = Ledger(names, sorted(columns), processes, solver, crystals, float(rng.choice([0.0, 0.3, 1.0])), warmth)
    for name, (volume, present) in zip(names, fills, strict=True):
        ledger.fill(name, volume, present)
    ledger.begin(0.0)
    yield ledger
    frame = 0
    for _ in range(int(rng.integers(1, 13))):
        frame += int(rng.integers(1, 200))
        source, target = rng.choice(len(names)), rng.choice(len(names) + 1)
        pair = (names[source], [*names, ""][target])
        present = float(ledger.volume_ml[ledger.at[names[source]]]) * float(rng.choice([0.0, 1e-9, 0.3, 1.0]))
        if source == target or present <= 0.0:
            ledger.advance(ledger.at[names[source]], frame, frame * 0.01)
        elif rng.random() < 0.5:
            step(ledger, frame, frame * 0.01, [(*pair, present)])
        else:
            count = int(rng.integers(1, 50))
            frames = frame + np.arange(count)
            components = rng.dirichlet(np.ones(count)) * present
            ledger.flow(frames, frames * 0.01, [pair], components[:, None], np.zeros(1, dtype=bool))
            frame += count
        yield ledger


def a_flame(seed, names):
    """A flame under one of these vessels that is lit and put out at random; none in some worlds."""
    rng = np.random.default_rng((seed, len(names)))
    if not names or rng.random() < 0.3:
        return {}
    times = np.sort(rng.uniform(0.0, 15.0, 3))
    return {names[rng.integers(len(names))]: Flame(times, np.array([rng.uniform(5.0, 200.0), 0.0, 3.0]), 0.0)}


def flame_joule(ledger):
    """J that the flames of a ledger gave until now, and whether all of it stayed: nothing boiled."""
    given, stayed = 0.0, True
    for name, flame in ledger.warmth.flames.items():
        index = ledger.at[name]
        ends = np.minimum(np.append(flame.times[1:], np.inf), ledger.clock[index])
        given += float(flame.power_w @ np.maximum(0.0, ends - flame.times))
        excess = ledger.celsius(index, ledger.state[[index]])[0] - ledger.warmth.room
        boiled = ledger.amounts[:, ledger.column[LATENT_HEAT_COLUMN]].any() or excess > BOILS_K - 1e-6
        stayed = stayed and not boiled
    return given, stayed


def energy(ledger):
    """J of everything in a ledger."""
    return energy_of(ledger, ledger.amounts)


def energy_of(ledger, amounts):
    """J (n,) of rows of a ledger: warmth, what is dissolved, solids, and gases that left."""
    solid = np.zeros(len(amounts))
    if ledger.solver is not None:
        mixture = ledger.solver.mixture
        solid += amounts[:, ledger.reactions.phases] @ mixture.joule[len(mixture.species) :]
    solid += amounts[:, ledger.reactions.salt_columns] @ np.array([salt.joule for salt in ledger.salts])
    return (
        amounts[:, [ledger.column[name] for name in (HEAT_COLUMN, ENTHALPY_COLUMN, LATENT_HEAT_COLUMN)]].sum(axis=1)
        + solid
    )


def assert_matter_and_energy_kept(seed, warm):
    """Fails unless every event of a world keeps elements, charge and volume, and with ``warm`` also energy."""
    first, given, stays = None, 0.0, True
    for ledger in a_world(seed, warm):
        components = makeup(ledger.columns)
        now = ledger.amounts @ components
        sums, scale = now.sum(axis=0), (np.abs(ledger.amounts) @ np.abs(components)).sum(axis=0)
        volume = ledger.volume_ml.sum()
        if first is None:
            first, start = (sums, volume), energy(ledger).sum() if warm else 0.0
            before = ledger.extents.sum()
        assert np.all(np.abs(sums - first[0]) <= 1e-12 * scale), seed
        assert abs(volume - first[1]) <= 1e-12 * max(volume, 1e-300), seed
        assert (ledger.volume_ml >= 0.0).all(), seed
        if warm:
            given = -ZINC.joule * (ledger.extents.sum() - before) if len(ledger.processes) else 0.0
            exchanged = np.abs(
                ledger.amounts[
                    :, [ledger.column[HEAT_COLUMN], ledger.column[ENTHALPY_COLUMN], ledger.column[LATENT_HEAT_COLUMN]]
                ]
            ).sum() + abs(given)
            heated, stayed = flame_joule(ledger)
            stays = stays and stayed
            surplus = energy(ledger).sum() - start - given
            # Steam takes along what a flame gives to what boils.
            assert surplus <= heated + 1e-9 * (exchanged + heated), seed
            assert not stays or surplus >= heated - 1e-9 * (exchanged + heated), seed
    for history in map(ledger.history, ledger.vessels):
        assert (np.diff(history.times)[np.diff(history.frames) >= 0] > 0.0).all(), seed


# ---- Scenes: poured from glass to glass at any rate


SECONDS = 2.0
MOST_ATTEMPTS = 50
SCENE_SALTS = ("HCl", "NaOH", "NaCl", "AgNO3", "KI", "Na2CO3", "NaHCO3", "BaCl2", "Na2SO4", "NH3", "CH3COOH", "FeSO4")
SCENE_SOLIDS = ({}, {}, {"formula": "Zn", "mass_g": 0.3}, {"formula": "CaCO3", "mass_g": 0.5},
                {"formula": "NaCl", "mass_g": 5.0})  # fmt: skip
EQUATIONS = (
    {"equation": "H+ + OH- -> H2O"},
    {"equation": "Ag+ + Cl- -> AgCl(s)"},
    {"equation": "Ba2+ + SO42- -> BaSO4(s)"},
    {"equation": "NaHCO3 + HCl -> NaCl + H2O + CO2"},
    {"equation": "Na2CO3 + 2 HCl -> 2 NaCl + H2O + CO2"},
    {"equation": "NH3 + HCl -> NH4Cl"},
    {"equation": "Zn + 2 HCl -> ZnCl2 + H2", "rate_per_s": 0.8},
    {"equation": "CaCO3 + 2 HCl -> CaCl2 + H2O + CO2", "rate_per_s": 2.0},
    {"equation": "CaCO3 + 2 HCl -> CaCl2 + H2O + CO2"},
    {"equation": "CH3COOH + NaOH -> CH3COONa + H2O"},
)
HEAT_TABLE = {"of": "liquids", "ambient_c": 20.0, "loss_w_per_k": 0.0}


def a_scene(seed, attempt):
    """Poses, bodies, tables of effects and frames a second of a random scene; it may be one that the plan refuses."""
    rng = np.random.default_rng((seed, attempt))
    hz = float(np.exp(rng.uniform(np.log(9.0), np.log(1000.0))))
    times = np.arange(int(SECONDS * hz)) / hz
    names = ["a", "b", "c"]

    def ramp(height):
        """A glass that is tilted for a while."""
        start, stop = np.sort(rng.uniform(0.1, 0.9 * SECONDS, 2))
        return poses_of_tilted_glass(
            np.interp(times, [start, stop], [0.0, rng.uniform(60.0, 110.0)]), (0.0, height, 0.0)
        )

    chain = rng.random() < 0.5
    below = np.array([0.0, -0.2, 0.0])
    poses = {"a": ramp(0.2), "b": poses_at_rest(len(times)), "c": ramp(0.2)}
    if chain:
        poses = {"a": ramp(0.2), "b": ramp(0.0), "c": poses_at_rest(len(times), below)}
    bodies = []
    for name in names:
        solutes = {str(salt): float(10.0 ** rng.uniform(-3.0, -0.3)) for salt in rng.choice(SCENE_SALTS, 2, False)}
        solid = SCENE_SOLIDS[rng.integers(len(SCENE_SOLIDS))]
        bodies.append(
            glass(name, float(rng.uniform(1.0, 50.0)), solutes=solutes, properties=solid and {"solid": solid})
        )
    flow = {"from": ["a", "b"], "into": ["b", "c"]} if chain else {"from": ["a", "c"], "into": ["b"]}
    equations = rng.choice(len(EQUATIONS), int(rng.integers(1, 3)), replace=False)
    tables = [("pour", flow), ("mixing", {"in": names}), *(("reaction", EQUATIONS[k]) for k in equations.tolist())]
    if rng.random() < 0.5:
        declared = {} if rng.random() < 0.5 else {"heat_capacity_j_per_ml_k": 4.18}
        tables.append(("heat", {**HEAT_TABLE, **declared}))
    return poses, bodies, tables, hz


def first_and_last(matter):
    """Amounts of every vessel at first (vessels, columns) and of everything, outside too, at last (places, columns)."""
    first = np.array([matter.histories[name].amounts[0] for name in matter.ledger.vessels])
    return first, matter.ledger.amounts


def planned_scene(seed):
    """The first random scene of a seed that the plan takes: equations need their reagents."""
    for attempt in range(MOST_ATTEMPTS):
        scene = a_scene(seed, attempt)
        poses, bodies, tables, _ = scene
        try:
            plan(session_with_effects({name: poses_at_rest(2) for name in poses}, bodies, *tables).scene)
        except PlanError:
            continue
        return scene
    raise AssertionError(f"{seed}: no scene of {MOST_ATTEMPTS} is taken")


def check_scene(seed):
    """Check that a scene conserves what it holds, and that order and names change nothing."""
    poses, bodies, tables, hz = planned_scene(seed)
    ledgers = []

    def kept(inputs, make=matter_room.new_matter):
        ledgers.append(make(inputs))
        return ledgers[-1]

    def make():
        return poses, bodies, tables

    step_ns = round(1e9 / hz)
    with patch.object(matter_room, "new_matter", kept):
        whole = printed(make, step_ns=step_ns)
    check_sums(ledgers[0], seed)
    assert printed(make, lambda rows: rows[::-1], step_ns=step_ns) == whole, seed
    names = {name: f"z{9 - k}" for k, name in enumerate(poses)}
    back = {new: name for name, new in names.items()}
    lines, *others = printed(
        make, names=names, back=lambda text: re.sub(r"z\d", lambda item: back[item.group()], text), step_ns=step_ns
    )
    assert sorted(lines) == sorted(whole[0]) and others == [*whole[1:]], seed


def check_sums(matter, seed):
    """Elements, charge, volume and energy of a run from its first moment to its end."""
    ledger = matter.ledger
    first, last = first_and_last(matter)
    components = makeup(ledger.columns)
    scale = (np.abs(last) @ np.abs(components)).sum(axis=0)
    assert np.all(np.abs((last @ components).sum(axis=0) - (first @ components).sum(axis=0)) <= 1e-12 * scale), seed
    poured = sum(history.volume_ml[0] for history in matter.histories.values())
    assert abs(ledger.volume_ml.sum() - poured) <= 1e-12 * poured, seed
    if not ledger.warmth.followed:
        return
    given = 0.0
    for row, process in enumerate(ledger.processes):
        begun = sum(history.extents[0, row] for history in matter.histories.values())
        given -= (ledger.extents[:, row].sum() - begun) * (process.joule if np.isfinite(process.joule) else 0.0)
    exchanged = np.abs(
        last[:, [ledger.column[name] for name in (HEAT_COLUMN, ENTHALPY_COLUMN, LATENT_HEAT_COLUMN)]]
    ).sum() + abs(given)
    kept = energy_of(ledger, last).sum() - energy_of(ledger, first).sum()
    assert abs(kept - given) <= 1e-9 * max(exchanged, 1.0), seed


def called(value, names):
    """Settings with other names of bodies."""
    if isinstance(value, list):
        return [called(item, names) for item in value]
    if isinstance(value, dict):
        return {key: called(item, names) for key, item in value.items()}
    return names.get(value, value) if isinstance(value, str) else value


def printed(make, order=lambda rows: rows, names=None, back=lambda text: text, step_ns=STEP_NS):
    """Every line of the terminal, the figures of the summary and every row of the tables, as names of the first."""
    poses, bodies, tables = make()
    names = names or {}
    poses = {names.get(name, name): poses[name] for name in order(list(poses))}
    bodies = [SceneBody(names.get(item.id, item.id), extra=item.extra) for item in order(list(bodies))]
    tables = [(kind, called(settings, names)) for kind, settings in order(list(tables))]
    result = compute(session_with_effects(poses, bodies, *tables, step_ns=step_ns), detectors=())
    figures = {
        kind: {key: getattr(record, key) for key in ("about", "because", "events", "frames", "frames_run", "sources")}
        for kind, record in result.document.effects.items()
    }
    rows, spans = {}, []
    for kind, run in result.effects.items():
        lanes = ((name, span) for name, lane in run.output.lanes.items() for span in lane)
        spans += [f"{kind} {name} {span.start:.2f} to {span.end:.2f} s: {span.word}" for name, span in lanes]
        for name, series in run.series.items():
            scale = np.nanmax(np.abs(series.values), initial=1e-12)
            digits = [f"{value:.8f}" for value in np.round(series.values / scale, 8) + 0.0]
            rows[kind, back(name)] = (np.round(series.times, 9).tolist(), f"{scale:.9g}", digits)
        for name, liquid in run.output.liquids.items():
            rows[kind, back(name), "drawn"] = (np.round(liquid.level, 12).tolist(), liquid.rgba.tolist())
    return [back(line) for line in (*event_lines(result.effects, 999), *sorted(spans))], figures, rows


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--first", type=int, default=0)
    options.add_argument("--count", type=int, default=60)
    chosen = options.parse_args()
    failed = []
    for seed in range(chosen.first, chosen.first + chosen.count):
        for what, check in (
            ("warm ledger", lambda seed: assert_matter_and_energy_kept(seed, warm=True)),
            ("ledger", lambda seed: assert_matter_and_energy_kept(seed, warm=False)),
            ("scene", check_scene),
        ):
            try:
                check(seed)
            except AssertionError as error:
                failed.append((what, seed))
                print(f"{what} {seed}: {str(error)[:300]}", flush=True)
    print(f"{chosen.count} seeds, {len(failed)} failed")
