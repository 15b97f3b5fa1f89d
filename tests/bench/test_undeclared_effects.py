"""An undeclared effect takes no time: interleaved runs with it installed and without, an interval of the ratio."""

from time import process_time

import numpy as np
import pytest
from support.liquid_worlds import HAND_NEAR_LAMP, small_session

from replay.effects import EFFECTS
from replay.engine import compute

pytestmark = pytest.mark.bench

ROUNDS = 600
BOUND = 1.02


def test_undeclared_effects_cost_as_little_as_removed_effects(monkeypatch):
    """The median ratio of processor times, with its bootstrap interval of 95 %."""
    session, whole = small_session(HAND_NEAR_LAMP), dict(EFFECTS)
    alone = {HAND_NEAR_LAMP.kind: whole[HAND_NEAR_LAMP.kind]}
    times = {"undeclared": [], "removed": []}
    rng = np.random.default_rng(0)
    for _ in range(ROUNDS + 5):
        tables = [("undeclared", whole), ("removed", alone)]
        for name, table in [tables[k] for k in rng.permutation(2)]:
            EFFECTS.clear()
            EFFECTS.update(table)
            start = process_time()
            compute(session)
            times[name].append(process_time() - start)
    EFFECTS.clear()
    EFFECTS.update(whole)
    # Both runs of a round meet the same load: their ratio is steadier than the ratio of two medians.
    ratio = np.array(times["undeclared"][5:]) / np.array(times["removed"][5:])
    medians = np.median(ratio[rng.integers(0, ROUNDS, (2000, ROUNDS))], axis=1)
    lower, upper = np.quantile(medians, [0.025, 0.975])
    print(f"undeclared / removed: {np.median(ratio):.4f} [{lower:.4f}, {upper:.4f}]")
    assert lower <= 1.0 and upper < BOUND
