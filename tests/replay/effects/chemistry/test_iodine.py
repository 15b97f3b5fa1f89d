"""Iodine and iodide bind each other as triiodide."""

import numpy as np
import pytest

from replay.effects.chemistry.iodine import TRIIODIDE_CONSTANT, free_iodine


def test_triiodide_takes_iodine_and_iodide_by_its_constant():
    """``iodine``, ``iodide``: mol/kg in all; ``free_iodine`` gets the mol of both in half a kilogram of water.

    A triiodide binds an iodine and an iodide: the same mol/kg of both are bound, the constant times both free ones.
    """
    for iodine, iodide in [(0.01, 0.2), (0.2, 0.01), (0.05, 0.05), (0.0, 0.1)]:
        kilograms = np.array([0.5])
        free = free_iodine(
            column={"I2": 0, "I-": 1}, amounts=np.array([[iodine, iodide]]) * kilograms, kilograms=kilograms
        )
        (free_iodine_kg,), (free_iodide_kg,) = free["I2"], free["I-"]
        bound = iodine - free_iodine_kg
        assert free_iodine_kg >= 0.0 and free_iodide_kg >= 0.0, (iodine, iodide)
        assert bound == pytest.approx(iodide - free_iodide_kg), (iodine, iodide)
        assert bound == pytest.approx(TRIIODIDE_CONSTANT * free_iodine_kg * free_iodide_kg), (iodine, iodide)


def test_without_iodide_all_iodine_is_free():
    """0.2 mol of iodine, the only column, in 2 kg of water: 0.1 mol/kg is free, and of iodide none."""
    free = free_iodine(column={"I2": 0}, amounts=np.array([[0.2]]), kilograms=np.array([2.0]))
    assert free["I2"].tolist() == [0.1] and free["I-"].tolist() == [0.0]
