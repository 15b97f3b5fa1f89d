"""Analytic sessions: every frame's contact follows from a formula, with the band that meshes and noise leave open."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sessions.errors import SessionError
from sessions.session import Session
from sessions.synthetic import analytic_cases as cases
from sessions.synthetic.analytic_cases import AnalyticCase
from sessions.synthetic.assembly import START_NS, Recording, recorded
from sessions.synthetic.streams import random_stream
from sessions.synthetic.truth import Episode, Truth, levelled, sorted_episodes, sorted_facts

# Poses near 1 m and vertices near 0.1 m are rounded to 1e-16 m; ten thousand times that also covers the rounding of
# stamps to nanoseconds at 4 m/s (4e-9 m).
ROUNDING_M = 1e-8

ANALYTIC: dict[str, Callable[[np.random.Generator, float], AnalyticCase]] = {
    make.__name__.replace("_", "-"): make
    for make in (
        cases.ball_plate, cases.ball_ball, cases.ball_ball_oblique, cases.rod_ring, cases.fast_ball,
        cases.spinning_rod, cases.grazing_ball, cases.ball_in_box,
    )
}  # fmt: skip
"""Name -> function that makes the case."""


def make_analytic(
    name: str,
    *,
    rate_hz: float = 90.0,
    seconds: float = 10.0,
    noise: str = "off",
    jitter: str = "even",
    losses: str = "flagged",
    seed: int = 0,
) -> tuple[Session, Truth]:
    """Make one analytic session and its truth; the same arguments give the same session.

    Parameters
    ----------
    name : a name of `ANALYTIC`.
    noise : ``off`` or ``vive``; with noise the truth's band widens by five sigma and moves by the latency.
    jitter : ``even``, ``steady`` or ``browser`` stamps.
    losses : ``flagged``, ``identity`` (unflagged identity poses) or ``off``; only with noise.

    Raises
    ------
    SessionError
        An unknown name, a rate or length that is not positive.

    Examples
    --------
    >>> session, truth = make_analytic("ball-plate", seconds=2.0)
    >>> truth.pairs
    (('ball', 'plate'),)
    """
    if name not in ANALYTIC:
        raise SessionError(f"no analytic session {name!r}; there are: {', '.join(ANALYTIC)}")
    case = ANALYTIC[name](random_stream(seed, "analytic", name), seconds)
    how = Recording(seed=seed, rate_hz=rate_hz, seconds=seconds, noise=noise, jitter=jitter, losses=losses)
    seen = recorded(case.paths, how)
    facts = {"synthetic": name, "seed": str(seed), "noise": noise, "jitter": jitter, "source_units": "m"}
    session = Session.from_tracks(seen.tracks(), meshes=case.meshes, facts=facts)
    truth = Truth(name, seed, START_NS, seconds, noise, sorted_episodes(_episodes(case, how)), sorted_facts(seen.facts))
    return session, truth


def _episodes(case: AnalyticCase, how: Recording) -> list[Episode]:
    blur = ROUNDING_M + (how.tracker.margin(case.lever, len(case.meshes)) if how.tracker else 0.0)
    found: list[Episode] = []
    for kind, table in (("contact", case.contact), ("contained", case.contained)):
        for pair, level in table.items():
            found += levelled(pair, kind, level, blur, case.tessellation, (how.latency_s, how.seconds))
    return found
