"""The output of a VIVE-style tracker for a true motion: late, noisy, sometimes lost, and off when it comes back."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sessions.geometry.rotations import Array, quaternion_from_vector, quaternion_product
from sessions.synthetic.paths import Poses


@dataclass(frozen=True, kw_only=True)
class TrackerNoise:
    """How far recorded poses are from the truth.

    Source: sizes from Niehorster et al. 2017, Bauer et al. 2021 and Sansone et al. 2021 on the accuracy of HTC VIVE;
    the step of a resting tracker from a published raw log.
    """

    position_rms_m: float = 0.0003
    """Root mean square length of the position error."""
    rotation_rms_deg: float = 0.02
    """The same of the rotation error's angle."""
    correlation_s: float = 0.074
    """The errors of two samples this far apart correlate by 1/e. With white noise of this size a resting tracker would
    step by 0.38 mm (median) from frame to frame; real ones step by 0.14 mm."""
    latency_s: float = 0.022
    """A sample shows where the body was this much earlier."""
    most_losses_per_minute: float = 2.0
    """Each body's rate is drawn between 0 and this."""
    loss_s: tuple[float, float] = (0.05, 0.5)
    reentry_m: tuple[float, float] = (0.005, 0.03)
    """Ranges of a loss's length and of the position error when tracking returns."""
    settle_s: float = 0.06
    """The error after a loss falls by 1/e in this time."""

    def margin(self, lever_m: float, bodies: int = 2) -> float:
        """Distance in metres by which noise may move one of ``bodies`` surfaces against the other: five sigma."""
        along = self.position_rms_m / np.sqrt(3.0)
        displacement = np.radians(self.rotation_rms_deg) / np.sqrt(3.0) * lever_m
        return float(5.0 * np.sqrt(bodies) * np.hypot(along, displacement))


VIVE = TrackerNoise()


@dataclass(frozen=True)
class Loss:
    """Tracking lost from ``start`` to ``end``; the pose is as good as ever again at ``settled`` (seconds)."""

    start: float
    end: float
    settled: float
    step: Array


def planned_losses(
    seconds: float, noise: TrackerNoise, rng: np.random.Generator, keep: Sequence[tuple[float, float]] = ()
) -> tuple[Loss, ...]:
    """Draw the losses of one body; none touches a window of ``keep``, so that what is planted there stays true."""
    rate = rng.uniform(0.0, noise.most_losses_per_minute)
    count = int(rng.poisson(rate * seconds / 60.0))
    count = min(count, int(np.ceil(noise.most_losses_per_minute * seconds / 60.0)))
    taken = list(keep)
    losses: list[Loss] = []
    for _ in range(count):
        for _ in range(40):
            loss = _loss(rng, seconds, noise)
            if loss.settled < seconds and all(loss.settled < start or loss.start > end for start, end in taken):
                losses.append(loss)
                taken.append((loss.start, loss.settled))
                break
    return tuple(sorted(losses, key=lambda loss: loss.start))


def _loss(rng: np.random.Generator, seconds: float, noise: TrackerNoise) -> Loss:
    length = rng.uniform(*noise.loss_s)
    size = rng.uniform(*noise.reentry_m)
    direction = rng.normal(size=3)
    step = size * direction / np.linalg.norm(direction)
    start = rng.uniform(0.5, max(0.6, seconds))
    settled = start + length + noise.settle_s * float(np.log(size / noise.position_rms_m))
    return Loss(start, start + length, settled, step)


def disturbed_poses(poses: Poses, times: Array, noise: TrackerNoise, rng: np.random.Generator) -> Poses:
    """Poses with correlated noise added (latency is a matter of when the path is sampled)."""
    wander = _correlated_noise(times, noise.correlation_s, rng)
    sigma = noise.position_rms_m / np.sqrt(3.0)
    angle = np.radians(noise.rotation_rms_deg) / np.sqrt(3.0)
    position = poses[0] + sigma * wander[:, :3]
    return position, quaternion_product(poses[1], quaternion_from_vector(angle * wander[:, 3:]))


def _correlated_noise(times: Array, correlation_s: float, rng: np.random.Generator) -> Array:
    """Six series of unit variance whose correlation falls exponentially with the true time between samples."""
    fresh = rng.normal(size=(len(times), 6))
    keep = np.exp(-np.diff(times) / correlation_s)
    add = np.sqrt(1.0 - keep**2)
    series = fresh.copy()
    for row, (old, new) in enumerate(zip(keep.tolist(), add.tolist(), strict=True), start=1):
        series[row] = old * series[row - 1] + new * fresh[row]
    return series


def with_losses(
    poses: Poses, times: Array, losses: Sequence[Loss], noise: TrackerNoise
) -> tuple[Poses, NDArray[np.bool_]]:
    """Poses and validity with losses put in: while lost, flagged and drifting from the last good pose to the step."""
    position, quaternion = poses[0].copy(), poses[1].copy()
    valid = np.ones(len(times), dtype=np.bool_)
    for loss in losses:
        lost = (times >= loss.start) & (times < loss.end)
        after = times >= loss.end
        position[after] += np.exp(-(times[after] - loss.end) / noise.settle_s)[:, None] * loss.step
        last = max(0, int(np.searchsorted(times, loss.start)) - 1)
        fraction = (times[lost] - loss.start) / (loss.end - loss.start)
        position[lost] = position[last] + fraction[:, None] * loss.step
        quaternion[lost] = quaternion[last]
        valid[lost] = False
    return (position, quaternion), valid
