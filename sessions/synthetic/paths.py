"""How a body moves: rests joined by minimum-jerk reaches, with taps, stirring and tremor laid over them; and what
becomes of a thing on the bench: it stands, is held, falls."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from sessions.geometry.profile import solve_rising
from sessions.geometry.rotations import IDENTITY, Array, quaternion_product, rotated_vectors, slerp

Point = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Poses = tuple[Array, Array]
Path = Callable[[Array], Poses]
"""Times (n,) in seconds -> positions (n, 3) and unit quaternions xyzw (n, 4)."""
Overlay = Callable[[Array], Array]
"""Times (n,) -> what is added to the positions (n, 3)."""


PosesAt = Callable[[Array, Mapping[str, Poses]], Poses]
"""Times (n,) of the recorded clock and the recorded poses of the hands at them -> poses of the thing."""

OPENING_S = 0.8

# Standard gravity, m/s2 (CGPM 1901).
GRAVITY = 9.80665


def minimum_jerk(time_fraction: ArrayLike) -> Array:
    """Share of the way of a reach between rests: 10 u^3 - 15 u^4 + 6 u^5, held outside [0, 1].

    Source: Flash and Hogan, "The coordination of arm movements", J. Neuroscience 5 (1985) 1688, eq. 4: people move
    a hand from point to point so that the integral of the squared jerk is least.
    """
    u = np.clip(np.asarray(time_fraction, dtype=np.float64), 0.0, 1.0)
    return u * u * u * (10.0 + u * (6.0 * u - 15.0))


def minimum_jerk_inverse(path_fraction: float) -> float:
    """Share of the time at which a minimum-jerk reach has come this share of its way."""
    if path_fraction in (0.0, 1.0):
        return path_fraction  # flat there: many times come within rounding of the end
    return solve_rising(lambda time: float(minimum_jerk(time)) - path_fraction, 0.0, 1.0)


def knock(time_fraction: ArrayLike) -> Array:
    """There and back without a rest at the far end: sin^2(pi u) on [0, 1], 0 outside.

    Unlike two reaches put together, which rest at the turning point, this turns as a tapping finger does.
    """
    u = np.clip(np.asarray(time_fraction, dtype=np.float64), 0.0, 1.0)
    return np.sin(np.pi * u) ** 2


@dataclass(frozen=True)
class Key:
    """A pose (metres, xyzw) at a time (seconds), and how it is reached from the key before."""

    time: float
    position: ArrayLike
    quaternion: ArrayLike = IDENTITY
    ease: str = "minimum-jerk"
    """``minimum-jerk`` or ``linear``."""
    arc: float = 0.0
    """How far the way there rises above the straight line, metres, as a hand does over things in its way."""


class KeyPath:
    """Poses at keys, blended between them, held before the first and after the last; overlays are added.

    ValueError for fewer than two keys, or keys that are not in order of time.
    """

    def __init__(self, keys: Sequence[Key], overlays: Sequence[Overlay] = ()) -> None:
        self.keys, self.overlays = tuple(keys), tuple(overlays)
        self._time = np.array([key.time for key in keys])
        if len(keys) < 2 or (np.diff(self._time) <= 0.0).any():
            raise ValueError(f"keys at {self._time.tolist()} s do not follow each other; sort them and drop repeats")
        self._position = np.array([key.position for key in keys], dtype=np.float64)
        self._quaternion = np.array([key.quaternion for key in keys], dtype=np.float64)
        self._linear = np.array([key.ease == "linear" for key in keys])
        self._arc = np.array([key.arc for key in keys])

    def __call__(self, times: Array) -> Poses:
        """Poses at these times."""
        after = np.clip(np.searchsorted(self._time, times, side="right"), 1, len(self.keys) - 1)
        before = after - 1
        fraction = np.clip((times - self._time[before]) / (self._time[after] - self._time[before]), 0.0, 1.0)
        eased = np.where(self._linear[after], fraction, minimum_jerk(fraction))
        step = self._position[after] - self._position[before]
        position = self._position[before] + eased[..., None] * step
        position[..., 1] += 16.0 * eased**2 * (1.0 - eased) ** 2 * self._arc[after]
        for overlay in self.overlays:
            position = position + overlay(times)
        return position, slerp(self._quaternion[before], self._quaternion[after], eased)


@dataclass(frozen=True)
class Tap:
    """A knock of a body along a direction: out by ``amplitude`` and back within ``period``, from ``start``."""

    start: float
    period: float
    direction: ArrayLike
    amplitude: float

    def __call__(self, times: Array) -> Array:
        """Displacements (n, 3)."""
        fraction = knock((times - self.start) / self.period)
        return self.amplitude * fraction[..., None] * np.asarray(self.direction)


@dataclass(frozen=True)
class Dent:
    """How a tap goes in: ``depth`` metres beyond first contact, in contact for ``seconds``.

    ``amplitude`` is the whole way out, so ``amplitude - depth`` lies between the resting place and first contact.
    """

    depth: float
    seconds: float
    amplitude: float

    @property
    def period(self) -> float:
        """Duration of the whole knock: sin^2 is beyond 1 - depth / amplitude for this share of it."""
        fraction = 2.0 / math.pi * math.asin(math.sqrt(self.depth / self.amplitude))
        return self.seconds / fraction

    @property
    def gap(self) -> float:
        """How far from first contact the body rests before and after."""
        return self.amplitude - self.depth

    def intervals(self, tap: Tap, level: float) -> list[tuple[float, float]]:
        """When the tapping body is at most ``level`` short of contact."""
        out = (self.gap - level) / self.amplitude
        if out > 1.0:
            return []
        fraction = math.asin(math.sqrt(max(0.0, out))) / math.pi
        return [(tap.start + fraction * tap.period, tap.start + (1.0 - fraction) * tap.period)]

    def tap(self, deepest: float, direction: ArrayLike = (0.0, 0.0, 0.0)) -> Tap:
        """The tap along a direction, or of a radius, farthest out at the time ``deepest``."""
        return Tap(deepest - self.period / 2.0, self.period, direction, self.amplitude)


@dataclass(frozen=True)
class Stir:
    """Circles in the horizontal plane, with taps of the radius on top.

    The circle (metres) opens in the first `OPENING_S` seconds after ``start`` and closes in the last before ``end``.
    """

    start: float
    end: float
    radius: float
    revolutions_per_second: float
    """Of the angle, which starts at +X and turns towards +Z."""
    taps: tuple[Tap, ...] = ()
    """Of the radius; their directions count for nothing."""

    def __call__(self, times: Array) -> Array:
        """Displacements (n, 3)."""
        opened = minimum_jerk((times - self.start) / OPENING_S)
        closed = minimum_jerk((self.end - times) / OPENING_S)
        radius = self.radius * np.minimum(opened, closed)
        for tap in self.taps:
            radius = radius + tap.amplitude * knock((times - tap.start) / tap.period)
        angle = 2.0 * np.pi * self.revolutions_per_second * (times - self.start)
        return radius[..., None] * np.stack([np.cos(angle), np.zeros_like(angle), np.sin(angle)], axis=-1)


class Tremor:
    """Physiological tremor: sines of 7-12 Hz with random phases, silent in the given windows.

    Source: Elble and Randall, "Mechanistic components of normal hand tremor", Electroencephalogr. Clin. Neurophysiol.
    44 (1978) 72: 8-12 Hz in the hand and fingers, amplitude below a millimetre.
    """

    WAVES, FADE_S = 4, 0.15

    def __init__(self, rng: np.random.Generator, amplitude: float, quiet: Sequence[tuple[float, float]] = ()) -> None:
        self._frequency = rng.uniform(7.0, 12.0, self.WAVES)
        self._phase = rng.uniform(0.0, 2.0 * np.pi, (self.WAVES, 3))
        self._amplitude = amplitude / np.sqrt(self.WAVES)
        self._quiet = tuple(quiet)

    def __call__(self, times: Array) -> Array:
        """Displacements (n, 3)."""
        angle = 2.0 * np.pi * self._frequency * times[..., None]
        sway = np.sin(angle[..., None] + self._phase).sum(axis=-2)
        gate = np.ones_like(times)
        for start, end in self._quiet:
            outside = np.maximum(start - times, times - end)
            gate = gate * minimum_jerk(outside / self.FADE_S)
        return self._amplitude * gate[..., None] * sway


def carried_poses(poses: Poses, offset_position: ArrayLike, offset_quaternion: ArrayLike = IDENTITY) -> Poses:
    """Poses of a thing rigidly held: its pose in the holder's frame is constant."""
    position, quaternion = poses
    return position + rotated_vectors(quaternion, offset_position), quaternion_product(quaternion, offset_quaternion)


