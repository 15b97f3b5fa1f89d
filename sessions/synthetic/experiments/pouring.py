"""Liquid that leaves a vessel, in closed form: a cylinder tilted about its lip, a burette through its stopcock."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from sessions.geometry.profile import solved
from sessions.synthetic.paths import minimum_jerk

# Standard gravity, m/s2 (CGPM 1901).
GRAVITY = 9.80665

# Below this angle the closed form loses its digits to cancellation (it is of order phi^5); the series is exact to 1e-14
# there with five terms.
SERIES_BELOW = 0.1


def kept_volume(tilt: float, radius: float, height: float) -> float:
    """Volume in m3 that a full cylinder of inner ``radius`` and ``height`` keeps when tilted, quasi-statically.

    ``tilt`` is in radians from upright, 0 to pi.

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

    ValueError where the vessel does not hold as much.
    """
    if not 0.0 <= volume <= math.pi * radius**2 * height:
        raise ValueError(f"a vessel of {math.pi * radius**2 * height * 1e6:.1f} mL cannot keep {volume * 1e6:.1f} mL")
    return solved(lambda tilt: volume - kept_volume(tilt, radius, height), 0.0, math.pi / 2.0)


@dataclass(frozen=True)
class Turn:
    """The stopcock's angle goes from ``start_angle`` to ``end_angle`` (radians) as a minimum-jerk reach."""

    start: float
    end: float
    start_angle: float
    end_angle: float

    def angle(self, time: float) -> float:
        """Angle at a time."""
        share = float(minimum_jerk((time - self.start) / (self.end - self.start)))
        return self.start_angle + (self.end_angle - self.start_angle) * share

    def swept(self, time: float) -> float:
        """Integral of the angle over time from ``start`` to ``time`` (held inside the turn), radian seconds."""
        length = self.end - self.start
        u = min(max((time - self.start) / length, 0.0), 1.0)
        eased = u**4 * (2.5 + u * (u - 3.0))
        return length * (self.start_angle * u + (self.end_angle - self.start_angle) * eased)


@dataclass(frozen=True)
class Outlet:
    """A burette running out through a stopcock.

    Torricelli: dV/dt = c A sqrt(2 g h), with the open area A proportional to the angle and the level h above the tip
    falling by dV / S. Then sqrt(h) = sqrt(h0) - sqrt(g / 2) c / S times the integral of A.
    """

    full_area: float
    """Open area at a quarter turn, m2."""
    discharge: float
    """c, without unit."""
    section: float
    """S, inner cross-section of the column, m2."""
    head: float
    """h0, level over the tip at time 0, metres."""
    turns: Sequence[Turn]
    """In order of time, none overlapping."""

    def opened(self, time: float) -> float:
        """Integral of the open area from 0 to ``time``, m2 s."""
        total, rest_from, angle = 0.0, 0.0, 0.0
        for turn in self.turns:
            if time <= turn.start:
                break
            total += angle * (turn.start - rest_from) + turn.swept(time)
            rest_from, angle = turn.end, turn.end_angle
        total += angle * max(0.0, time - rest_from)
        return total * self.full_area / (math.pi / 2.0)

    def volume(self, time: float) -> float:
        """Volume delivered by a time, m3."""
        fall = math.sqrt(GRAVITY / 2.0) * self.discharge / self.section * self.opened(time)
        full = math.sqrt(self.head)
        # h0 - (sqrt(h0) - fall)^2, without the difference of two nearly equal numbers.
        return self.section * self.head if fall >= full else self.section * fall * (2.0 * full - fall)

    def time_of(self, volume: float, latest: float) -> float:
        """First time by which ``volume`` m3 is delivered; ValueError where that is not by ``latest``."""
        if self.volume(latest) < volume:
            raise ValueError(f"{self.volume(latest) * 1e6:.3f} mL by {latest} s, not {volume * 1e6:.3f}; open it more")
        return solved(lambda time: self.volume(time) - volume, 0.0, latest)


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
