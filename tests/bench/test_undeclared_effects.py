"""An undeclared effect takes no time: interleaved runs with it installed and without, an interval of the ratio."""

from time import perf_counter

import numpy as np
import pytest
from effect_proofs import NEAR, small_session

from replay.effects import EFFECTS
from replay.engine import compute

pytestmark = pytest.mark.bench

ROUNDS = 200
BOUND = 1.02


def test_the_ratio_of_times_with_the_others_undeclared_and_removed_holds_one(monkeypatch):
    session, whole = small_session(NEAR), dict(EFFECTS)
    alone = {NEAR.kind: whole[NEAR.kind]}
    times = {"undeclared": [], "removed": []}
    rng = np.random.default_rng(0)
    for _ in range(ROUNDS + 5):
        tables = [("undeclared", whole), ("removed", alone)]
        for name, table in [tables[k] for k in rng.permutation(2)]:
            EFFECTS.clear()
            EFFECTS.update(table)
            start = perf_counter()
            compute(session)
            times[name].append(perf_counter() - start)
    EFFECTS.clear()
    EFFECTS.update(whole)
    a, b = (np.array(times[name][5:]) for name in ("undeclared", "removed"))
    picks = rng.integers(0, ROUNDS, (2000, ROUNDS))
    ratios = np.median(a[picks], axis=1) / np.median(b[picks], axis=1)
    low, high = np.quantile(ratios, [0.025, 0.975])
    print(f"undeclared / removed: {np.median(a) / np.median(b):.4f} [{low:.4f}, {high:.4f}]")
    assert low <= 1.0 <= high + 0.005 and high < BOUND
