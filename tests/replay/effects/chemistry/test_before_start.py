"""Contents of a vessel have reacted before the recording begins: gas that left, solids, equations."""

from types import SimpleNamespace

import numpy as np
import pytest

from replay.effects.chemistry.before_start import reacted_before


def texts_before_start(amounts, *, brought=(), extent=0.0, process=0, followed=()):
    """Texts of the events of a flask before the recording; ``amounts``: formula -> mol at its first row."""
    columns = [*amounts]
    solids = np.array([row for row, column in enumerate(columns) if column.endswith("(s)")], dtype=np.int64)
    ledger = SimpleNamespace(
        column={column: row for row, column in enumerate(columns)},
        columns=columns,
        reactions=SimpleNamespace(phases=solids, salt_columns=np.zeros(0, dtype=np.int64)),
    )
    first = np.array([[*amounts.values()], [9.0] * len(amounts)])
    history = SimpleNamespace(times=np.array([0.5, 1.0]), amounts=first, extents=np.array([[extent], [9.0]]))
    reaction = SimpleNamespace(process=process, declared={"equation": "A -> B"})
    recipe = SimpleNamespace(contents={"flask": SimpleNamespace(solids=dict(brought))}, reactions=[reaction])
    matter = SimpleNamespace(ledger=ledger, histories={"flask": history}, recipe=recipe)
    return [event.text.removesuffix(" before the recording begins") for event in reacted_before(matter, followed)]


@pytest.mark.parametrize(
    ("moles", "expected"), [(2e-3, ["2 mmol H2 have left flask as gas"]), (1e-7, [])], ids=["2 mmol", "0.1 umol"]
)
def test_gas_that_left_is_reported_from_a_bubble_on(moles, expected):
    """``moles``: of H2 that have left a flask at its first row; a bubble is 1e-6 mol."""
    assert texts_before_start({"H2(g)": moles}) == expected


def test_solid_counts_beyond_what_was_brought():
    """``moles``: of solid CaCO3, 100.09 g/mol, in a flask at its first moment, of which the scene put in ``brought``.

    The rest has fallen out before the recording, which an event says (``expected``). Less than a milligram is not
    reported, nor are solids (``followed``) that an effect precipitation reports itself.
    """
    for case, (moles, brought, followed, expected) in {
        "none brought": (2e-3, {}, (), ["0.2 g CaCO3 have fallen out in flask"]),
        "some brought": (2e-3, {"CaCO3": 1e-3}, (), ["0.1 g CaCO3 have fallen out in flask"]),
        "all brought": (2e-3, {"CaCO3": 2e-3}, (), []),
        "followed": (2e-3, {}, ("CaCO3",), []),
        "half a milligram": (5e-6, {}, (), []),
    }.items():
        assert texts_before_start({"CaCO3(s)": moles}, brought=brought, followed=followed) == expected, case


def test_equation_that_ran_before_the_start_is_reported():
    """``extent``: mol by which an equation ran until the first moment; more than 1e-6 mol are an event.

    ``process``: index of the equation among those with an extent, -1 where it has none, as PHREEQC computes it.
    """
    for case, (extent, process, events) in {
        "2 mmol": (2e-3, 0, 1),
        "0.1 umol": (1e-7, 0, 0),
        "equation without a process": (2e-3, -1, 0),
    }.items():
        assert len(texts_before_start({}, extent=extent, process=process)) == events, case
