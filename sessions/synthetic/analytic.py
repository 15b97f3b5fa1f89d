"""Analytic sessions: every frame's contact follows from a formula, with the band that meshes and noise leave open.

Each case answers for a *level*: the times at which the smooth shapes are at most ``level`` apart along the motion
(negative: at least that deep in each other). Level 0 is the nominal truth; tessellation and noise only shift levels.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from sessions.errors import SessionError
from sessions.geometry.rotations import IDENTITY, Array, quaternion_about
from sessions.geometry.solids import box, inscribed_depth, pointed_ball, prism
from sessions.mesh_data import MeshData
from sessions.model.constants import HEADSET_HZ
from sessions.model.session import Session
from sessions.synthetic.assembly import MADE_UP, START_NS, Recording, recorded
from sessions.synthetic.motion_profiles import Dips, MotionProfile, Swing, Turning, outside, passes
from sessions.synthetic.paths import Path, Poses, still
from sessions.synthetic.rng import random_stream
from sessions.synthetic.truth import (
    Interval,
    Level,
    Pair,
    PlantedEpisode,
    Truth,
    levelled,
    ordered,
    sorted_episodes,
    sorted_facts,
)

# Poses near 1 m and vertices near 0.1 m are rounded to 1e-16 m; ten thousand times that also covers the rounding of
# stamps to nanoseconds at 4 m/s (4e-9 m).
ROUNDING_M = 1e-8

BALL = 1.0 / 32.0
SMALL_BALL = 1.0 / 64.0
UPRIGHT = np.array([0.0, 1.0, 0.0])


@dataclass(frozen=True)
class AnalyticCase:
    """Meshes and paths by body name, and when each pair is in contact or contained."""

    meshes: Mapping[str, MeshData]
    paths: Mapping[str, Path]
    contact: Mapping[Pair, Level]
    contained: Mapping[Pair, Level] = field(default_factory=dict)
    """At a higher level more counts as contained."""
    tessellation: float = 0.0
    """How much farther apart than the smooth shapes the meshes may be, metres."""
    lever: float = 0.1
    """Largest distance of a surface point from its body's origin, metres."""


def ball_plate(rng: np.random.Generator, seconds: float) -> AnalyticCase:
    """A ball comes down on a plate and rises, again and again; it touches with a corner that points down."""
    plate = 1.0 / 64.0
    profile = Swing(BALL + 0.02, 0.03, float(rng.uniform(1.1, 1.5)), float(rng.uniform(0.0, 1.0)))
    return AnalyticCase(
        {"ball": pointed_ball(BALL), "plate": box((0.5, plate, 0.5))},
        {"ball": _on_axis(1, profile), "plate": still((0.0, -plate / 2.0, 0.0))},
        {ordered("ball", "plate"): lambda level: profile.between(-plate - BALL - level, BALL + level, seconds)},
    )


def ball_ball(rng: np.random.Generator, seconds: float) -> AnalyticCase:
    """Two balls head on: corner meets corner, so the distance of the centres decides exactly."""
    profile = Swing(BALL + SMALL_BALL + 0.02, 0.025, float(rng.uniform(0.9, 1.3)), float(rng.uniform(0.0, 1.0)))
    return AnalyticCase(
        {"ball": pointed_ball(BALL), "small-ball": pointed_ball(SMALL_BALL)},
        {"ball": still((0.0, 0.0, 0.0)), "small-ball": _on_axis(0, profile)},
        {ordered("ball", "small-ball"): _within(profile, BALL + SMALL_BALL, seconds)},
    )


def ball_ball_oblique(rng: np.random.Generator, seconds: float) -> AnalyticCase:
    """A ball flies past another with half an overlap: facets meet, so tessellation leaves a band open."""
    count = max(1, int(seconds / 1.2))
    profile = passes(rng.uniform(0.3, 1.5, count).tolist(), rng.uniform(0.1, 0.5, count).tolist(), 0.1)
    aside = 0.75 * 2.0 * BALL
    meshes = {"ball": pointed_ball(BALL, 4), "other-ball": pointed_ball(BALL, 4)}

    def contact(level: float) -> list[Interval]:
        square = (2.0 * BALL + level) ** 2 - aside**2
        return profile.between(-math.sqrt(square), math.sqrt(square), seconds) if square >= 0.0 else []

    return AnalyticCase(
        meshes,
        {"ball": _on_axis(2, profile), "other-ball": still((aside, 0.0, 0.0))},
        {ordered("ball", "other-ball"): contact},
        tessellation=2.0 * inscribed_depth(meshes["ball"]),
    )


def rod_ring(rng: np.random.Generator, seconds: float) -> AnalyticCase:
    """A rod stands through a ring, slides along it and sways: an edge of the rod meets a flat of the hole."""
    rod, hole, outer = 1.0 / 128.0, 1.0 / 32.0, 3.0 / 64.0
    sway = Swing(0.0, hole - rod + 0.003, float(rng.uniform(0.8, 1.2)), float(rng.uniform(0.0, 1.0)))
    slide = Swing(0.0, 0.05, 2.7)

    def path(times: Array) -> Poses:
        position = np.stack([sway(times), slide(times), np.zeros_like(times)], axis=-1)
        return position, _unturned(times)

    return AnalyticCase(
        {"rod": prism(12, rod, 0.25), "ring": prism(16, outer, 1.0 / 64.0, hole=hole)},
        {"rod": path, "ring": still((0.0, 0.0, 0.0))},
        {ordered("ring", "rod"): lambda level: outside(sway, hole - rod - level, outer + rod + level, seconds)},
        lever=0.15,
    )


