"""Iodine and iodide that are not triiodide, which the ledger counts as both."""

from collections.abc import Mapping
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray

TRIIODIDE_CONSTANT: Final = 698.0
"""Constant of I2 + I- = I3- at 25 degC. Source: D. A. Palmer et al., J. Solution Chem. 13, 1984."""

IODINE, IODIDE = "I2", "I-"


def free_iodine(column: Mapping[str, int], amounts: FloatArray, kilograms: FloatArray) -> dict[str, FloatArray]:
    """mol/kg (n,) of iodine and of iodide that are not triiodide; ``amounts`` (n, columns) in mol."""
    iodine, iodide = (
        amounts[:, column[name]] / kilograms if name in column else np.zeros(len(amounts)) for name in (IODINE, IODIDE)
    )
    summed_molal = iodine + iodide + 1.0 / TRIIODIDE_CONSTANT
    # The smaller root of the quadratic, in the form without a difference of like numbers.
    triiodide = 2.0 * iodine * iodide / (summed_molal + np.sqrt(summed_molal**2 - 4.0 * iodine * iodide))
    return {IODINE: iodine - triiodide, IODIDE: iodide - triiodide}
