"""Iodine and iodide bind each other as triiodide."""

import numpy as np
import pytest

from replay.effects.chemistry.iodine import TRIIODIDE_CONSTANT, free_iodine


@pytest.mark.parametrize(("iodine", "iodide"), [(0.01, 0.2), (0.2, 0.01), (0.05, 0.05), (0.0, 0.1)])
def test_triiodide_takes_iodine_and_iodide_by_its_constant(iodine, iodide):
    """In mol/kg: bound by free iodine and free iodide is the constant; the amounts are those in half a kilogram."""
    kilograms = np.array([0.5])
    free = free_iodine({"I2": 0, "I-": 1}, np.array([[iodine, iodide]]) * 0.5, kilograms)
    bound = iodine - free["I2"][0]
    assert bound == pytest.approx(iodide - free["I-"][0]) and free["I2"][0] >= 0.0 and free["I-"][0] >= 0.0
    assert bound == pytest.approx(TRIIODIDE_CONSTANT * free["I2"][0] * free["I-"][0])


def test_without_iodide_all_iodine_is_free():
    free = free_iodine({"I2": 0}, np.array([[0.2]]), np.array([2.0]))
    assert free["I2"].tolist() == [0.1] and free["I-"].tolist() == [0.0]
