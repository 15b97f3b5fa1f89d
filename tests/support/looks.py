"""Which episodes a detector misses that tests fewer instants than there are frames: exactly those between two tests."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sessions.synthetic.truth import Interval, PlantedEpisode, Truth, inside

# A stamp is rounded to a nanosecond, so a tick that falls on a stamp may come out one below or above it.
TICK_SLACK_NS = 1


@dataclass(frozen=True)
class Prediction:
    """What a detector at a lower rate will make of each contact episode, from the closed form alone.

    ``caught``: at least one look falls surely into the episode. ``missed``: no look falls possibly into it, but at
    least one recorded frame surely does. ``unseen``: no recorded frame falls possibly into it, so that no detector of
    instants can see it at any rate. ``undecided``: tessellation or noise decides.
    """

    caught: tuple[PlantedEpisode, ...]
    missed: tuple[PlantedEpisode, ...]
    unseen: tuple[PlantedEpisode, ...]
    undecided: tuple[PlantedEpisode, ...]


def looks(stamps_ns: ArrayLike, rate_hz: float) -> NDArray[np.int64]:
    """Indices of the frames at which a detector of this rate looks: the first frame at or after each tick.

    Ticks are k / rate after the first stamp. A frame serves at most once, so after a gap ticks are skipped, as in a
    live engine that is late. ValueError for a rate that is not positive.
    """
    if not rate_hz > 0.0:
        raise ValueError(f"a detector cannot look at {rate_hz} Hz; give a positive rate")
    stamps = np.asarray(stamps_ns, dtype=np.int64)
    if not len(stamps):
        return np.zeros(0, dtype=np.int64)
    count = int(np.floor((stamps[-1] - stamps[0]) * 1e-9 * rate_hz)) + 2
    ticks = stamps[0] + np.floor(np.arange(count) * (1e9 / rate_hz)).astype(np.int64)
    frames = np.searchsorted(stamps, ticks - TICK_SLACK_NS, side="left")
    return np.unique(frames[frames < len(stamps)]).astype(np.int64)


def predicted(truth: Truth, stamps_ns: ArrayLike, rate_hz: float) -> Prediction:
    """Say which contact episodes a detector that looks at ``rate_hz`` catches and misses."""
    frames = truth.seconds_of(stamps_ns)
    seen = frames[looks(stamps_ns, rate_hz)]
    groups: dict[str, list[PlantedEpisode]] = {"caught": [], "missed": [], "unseen": [], "undecided": []}
    for episode in truth.episodes:
        if episode.kind == "contact" and episode.nominal is not None:
            groups[_fate(episode, frames, seen)].append(episode)
    return Prediction(**{name: tuple(found) for name, found in groups.items()})


def _fate(episode: PlantedEpisode, frames: NDArray[np.float64], seen: NDArray[np.float64]) -> str:
    if _any(seen, episode.surely):
        return "caught"
    if not _any(frames, episode.possibly):
        return "unseen"
    if _any(frames, episode.surely) and not _any(seen, episode.possibly):
        return "missed"
    return "undecided"


def _any(times: NDArray[np.float64], span: Interval | None) -> bool:
    return span is not None and bool(inside(times, span).any())
