"""How much a tilted cylindrical vessel keeps: right to 1e-9 relative and never rising, up to 90 - 1e-9 degrees."""

import math
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray

SERIES_BELOW: Final = 0.1
"""Half angle below which sin - sin^3/3 - phi cos is summed as a series: it is of order phi^5 while its terms are of
order phi, so at 0.1 the closed form has lost four digits and at 0.001 all of them. Measured with the printed form
``(2/3)(R^2 - k^2)^1.5 - k (...)``: 21 % wrong at 89.9999 degrees."""

TERMS: Final = 8
"""Terms of the series; the first left out is below 1e-16 of the sum at ``SERIES_BELOW``."""


def volume_kept(tilt: FloatArray, radius: float, height: float) -> FloatArray:
    """Volume (n,) that an overfull cylinder keeps when it is tilted slowly; the unit is that of the sizes, cubed.

    ``tilt``: (n,) radians from upright, 0 to pi; from a right angle on nothing is kept.
    ``radius``, ``height``: inner sizes, from the floor to the lip; above 0.

    Source: a cylinder cut by a horizontal plane through its lip. While the plane does not meet the floor the volume is
    pi R^2 (H - R tan); beyond, with phi = 2 asin sqrt(H / (2 R tan)) the half angle of the wetted part of the floor,
    R^3 tan (sin phi - sin^3 phi / 3 - phi cos phi).
    """
    slope = np.tan(np.clip(tilt, 0.0, 0.5 * math.pi))
    steep = 2.0 * radius * slope > height
    phi = 2.0 * np.arcsin(np.sqrt(height / np.where(steep, 2.0 * radius * slope, height)))
    kept = np.where(steep, radius**3 * slope * _wedge(phi), math.pi * radius**2 * (height - radius * slope))
    return np.asarray(np.where(tilt >= 0.5 * math.pi, 0.0, kept))


def _wedge(phi: FloatArray) -> FloatArray:
    sine = np.sin(phi)
    # With sin^3 = (3 sin - sin 3x) / 4 the coefficient of phi^(2k+1) is
    # (-1)^k ((9 + 3^(2k+1)) / 12 / (2k+1)! - 1 / (2k)!), which is 0 for k = 0 and 1 and 2/15 for k = 2.
    total, square = np.zeros_like(phi), phi * phi
    for k in range(TERMS + 1, 1, -1):
        odd = 2 * k + 1
        term = (9.0 + 3.0**odd) / 12.0 / math.factorial(odd) - 1.0 / math.factorial(2 * k)
        total = total * square + (-1.0) ** k * term
    return np.asarray(np.where(phi >= SERIES_BELOW, sine - sine**3 / 3.0 - phi * np.cos(phi), total * phi**5))
