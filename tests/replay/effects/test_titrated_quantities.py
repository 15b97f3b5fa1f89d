"""Reagents of slow redox equations, whose potential is not known, are drawn as what is left of them."""

from types import SimpleNamespace

import numpy as np
import pytest

from replay.effects.chemistry.processes import Process
from replay.effects.titrated_quantities import titrated_quantities

COLUMNS = ("Fe^2+", "MnO4-", "H+", "H2O", "H2O2", "Zn(s)", "Cu^2+")


def drawn_amounts(changes, amounts, extents=(0.0, 1.0)):
    """Name -> values of what is drawn of a slow process; ``amounts``: formula -> mol in the flask at both times."""
    history = SimpleNamespace(times=np.array([0.0, 1.0]), extents=np.array(extents)[:, None], added_ml=np.zeros((2, 1)))
    table = np.array([amounts.get(column, (0.0, 0.0)) for column in COLUMNS]).T
    matter = SimpleNamespace(
        recipe=SimpleNamespace(processes=[Process("", changes, rate=1.0)], reagent=lambda row, column: column),
        histories={"flask": history},
        states=lambda vessel, times: (table, None, None),
        ledger=SimpleNamespace(column={column: index for index, column in enumerate(COLUMNS)}),
        solver=None,
    )
    return {name: series.values.tolist() for name, series in titrated_quantities(matter, "flask")}


IRON = {"MnO4-": -1.0, "Fe^2+": -5.0, "H+": -8.0, "H2O": 4.0}


@pytest.mark.parametrize(
    ("changes", "amounts", "extents", "expected"),
    [
        (IRON, {"Fe^2+": (0.5, 0.2), "MnO4-": (0.0, 0.1)}, (0.0, 0.1), {"flask/Fe^2+ left": [0.5, 0.2]}),
        (IRON, {"Fe^2+": (0.5, 0.5)}, (0.0, 0.0), {}),
        ({"H2O2": -2.0, "H2O": 2.0}, {"H2O2": (0.5, 0.1)}, (0.0, 0.2), {}),
        ({"Zn(s)": -1.0, "Cu^2+": -1.0}, {"Zn(s)": (0.5, 0.1), "Cu^2+": (0.4, 0.0)}, (0.0, 0.4), {}),
    ],
    ids=["iron in the flask", "did not run", "one reagent", "a solid"],
)
def test_two_dissolved_reagents_of_the_flask_are_drawn(changes, amounts, extents, expected):
    """A slow redox equation runs in a flask; ``changes``: formula -> mol made in one run of it, negative if used up.

    ``amounts``: mol in the flask at 0 and 1 s; ``extents``: mol of the equation that have run by then. Drawn is what is
    left of a dissolved reagent that was there at first, where the equation ran and its other reagent is dissolved too.
    """
    assert drawn_amounts(changes, amounts, extents) == expected
