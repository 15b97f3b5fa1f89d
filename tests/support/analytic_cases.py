"""More sessions with a truth in closed form than the product offers: rotation, grazing, containment."""

import itertools
import math
from dataclasses import dataclass
from functools import partial

import numpy as np
from support.prisms import prism

from sessions.geometry.rotations import Array, quaternion_about
from sessions.geometry.solids import box, pointed_ball
from sessions.synthetic import analytic
from sessions.synthetic.analytic import BALL, AnalyticCase, on_axis, within
from sessions.synthetic.motion_profiles import MotionProfile, Swing, joined
from sessions.synthetic.paths import Poses, Standing
from sessions.synthetic.truth import Interval, ordered

SMALL_BALL = 1.0 / 64.0
UPRIGHT = np.array([0.0, 1.0, 0.0])


@dataclass(frozen=True)
class Dips:
    """floor_k + steepness (t - time_k)^2 about the nearest of the given times: it comes down, grazes, and leaves."""

    times: tuple[float, ...]
    floors: tuple[float, ...]
    steepness: float

    def __call__(self, times: Array) -> Array:
        """Value at each time."""
        centre = np.asarray(self.times)
        nearest = np.abs(np.asarray(times)[..., None] - centre).argmin(axis=-1)
        return np.asarray(self.floors)[nearest] + self.steepness * (times - centre[nearest]) ** 2

    def between(self, low: float, high: float, seconds: float) -> list[Interval]:
        """Intervals below ``high`` by the square root; no dip goes below ``low``."""
        assert min(self.floors) >= low
        spans = []
        cells = [-math.inf, *((a + b) / 2.0 for a, b in itertools.pairwise(self.times)), math.inf]
        for time, floor, (first, last) in zip(self.times, self.floors, itertools.pairwise(cells), strict=True):
            if floor <= high:
                half = math.sqrt((high - floor) / self.steepness)
                spans.append((max(first, time - half), min(last, time + half)))
        return joined(spans, seconds)


@dataclass(frozen=True)
class Turning:
    """A coordinate that repeats every ``cycle``: speed * (t - start), folded into [-cycle/2, cycle/2)."""

    speed: float
    cycle: float
    start: float = 0.0

    def __call__(self, times: Array) -> Array:
        """Value at each time, not folded: a turn is a turn."""
        return self.speed * (times - self.start)

    def between(self, low: float, high: float, seconds: float) -> list[Interval]:
        """Intervals in which the folded value lies between."""
        if low > high:
            return []
        turns = range(
            math.floor(-self.start * self.speed / self.cycle) - 2,
            math.ceil((seconds - self.start) * self.speed / self.cycle) + 2,
        )
        ends = [(k * self.cycle + low, k * self.cycle + high) for k in turns]
        return joined([(self.start + a / self.speed, self.start + b / self.speed) for a, b in ends], seconds)


def outside(profile: MotionProfile, bound: float, far: float, seconds: float) -> list[Interval]:
    """Intervals in which the value is between ``bound`` and ``far`` on either side of zero."""
    return joined(
        [*profile.between(bound, far, seconds), *profile.between(-far, -bound, seconds)] if bound <= far else [],
        seconds,
    )


def spinning_rod(rng: np.random.Generator, seconds: float) -> AnalyticCase:
    """A rod turns on the spot past a post, both ends in turn: nothing moves but the rotation."""
    half_width, post, distance, sides = 1.0 / 256.0, 1.0 / 256.0, 0.125, 16
    profile = Turning(float(rng.uniform(7.0, 11.0)), np.pi, float(rng.uniform(0.0, 0.3)))

    def path(times: Array) -> Poses:
        return np.zeros((*times.shape, 3)), quaternion_about(UPRIGHT, profile(times))

    def contact(level: float) -> list[Interval]:
        reach = half_width + post + level
        if reach < 0.0:
            return []
        angle = float(np.arcsin(reach / distance))
        return profile.between(-angle, angle, seconds)

    return AnalyticCase(
        {"rod": box((0.3, 2.0 * half_width, 2.0 * half_width)), "post": prism(sides, post, 0.1)},
        {"rod": path, "post": Standing((distance, 0.0, 0.0))},
        {ordered("post", "rod"): contact},
        tessellation=post * (1.0 - np.cos(np.pi / sides)),
        lever=0.15,
    )


def grazing_ball(rng: np.random.Generator, seconds: float) -> AnalyticCase:
    """A ball grazes a plate with clearances 0, 1, -1, 4 and -4 micrometres, at whole seconds."""
    plate, clearances = 1.0 / 64.0, (0.0, 1e-6, -1e-6, 4e-6, -4e-6)
    count = max(1, int(seconds))
    order = rng.permutation(count)
    times = tuple(float(k + 1) for k in range(count))
    profile = Dips(times, tuple(BALL + clearances[int(k) % 5] for k in order), 0.3)
    return AnalyticCase(
        {"ball": pointed_ball(BALL), "plate": box((0.5, plate, 0.5))},
        {"ball": on_axis(1, profile), "plate": Standing((0.0, -plate / 2.0, 0.0))},
        {ordered("ball", "plate"): lambda level: profile.between(-BALL, BALL + level, seconds)},
    )


def ball_in_box(rng: np.random.Generator, seconds: float) -> AnalyticCase:
    """A ball inside a closed box comes out through one wall or the other: contained, contact, clear."""
    half, pair = 1.0 / 16.0, ordered("ball", "box")
    profile = Swing(0.0, half + SMALL_BALL + 0.02, float(rng.uniform(2.5, 3.5)), float(rng.uniform(0.0, 1.0)))
    return AnalyticCase(
        {"ball": pointed_ball(SMALL_BALL), "box": box((2.0 * half, 2.0 * half, 2.0 * half))},
        {"ball": on_axis(0, profile), "box": Standing((0.0, 0.0, 0.0))},
        {pair: lambda level: outside(profile, half - SMALL_BALL - level, half + SMALL_BALL + level, seconds)},
        {pair: within(profile, half - SMALL_BALL, seconds)},
    )


ANALYTIC = analytic.ANALYTIC | {
    make.__name__.replace("_", "-"): make for make in (spinning_rod, grazing_ball, ball_in_box)
}
make_analytic = partial(analytic.make_analytic, cases=ANALYTIC)
