"""From paths to a recorded session: the stamps of a headset, noise and losses, all keyed by one seed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sessions.errors import SessionError
from sessions.mcap.metadata import SHAREABLE
from sessions.model.constants import HEADSET_HZ
from sessions.model.session import Track
from sessions.synthetic.paths import Path, Poses
from sessions.synthetic.rng import random_stream
from sessions.synthetic.tracker import VIVE, TrackerNoise, disturbed_poses, planned_losses, with_losses
from sessions.synthetic.truth import Fact, Interval

# 2024-03-01 09:00 UTC: an absolute start shows at once where somebody turns stamps into float seconds (0.2 us lost).
START_NS = 1_709_283_600_000_000_000

MADE_UP = {"source_units": "m", "consent": SHAREABLE}
"""Facts of every made-up session: nobody moved in it."""

NOISES: Mapping[str, TrackerNoise | None] = {"off": None, "vive": VIVE}


@dataclass(frozen=True, kw_only=True)
class Jitter:
    """How far a frame's stamp strays from the rate; no step is longer or shorter than the last two."""

    jitter_s: float = 0.0
    """Standard deviation of a stamp about its place, seconds."""
    gap_probability: float = 0.0
    """Chance that a step leaves frames out."""
    longest_gap_s: float = 0.128
    shortest_step_s: float = 0.0023


CLOCKS = {
    "even": Jitter(),
    "steady": Jitter(jitter_s=0.0004, gap_probability=0.004, longest_gap_s=0.034),
    "browser": Jitter(jitter_s=0.0019, gap_probability=0.035),
}
"""Name -> clock. ``browser`` has the gaps of three A-Frame recordings at 89 Hz: 44-121 steps above 1.5 times the median
in 15-30 s, steps from 2.3 to 128 ms. ``steady`` is a native program that rarely drops a frame."""


@dataclass(frozen=True, kw_only=True)
class Recording:
    """How a made-up motion is recorded; SessionError for an unknown name, or a rate or length that is not positive.

    ``noise`` and ``jitter`` are names of `NOISES` and `CLOCKS`; without noise nothing is lost.
    """

    seed: int = 0
    rate_hz: float = HEADSET_HZ
    seconds: float = 10.0
    noise: str = "off"
    jitter: str = "even"

    def __post_init__(self) -> None:
        for what, known in (("noise", NOISES), ("jitter", CLOCKS)):
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
        """The age of a pose at its stamp."""
        return self.tracker.latency_s if self.tracker else 0.0


@dataclass(frozen=True, eq=False)
class Recorded:
    """The poses of tracked bodies as recorded: name -> poses and validity, and the losses as facts."""

    stamps: NDArray[np.int64]
    poses: Mapping[str, Poses]
    valid: Mapping[str, NDArray[np.bool_]]
    """Of bodies that a tracker may lose."""
    facts: Sequence[Fact]

    def tracks(self, others: Mapping[str, Poses] | None = None) -> dict[str, Track]:
        """Tracks of these bodies and of others that are placed by the program and so are never noisy or lost."""
        clock = self.stamps + START_NS
        all_poses = {**self.poses, **(others or {})}
        return {name: Track(clock, *poses, self.valid.get(name)) for name, poses in all_poses.items()}


def record_paths(
    paths: Mapping[str, Path], how: Recording, *, keep: Mapping[str, Sequence[Interval]] | None = None
) -> Recorded:
    """Sample paths as a tracker would: late by the latency, at rest until then.

    ``keep`` names windows in which a body must not be lost (recorded time).
    """
    clock = stamps(how.seconds, how.rate_hz, CLOCKS[how.jitter], random_stream(how.seed, "clock"))
    times = clock.astype(np.float64) * 1e-9
    poses: dict[str, Poses] = {}
    valid: dict[str, NDArray[np.bool_]] = {}
    facts: list[Fact] = []
    for name, path in paths.items():
        clean = path(np.maximum(times - how.latency_s, 0.0))
        noise = how.tracker
        if noise is None:
            poses[name] = clean
            continue
        noisy = disturbed_poses(clean, times, noise, random_stream(how.seed, "tracker noise", name))
        rng = random_stream(how.seed, "tracking loss", name)
        losses = planned_losses(how.seconds, noise, rng, (keep or {}).get(name, ()))
        poses[name], valid[name] = with_losses(noisy, times, losses, noise)
        for loss in losses:
            values: dict[str, float | str] = {"lost_until": loss.end, "recorded_as": "flagged"}
            facts.append(Fact("loss", loss.start, loss.settled, (name,), values))
    return Recorded(clock, poses, valid, facts)


def stamps(seconds: float, rate_hz: float, clock: Jitter, rng: np.random.Generator) -> NDArray[np.int64]:
    """Stamps in nanoseconds from 0 up to ``seconds``, strictly increasing.

    ValueError for a rate whose period is below the shortest step.
    """
    period = 1.0 / rate_hz
    if clock.jitter_s > 0.0 and period < clock.shortest_step_s:
        raise ValueError(
            f"{rate_hz} Hz needs steps below {clock.shortest_step_s} s; lower the rate or use clock 'even'"
        )
    most = int(np.floor(seconds * rate_hz)) + 1
    indices = np.concatenate([[0], np.cumsum(_periods(most - 1, period, clock, rng))])
    indices = indices[indices < most]
    reach = max(0.0, (period - clock.shortest_step_s) / 2.0)
    stray = np.clip(rng.normal(0.0, 1.0, len(indices)) * clock.jitter_s, -reach, reach)
    stray[0] = 0.0
    times = np.rint((indices * period + stray) * 1e9).astype(np.int64)
    return times[times <= round(seconds * 1e9)]


def _periods(count: int, period: float, clock: Jitter, rng: np.random.Generator) -> NDArray[np.int64]:
    """Whole periods from each frame to the next: 1, or more where frames are left out."""
    longest = max(2, int((clock.longest_gap_s + clock.shortest_step_s) / period) - 1)
    gap = rng.random(count) < clock.gap_probability
    length = np.minimum(1 + rng.geometric(0.75, count), longest)
    return np.where(gap, length, 1).astype(np.int64)