def fast_ball(rng: np.random.Generator, seconds: float) -> AnalyticCase:
    """A 5 mm ball through a 1 mm wall at 0.4 to 4 m/s: the surfaces meet over 6 mm of its way, 1.5 to 15 ms."""
    ball, wall, speeds = 0.0025, 0.001, [0.4, 0.6, 1.0, 2.0, 4.0]
    count = max(1, int(seconds / 0.55))
    profile = passes([speeds[k % 5] for k in range(count)], rng.uniform(0.15, 0.35, count).tolist(), 0.1)
    return AnalyticCase(
        {"ball": pointed_ball(ball), "wall": box((0.2, wall, 0.2))},
        {"ball": _on_axis(1, profile), "wall": still((0.0, 0.0, 0.0))},
        {ordered("ball", "wall"): _within(profile, wall / 2.0 + ball, seconds)},
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
        {"rod": path, "post": still((distance, 0.0, 0.0))},
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
        {"ball": _on_axis(1, profile), "plate": still((0.0, -plate / 2.0, 0.0))},
        {ordered("ball", "plate"): lambda level: profile.between(-BALL, BALL + level, seconds)},
    )


def ball_in_box(rng: np.random.Generator, seconds: float) -> AnalyticCase:
    """A ball inside a closed box comes out through one wall or the other: contained, contact, clear."""
    half, pair = 1.0 / 16.0, ordered("ball", "box")
    profile = Swing(0.0, half + SMALL_BALL + 0.02, float(rng.uniform(2.5, 3.5)), float(rng.uniform(0.0, 1.0)))
    return AnalyticCase(
        {"ball": pointed_ball(SMALL_BALL), "box": box((2.0 * half, 2.0 * half, 2.0 * half))},
        {"ball": _on_axis(0, profile), "box": still((0.0, 0.0, 0.0))},
        {pair: lambda level: outside(profile, half - SMALL_BALL - level, half + SMALL_BALL + level, seconds)},
        {pair: _within(profile, half - SMALL_BALL, seconds)},
    )


ANALYTIC: dict[str, Callable[[np.random.Generator, float], AnalyticCase]] = {
    make.__name__.replace("_", "-"): make
    for make in (ball_plate, ball_ball, ball_ball_oblique, rod_ring, fast_ball, spinning_rod, grazing_ball, ball_in_box)
}
"""Name -> function that makes the case."""


def make_analytic(
    name: str,
    *,
    rate_hz: float = HEADSET_HZ,
    seconds: float = 10.0,
    noise: str = "off",
    jitter: str = "even",
    seed: int = 0,
) -> tuple[Session, Truth]:
    """Make one analytic session and its truth; the same arguments give the same session.

    Parameters
    ----------
    name : a name of `ANALYTIC`.
    noise : ``off`` or ``vive``; with noise the truth's band widens by five sigma and moves by the latency.
    jitter : ``even``, ``steady`` or ``browser`` stamps.

    Raises ``SessionError``: an unknown name, a rate or length that is not positive.

    Examples
    --------
    >>> session, truth = make_analytic("ball-plate", seconds=2.0)
    >>> truth.pairs
    (('ball', 'plate'),)
    """
    if name not in ANALYTIC:
        raise SessionError(f"no analytic session {name!r}; there are: {', '.join(ANALYTIC)}")
    case = ANALYTIC[name](random_stream(seed, "analytic", name), seconds)
    how = Recording(seed=seed, rate_hz=rate_hz, seconds=seconds, noise=noise, jitter=jitter)
    seen = recorded(case.paths, how)
    facts = {"synthetic": name, "seed": str(seed), "noise": noise, "jitter": jitter, **MADE_UP}
    session = Session.from_tracks(seen.tracks(), meshes=case.meshes, facts=facts)
    truth = Truth(name, seed, START_NS, seconds, noise, sorted_episodes(_episodes(case, how)), sorted_facts(seen.facts))
    return session, truth


def _episodes(case: AnalyticCase, how: Recording) -> list[PlantedEpisode]:
    blur = ROUNDING_M + (how.tracker.margin(case.lever, len(case.meshes)) if how.tracker else 0.0)
    found: list[PlantedEpisode] = []
    for kind, table in (("contact", case.contact), ("contained", case.contained)):
        for pair, level in table.items():
            found += levelled(pair, kind, level, blur, case.tessellation, (how.latency_s, how.seconds))
    return found


def _within(profile: MotionProfile, reach: float, seconds: float) -> Level:
    """When the value is at most ``reach`` + level from zero."""
    return lambda level: profile.between(-(reach + level), reach + level, seconds)


def _unturned(times: Array) -> Array:
    return np.broadcast_to(np.array(IDENTITY), (*times.shape, 4)).copy()


def _on_axis(axis: int, profile: MotionProfile) -> Path:
    def path(times: Array) -> Poses:
        position = np.zeros((*times.shape, 3))
        position[..., axis] = profile(times)
        return position, _unturned(times)

    return path
