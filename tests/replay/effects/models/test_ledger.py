"""Matter is neither made nor lost, whatever is poured, spilled, dripped and reacted, in whatever order."""

import re
from collections import Counter

import numpy as np
import pytest

from replay.effects.models.equation import atoms, charge_of
from replay.effects.models.history import NEUTRALISATION, Process
from replay.effects.models.ledger import BROUGHT, Ledger

PROCESSES = (
    NEUTRALISATION,
    Process("Zn + 2 H+", {"Zn(s)": -1.0, "H+": -2.0, "Zn^2+": 1.0, "H2(g)": 1.0}, rate=0.3),
    Process("carbonate", {"CO3^2-": -1.0, "H+": -2.0, "CO2(g)": 1.0, "H2O": 1.0}),
    Process("AgCl", {"Ag+": -1.0, "Cl-": -1.0, "AgCl(s)": 1.0}, product=1.77e-10),
    Process("AgI", {"Ag+": -1.0, "I-": -1.0, "AgI(s)": 1.0}, product=8.52e-17),
    Process("Ag2CrO4", {"Ag+": -2.0, "CrO4^2-": -1.0, "Ag2CrO4(s)": 1.0}, product=1.12e-12),
)
BRINGS = (
    {"H+": 1.0, "Cl-": 1.0}, {"Na+": 1.0, "OH-": 1.0}, {"Ag+": 1.0, "NO3-": 1.0}, {"K+": 1.0, "I-": 1.0},
    {"Na+": 2.0, "CO3^2-": 1.0}, {"K+": 2.0, "CrO4^2-": 1.0}, {"H2O": 55.0},
)  # fmt: skip
COLUMNS = sorted({name for one in (*BRINGS, *(process.changes for process in PROCESSES)) for name in one})


def makeup():
    """(columns, elements and charge): by the formulas alone."""
    rows = []
    for name in COLUMNS:
        formula = re.sub(r"\([sg]\)$", "", name)
        rows.append(Counter(atoms(formula)) + Counter())
        rows[-1]["charge"] = charge_of(formula)
    kinds = sorted({kind for row in rows for kind in row})
    return np.array([[row[kind] for kind in kinds] for row in rows], dtype=float)


def a_world(seed):
    """Random vessels, one after the other random steps and flows; after each the sums."""
    rng = np.random.default_rng(seed)
    names = [f"v{number}" for number in range(rng.integers(1, 7))]
    drawn = [0, *rng.choice(range(1, len(PROCESSES)), rng.integers(0, 4), replace=False).tolist()]
    book = Ledger(names, COLUMNS, [PROCESSES[row] for row in drawn], along=float(rng.choice([0.0, 0.3, 1.0])))
    for name in names:
        litres = rng.choice([0.0, 1e-6, 0.05, 2.0]) * rng.uniform(0.1, 1.0)
        for row in rng.choice(len(BRINGS), 2, replace=False):
            molar = 10.0 ** rng.uniform(-9.0, 1.0)
            book.fill(name, litres * 500.0, {key: many * molar * litres for key, many in BRINGS[row].items()})
        book.fill(name, 0.0, {"Zn(s)": float(rng.choice([0.0, 1e-3]))})
    book.begin(0.0)
    yield book
    frame = 0
    for _ in range(rng.integers(1, 41)):
        frame += int(rng.integers(1, 200))
        source, target = rng.choice(len(names)), rng.choice(len(names) + 1)
        pair = (names[source], [*names, ""][target])
        there = float(book.volume_ml[source]) * float(rng.choice([0.0, 1e-9, 0.3, 1.0]))
        if source == target or there <= 0.0:
            book.advance(int(source), frame, frame * 0.01)
        elif rng.random() < 0.5:
            book.step(frame, frame * 0.01, [(*pair, there)])
        else:
            count = int(rng.integers(1, 150))
            frames = frame + np.arange(count)
            parts = rng.dirichlet(np.ones(count)) * there
            book.flow(frames, frames * 0.01, [pair], parts[:, None])
            frame += count
        yield book


def check(seed):
    parts = makeup()
    first = None
    for book in a_world(seed):
        now = book.amounts @ parts
        sums, scale = now.sum(axis=0), (book.amounts @ np.abs(parts)).sum(axis=0)
        volume = book.volume_ml.sum()
        if first is None:
            first = sums, volume
        assert np.all(np.abs(sums - first[0]) <= 1e-12 * scale), seed
        assert abs(volume - first[1]) <= 1e-12 * max(volume, 1e-300), seed
        assert (book.amounts >= 0.0).all() and (book.volume_ml >= 0.0).all(), seed


@pytest.mark.parametrize("seed", range(25))
def test_elements_charge_and_volume_are_conserved_after_every_event(seed):
    check(seed)


@pytest.mark.slow
def test_elements_charge_and_volume_are_conserved_in_two_thousand_worlds():
    for seed in range(2000):
        check(1000 + seed)


def test_what_is_brought_is_followed_and_never_changed():
    book = Ledger(["a", "b"], ["H+", "OH-", "H2O", "HCl" + BROUGHT], [NEUTRALISATION])
    book.fill("a", 10.0, {"H+": 1.0, "HCl" + BROUGHT: 1.0})
    book.fill("b", 10.0, {"OH-": 2.0})
    book.begin(0.0)
    book.step(1, 0.1, [("a", "b", 5.0)])
    assert book.history("b").amounts[-1].tolist() == [0.0, 1.5, 0.5, 0.5]


def test_what_two_flows_that_meet_make_react_is_booked_once():
    book = Ledger(["a", "b", "c"], ["H+", "OH-", "H2O"], [NEUTRALISATION])
    for name, there in (("a", {"H+": 1.0}), ("b", {"H+": 1.0}), ("c", {"OH-": 5.0})):
        book.fill(name, 10.0, there)
    book.begin(0.0)
    frames = np.arange(1, 101)
    book.flow(frames, frames * 0.01, [("a", "c"), ("b", "c")], np.full((100, 2), 0.05))
    assert sum(one.reacted[0] for one in book.loads) == pytest.approx(1.0, rel=1e-12)
    assert [one.before_ml for one in book.loads[:2]] == [10.0, 10.0 + book.loads[0].volume_ml]
