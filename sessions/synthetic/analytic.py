"""Analytic sessions: every frame's contact follows from a formula, with the band that meshes and noise leave open.

Each case answers for a *level*: the times at which the smooth shapes are at most ``level`` apart along the motion
(negative: at least that deep in each other). Level 0 is the nominal truth; tessellation and noise only shift levels.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from sessions.errors import SessionError
from sessions.geometry.rotations import IDENTITY, Array
from sessions.geometry.solids import box, pointed_ball
from sessions.mesh_data import MeshData
from sessions.model.constants import HEADSET_HZ
from sessions.model.session import Session
from sessions.synthetic.assembly import MADE_UP, START_NS, Recording, record_paths
from sessions.synthetic.motion_profiles import MotionProfile, Swing, passes
from sessions.synthetic.paths import Path, Poses, Standing
from sessions.synthetic.rng import random_stream
from sessions.synthetic.truth import Level, Pair, PlantedEpisode, Truth, levelled_episodes, ordered_pair

# Poses near 1 m and vertices near 0.1 m are rounded to 1e-16 m; ten thousand times that also covers the rounding of
# stamps to nanoseconds at 4 m/s (4e-9 m).
ROUNDING_M = 1e-8

BALL = 1.0 / 32.0


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
        {"ball": on_axis(1, profile), "plate": Standing((0.0, -plate / 2.0, 0.0))},
        {ordered_pair("ball", "plate"): lambda level: profile.between(-plate - BALL - level, BALL + level, seconds)},
    )


def fast_ball(rng: np.random.Generator, seconds: float) -> AnalyticCase:
    """A 5 mm ball through a 1 mm wall at 0.4 to 4 m/s: the surfaces meet over 6 mm of its way, 1.5 to 15 ms."""
    ball, wall, speeds = 0.0025, 0.001, [0.4, 0.6, 1.0, 2.0, 4.0]
    count = max(1, int(seconds / 0.55))
    profile = passes([speeds[k % 5] for k in range(count)], rng.uniform(0.15, 0.35, count).tolist(), 0.1)
    return AnalyticCase(
        {"ball": pointed_ball(ball), "wall": box((0.2, wall, 0.2))},
        {"ball": on_axis(1, profile), "wall": Standing((0.0, 0.0, 0.0))},
        {ordered_pair("ball", "wall"): within(profile, wall / 2.0 + ball, seconds)},
    )


CaseMaker = Callable[[np.random.Generator, float], AnalyticCase]
ANALYTIC: dict[str, CaseMaker] = {make.__name__.replace("_", "-"): make for make in (ball_plate, fast_ball)}
"""Name -> function that makes the case."""


def make_analytic(
    name: str,
    *,
    rate_hz: float = HEADSET_HZ,
    seconds: float = 10.0,
    noise: str = "off",
    jitter: str = "even",
    seed: int = 0,
    cases: Mapping[str, CaseMaker] = ANALYTIC,
) -> tuple[Session, Truth]:
    """Make one analytic session and its truth; the same arguments give the same session.

    Parameters
    ----------
    name : a name of ``cases``.
    noise : ``off`` or ``vive``; with noise the truth's band widens by five sigma and moves by the latency.
    jitter : ``even``, ``steady`` or ``browser`` stamps.

    Raises ``SessionError``: an unknown name, a rate or length that is not positive.

    Examples
    --------
    >>> session, truth = make_analytic("ball-plate", seconds=2.0)
    >>> truth.pairs
    (('ball', 'plate'),)
    """
    if name not in cases:
        raise SessionError(f"no analytic session {name!r}; there are: {', '.join(cases)}")
    case = cases[name](random_stream(seed, "analytic", name), seconds)
    how = Recording(seed=seed, rate_hz=rate_hz, seconds=seconds, noise=noise, jitter=jitter)
    observed = record_paths(case.paths, how)
    facts = {"synthetic": name, "seed": str(seed), "noise": noise, "jitter": jitter, **MADE_UP}
    session = Session.from_tracks(observed.tracks(), meshes=case.meshes, facts=facts)
    pose_error = ROUNDING_M + (how.tracker.margin(case.lever, len(case.meshes)) if how.tracker else 0.0)
    episodes: list[PlantedEpisode] = []
    for kind, table in (("contact", case.contact), ("contained", case.contained)):
        for pair, level in table.items():
            episodes += levelled_episodes(pair, kind, level, pose_error, case.tessellation, (how.latency_s, seconds))
    truth = Truth(name, seed, START_NS, seconds, noise, episodes, observed.facts)
    return session, truth


def within(profile: MotionProfile, reach: float, seconds: float) -> Level:
    """When the value is at most ``reach`` + level from zero."""
    return lambda level: profile.between(-(reach + level), reach + level, seconds)


def identity_rotations(times: Array) -> Array:
    """Identity quaternions (..., 4), one a time."""
    return np.broadcast_to(np.array(IDENTITY), (*times.shape, 4)).copy()


def on_axis(axis: int, profile: MotionProfile) -> Path:
    """A path along X, Y or Z without a turn."""

    def path(times: Array) -> Poses:
        position = np.zeros((*times.shape, 3))
        position[..., axis] = profile(times)
        return position, identity_rotations(times)

    return path
