"""The tolerances: pads that cover rounding of the reference vertices (``cdcore.poses``), limits of rotations, tau.

Every tolerance of the core has its name, its reason and its scale here or beside the algorithm it belongs to.
"""

from typing import Final

import numpy as np

EPS: Final = float(np.finfo(np.float64).eps)
"""Spacing of float64 at 1, 2^-52."""

PAD_ULPS: Final = 16.0
"""Pad of the sphere stage in eps of a body's size.

Placing a centre or a vertex rounds each coordinate by at most 4 sqrt(3) u (|p| + |t|), both bodies together by 6.9 eps
of size; a renormalised rotation, the norm and the radii add less than 8 eps. Without the pad 27 % of exactly tangent
pairs were missed at the origin and 50 % at 1 km; with it 0 of 16,000.
"""

UNDERFLOW_PAD: Final = 1e-150
"""Metres added to every pad: squares of differences below 1e-154 m underflow, and with them distances and radii."""

ORTHONORMAL_KEEP: Final = 64.0 * EPS
"""Rotations this close to orthonormal stay bit for bit as they are."""

ORTHONORMAL_REJECT: Final = 1e-3
"""Above this a matrix is not a rotation but a scale, a shear or an error."""

QUATERNION_REJECT: Final = 1e-3
"""Largest accepted distance of a quaternion's norm from 1."""

TWO_MICROMETRES: Final = 2e-6
"""Metres within which another answer is excused, called tau: float engines disagree about less than 2 micrometres, coal
decides nothing below it, and no tracker resolves a hundred times as much (VIVE: 0.14 mm frame to frame)."""

LARGEST_OF_SQUARES_M: Final = 1e150
"""Metres whose squares doubles hold; engines and searches compare squares of lengths.

At 2^600 m FCL reports contact of balls that are apart, and the convex hull of one ends the process.
"""
