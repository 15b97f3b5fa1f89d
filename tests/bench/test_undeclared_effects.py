"""An undeclared effect takes no time: interleaved runs with it installed and without, an interval of the ratio."""

from time import process_time

import numpy as np
import pytest
from support.liquid_worlds import HAND_NEAR_LAMP, small_session

from replay.effects import EFFECTS
from replay.engine import compute

pytestmark = pytest.mark.bench

ROUNDS, WARM_ROUNDS = 600, 5
"""Rounds that count, after some that warm up."""
BOUND = 1.02
"""Of the upper end of the interval: 2 % more time."""


def test_undeclared_effects_cost_as_little_as_removed_effects(monkeypatch):
    """A scene declares one effect; 600 runs with all effects installed, and with that one alone, in random order.

    The median ratio of their processor times has a bootstrap interval of 95 %, which begins at 1 or less and ends below
    1.02 (BOUND).
    """
    session, installed = small_session(HAND_NEAR_LAMP), dict(EFFECTS)
    declared = {HAND_NEAR_LAMP.kind: installed[HAND_NEAR_LAMP.kind]}
    times = {"undeclared": [], "removed": []}
    rng = np.random.default_rng(0)
    for _ in range(ROUNDS + WARM_ROUNDS):
        tables = [("undeclared", installed), ("removed", declared)]
        for name, table in [tables[k] for k in rng.permutation(2)]:
            EFFECTS.clear()
            EFFECTS.update(table)
            start = process_time()
            compute(session)
            times[name].append(process_time() - start)
    EFFECTS.clear()
    EFFECTS.update(installed)
    # Both runs of a round meet the same load: their ratio is steadier than the ratio of two medians.
    ratio = np.array(times["undeclared"][WARM_ROUNDS:]) / np.array(times["removed"][WARM_ROUNDS:])
    medians = np.median(ratio[rng.integers(0, ROUNDS, (2000, ROUNDS))], axis=1)
    lower, upper = np.quantile(medians, [0.025, 0.975])
    print(f"undeclared / removed: {np.median(ratio):.4f} [{lower:.4f}, {upper:.4f}]")
    assert lower <= 1.0 and upper < BOUND
