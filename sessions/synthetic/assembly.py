"""From paths and a truth to a recorded session: stamps, noise, losses, all keyed by one seed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from sessions.errors import SessionError
from sessions.synthetic.clock import CLOCKS, stamps
from sessions.synthetic.paths import Path, Poses
from sessions.synthetic.streams import random_stream
from sessions.synthetic.tracker import LOSSES, VIVE, Loss, TrackerNoise, disturbed, planned_losses, with_losses
from sessions.synthetic.truth import Fact, Interval
from sessions.track import Track

# 2024-03-01 09:00 UTC: an absolute start shows at once where somebody turns stamps into float seconds (0.2 us lost).
START_NS = 1_709_283_600_000_000_000

NOISES: Mapping[str, TrackerNoise | None] = {"off": None, "vive": VIVE}


@dataclass(frozen=True, kw_only=True)
class Recording:
    """How a made-up motion is recorded.

    Parameters
    ----------
    seed : of everything random.
    rate_hz, seconds : frames.
    noise : a name of `NOISES`.
    jitter : a name of `CLOCKS`.
    losses : a name of `LOSSES`; without noise nothing is lost.

    Raises
    ------
    SessionError
        An unknown name, a rate or length that is not positive.
    """

    seed: int = 0
    rate_hz: float = 90.0
    seconds: float = 10.0
    noise: str = "off"
    jitter: str = "even"
    losses: str = "flagged"

    def __post_init__(self) -> None:
        for what, known in (("noise", NOISES), ("jitter", CLOCKS), ("losses", LOSSES)):
            name = getattr(self, what)
            if name not in known:
                raise SessionError(f"no {what} {name!r}; there are: {', '.join(known)}")
        for what in ("rate_hz", "seconds"):
            if not getattr(self, what) > 0.0:
                raise SessionError(f"{what} is {getattr(self, what)}; give a positive number")

    @property
    def tracker(self) -> TrackerNoise | None:
        """The noise model, or ``None``."""
        return NOISES[self.noise]

    @property
    def latency_s(self) -> float:
        """How much older a pose is than its stamp."""
        return self.tracker.latency_s if self.tracker else 0.0

    def stamps(self) -> NDArray[np.int64]:
        """Stamps in nanoseconds after the start."""
        rng = random_stream(self.seed, "clock")
        return stamps(self.seconds, self.rate_hz, CLOCKS[self.jitter], rng)

    def seconds_of_frames(self) -> NDArray[np.float64]:
        """Stamps in seconds after the start."""
        return self.stamps().astype(np.float64) * 1e-9


@dataclass(frozen=True, eq=False)
class Recorded:
    """The poses of tracked bodies as recorded: name -> poses and validity, and the losses as facts."""

    stamps: NDArray[np.int64]
    poses: Mapping[str, Poses] = field(default_factory=dict)
    valid: Mapping[str, NDArray[np.bool_]] = field(default_factory=dict)
    facts: tuple[Fact, ...] = ()

    def tracks(self, others: Mapping[str, Poses] | None = None) -> dict[str, Track]:
        """Tracks of these bodies and of others that are placed by the program and so are never noisy or lost."""
        clock = self.stamps + START_NS
        all_poses = {**self.poses, **(others or {})}
        return {name: Track(clock, *poses, self.valid.get(name)) for name, poses in all_poses.items()}


def recorded(
    paths: Mapping[str, Path], how: Recording, *, keep: Mapping[str, Sequence[Interval]] | None = None
) -> Recorded:
    """Sample paths as a tracker would: late by the latency, at rest until then.

    ``keep`` names windows in which a body must not be lost (recorded time).
    """
    clock = how.stamps()
    times = clock.astype(np.float64) * 1e-9
    poses: dict[str, Poses] = {}
    valid: dict[str, NDArray[np.bool_]] = {}
    facts: list[Fact] = []
    for name, path in paths.items():
        clean = path(np.maximum(times - how.latency_s, 0.0))
        noise = how.tracker
        if noise is None:
            poses[name], valid[name] = clean, np.ones(len(times), dtype=np.bool_)
            continue
        noisy = disturbed(clean, times, noise, random_stream(how.seed, "tracker noise", name))
        windows = (keep or {}).get(name, ())
        rng = random_stream(how.seed, "tracking loss", name)
        losses = () if how.losses == "off" else planned_losses(how.seconds, noise, rng, windows)
        poses[name], valid[name] = with_losses(noisy, times, losses, noise, how.losses)
        facts.extend(_fact(name, loss, how.losses) for loss in losses)
    return Recorded(clock, poses, valid, tuple(facts))


def _fact(name: str, loss: Loss, kind: str) -> Fact:
    values: dict[str, float | str] = {"lost_until": loss.end, "recorded_as": kind}
    return Fact("loss", loss.start, loss.settled, (name,), values)
