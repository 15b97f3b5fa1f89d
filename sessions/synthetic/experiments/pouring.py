"""How much a tilted cylindrical vessel keeps, and the tilt that leaves a wanted amount in it."""

from __future__ import annotations

import math

from sessions.glassware.profile import solved

# Below this angle the closed form loses its digits to cancellation (it is of order phi^5); the series is exact to 1e-14
# there with five terms.
SERIES_BELOW = 0.1


def kept_volume(tilt: float, radius: float, height: float) -> float:
    """Volume in m3 that a full cylinder of inner ``radius`` and ``height`` keeps when tilted, quasi-statically.

    Parameters
    ----------
    tilt : radians from upright, 0 to pi.

    Source: volume of a cylinder cut by an oblique plane through the lip; phi = 2 asin sqrt(H / (2 R tan tilt)) is the
    half angle of the wetted part of the base.
    """
    if tilt >= math.pi / 2.0:
        return 0.0
    slope = math.tan(tilt)
    if slope <= height / (2.0 * radius):
        return math.pi * radius**2 * (height - radius * slope)
    phi = 2.0 * math.asin(math.sqrt(height / (2.0 * radius * slope)))
    return radius**3 * slope * _wedge(phi)


def tilt_keeping(volume: float, radius: float, height: float) -> float:
    """Tilt in radians at which the vessel keeps exactly ``volume`` m3: the onset of pouring from that fill.

    Raises
    ------
    ValueError
        The vessel does not hold as much.
    """
    if not 0.0 <= volume <= math.pi * radius**2 * height:
        raise ValueError(f"a vessel of {math.pi * radius**2 * height * 1e6:.1f} mL cannot keep {volume * 1e6:.1f} mL")
    return solved(lambda tilt: volume - kept_volume(tilt, radius, height), 0.0, math.pi / 2.0)


def _wedge(phi: float) -> float:
    """sin phi - sin^3 phi / 3 - phi cos phi, which is 2/15 phi^5 (1 - 11/42 phi^2 + ...) for small phi."""
    if phi >= SERIES_BELOW:
        sine = math.sin(phi)
        return sine - sine**3 / 3.0 - phi * math.cos(phi)
    total, square = 0.0, phi * phi
    # sin^3 = (3 sin - sin 3x) / 4, so the coefficient of phi^(2k+1) is
    # (-1)^k / (2k+1)! (3/4 + 3^(2k+1) / 12) - (-1)^k / (2k)!.
    for k in range(7, 1, -1):
        odd = 2 * k + 1
        term = (0.75 + 3.0**odd / 12.0) / math.factorial(odd) - 1.0 / math.factorial(odd - 1)
        total = total * square + (-1.0) ** k * term
    return total * phi**5