@dataclass(frozen=True)
class Standing:
    """It stays where it is."""

    position: ArrayLike
    quaternion: ArrayLike = IDENTITY

    def __call__(self, times: Array, _hands: Mapping[str, Poses] | None = None) -> Poses:
        """Poses at these times."""
        return np.tile(self.position, (len(times), 1)), np.tile(self.quaternion, (len(times), 1))


@dataclass(frozen=True)
class OnHand:
    """It rides on a hand: its pose in the hand's frame is constant."""

    hand: str
    offset: ArrayLike
    rotation: ArrayLike = IDENTITY

    def __call__(self, _times: Array, hands: Mapping[str, Poses]) -> Poses:
        """Poses at these times."""
        return carried_poses(hands[self.hand], self.offset, self.rotation)


@dataclass(frozen=True)
class Falling:
    """It falls freely from rest at ``start`` down to the height ``floor`` and stays there."""

    start: float
    position: Array
    quaternion: Array
    floor: float

    def time_at(self, height: float) -> float:
        """When it passes a height between where it starts and ``floor``."""
        return self.start + float(np.sqrt(2.0 * (self.position[1] - height) / GRAVITY))

    def speed_at(self, height: float) -> float:
        """How fast it passes a height, m/s."""
        return float(np.sqrt(2.0 * GRAVITY * (self.position[1] - height)))

    def __call__(self, times: Array, _hands: Mapping[str, Poses]) -> Poses:
        """Poses at these times."""
        position, quaternion = Standing(self.position, self.quaternion)(times)
        position[:, 1] = np.maximum(self.floor, position[:, 1] - 0.5 * GRAVITY * (times - self.start) ** 2)
        return position, quaternion


def placed_by(phases: Sequence[tuple[float, PosesAt]], times: Array, hands: Mapping[str, Poses]) -> Poses:
    """Poses (n, 3) and (n, 4) of a thing at all frames; each phase (start, placing) lasts until the next one starts."""
    position, quaternion = phases[0][1](times, hands)
    for start, placing in phases[1:]:
        begun = (times >= start)[:, None]
        later = placing(times, hands)
        position, quaternion = np.where(begun, later[0], position), np.where(begun, later[1], quaternion)
    return position, quaternion
