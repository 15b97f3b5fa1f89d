"""Liquid running out of a burette whose stopcock is turned as minimum-jerk reaches: volume over time, closed form."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from sessions.glassware.profile import solved
from sessions.synthetic.easing import minimum_jerk

# Standard gravity, m/s2 (CGPM 1901).
GRAVITY = 9.80665


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

    Parameters
    ----------
    full_area : open area at a quarter turn, m2.
    discharge : c, without unit.
    section : S, inner cross-section of the column, m2.
    head : h0, level over the tip at time 0, metres.
    turns : in order of time, none overlapping.
    """

    full_area: float
    discharge: float
    section: float
    head: float
    turns: Sequence[Turn]

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
        """First time by which ``volume`` m3 is delivered, at most ``latest``.

        Raises
        ------
        ValueError
            It is not delivered by then.
        """
        if self.volume(latest) < volume:
            raise ValueError(f"{self.volume(latest) * 1e6:.3f} mL by {latest} s, not {volume * 1e6:.3f}; open it more")
        return solved(lambda time: self.volume(time) - volume, 0.0, latest)
