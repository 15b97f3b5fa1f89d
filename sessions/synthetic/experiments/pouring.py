"""Liquid that leaves a vessel: tilted, by slices of its cavity; through a stopcock, in closed form."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from sessions.geometry.profile import solve_rising
from sessions.glassware.instrument import Cavity
from sessions.meshes.mesh_files import volume_beyond_plane
from sessions.synthetic.paths import GRAVITY, minimum_jerk

RIM_WITHIN: Final = 1e-6
"""Metres; vertices of a cavity no lower than this below its lip are its rim."""


def tilt_keeping(cavity: Cavity, millilitres: float) -> float:
    """Tilt in radians towards +X at which a vessel keeps exactly so much: the onset of pouring from that fill.

    By slices of the cavity's mesh that another library cuts, so that no formula is shared with what is audited; rounded
    to a microradian, so that every version of that library gives the same poses.

    ValueError where the vessel does not hold as much.
    """
    rim = cavity.to_brim.vertices[cavity.to_brim.vertices[:, 1] >= cavity.opening.lip[1] - RIM_WITHIN]
    forward = np.array([1.0, 0.0, 0.0])
    volume_beyond = volume_beyond_plane(cavity.to_brim)

    def missing(tilt: float) -> float:
        down = np.sin(tilt) * forward - np.cos(tilt) * np.array([0.0, 1.0, 0.0])
        return millilitres - volume_beyond(down, float((rim @ down).max())) * 1e6

    if not 0.0 <= millilitres <= millilitres - missing(0.0):
        raise ValueError(f"a vessel of {millilitres - missing(0.0):.1f} mL cannot keep {millilitres:.1f} mL")
    return solve_rising(missing, 0.0, math.pi / 2.0, decimals=6)


@dataclass(frozen=True)
class StopcockRotation:
    """The stopcock's angle goes from ``start_angle`` to ``end_angle`` (radians) as a minimum-jerk reach."""

    start: float
    end: float
    start_angle: float
    end_angle: float

    def angle(self, time: float) -> float:
        """Angle at a time."""
        fraction = float(minimum_jerk((time - self.start) / (self.end - self.start)))
        return self.start_angle + (self.end_angle - self.start_angle) * fraction

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
    rotations: Sequence[StopcockRotation]
    """In order of time, none overlapping."""

    def opened(self, time: float) -> float:
        """Integral of the open area from 0 to ``time``, m2 s."""
        total, rest_from, angle = 0.0, 0.0, 0.0
        for rotation in self.rotations:
            if time <= rotation.start:
                break
            total += angle * (rotation.start - rest_from) + rotation.swept(time)
            rest_from, angle = rotation.end, rotation.end_angle
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
        return solve_rising(lambda time: self.volume(time) - volume, 0.0, latest)
