"""Which episodes a detector misses that tests fewer instants than there are frames: exactly those between two tests."""

from types import SimpleNamespace

import numpy as np

from sessions.synthetic.truth import inside

TICK_SLACK_NS = 1
"""A stamp is rounded to a nanosecond, so a tick that falls on a stamp may come out one below or above it."""


def looks(stamps_ns, rate_hz, offset_s=0.0):
    """Indices of the frames at which a detector of this rate looks: the first frame at or after each tick.

    Ticks are ``offset_s`` + k / rate after the first stamp. A frame serves at most once, so after a gap ticks are
    skipped, as in a live engine that is late.
    """
    stamps = np.asarray(stamps_ns, dtype=np.int64)
    count = int((stamps[-1] - stamps[0]) * 1e-9 * rate_hz) + 2
    ticks = stamps[0] + np.floor(1e9 * offset_s + np.arange(count) * (1e9 / rate_hz)).astype(np.int64)
    frames = np.searchsorted(stamps, ticks - TICK_SLACK_NS)
    return np.unique(frames[frames < len(stamps)])


def predicted(truth, stamps_ns, rate_hz, offset_s=0.0):
    """What a detector that looks at ``rate_hz`` will make of each contact episode, from the closed form alone.

    ``caught``: at least one look falls surely into the episode. ``missed``: no look falls possibly into it, but at
    least one recorded frame surely does. ``unseen``: no recorded frame falls possibly into it, so that no detector of
    instants can see it at any rate. ``undecided``: tessellation or noise decides.
    """
    frames = truth.seconds_of(stamps_ns)
    seen = frames[looks(stamps_ns, rate_hz, offset_s)]
    groups = SimpleNamespace(caught=[], missed=[], unseen=[], undecided=[])
    for episode in truth.episodes:
        if episode.kind == "contact" and episode.nominal is not None:
            getattr(groups, fate(episode, frames, seen)).append(episode)
    return groups


def fate(episode, frames, seen):
    surely = episode.surely or (np.inf, np.inf)
    if inside(seen, surely).any():
        return "caught"
    if not inside(frames, episode.possibly).any():
        return "unseen"
    return "missed" if inside(frames, surely).any() and not inside(seen, episode.possibly).any() else "undecided"
