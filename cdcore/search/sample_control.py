"""``samples="auto"``: how many faces to sample and how long to search, set from elapsed work and hit rate as it runs.

The paper asks that the number of feature samples be adjusted in real time for speed and accuracy. Here every candidate
of a frame is probed from where it was closest; what is left of the frame's budget goes to the pairs that came closest,
nearest first, and no more of it than past hits have needed. Where a contact of the frame before is not found again, one
frame in 25 may run on: most of what a search misses lies between two frames in which it hit.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from cdcore.numerics import FloatArray

LEVELS = (1, 4, 16)
"""Shares of a mesh's faces that are sampled: all, a quarter, a sixteenth."""
LEAST_SAMPLE = 64
"""Faces below which a sample is not thinned."""
PROBE = 192
"""Evaluations in which a warm start has found its valley: a few steps to 28 neighbours each."""
ENOUGH = 8
"""Hits from which on what hits have needed is believed."""
FORGET = 256
"""Hits after which all counts are halved, so that a session that changes is followed."""
EXPLORE = 16
"""Every so many pairs that promise nothing get a search all the same."""
TRY_LEVEL = 64
"""Every so many searches another level is tried: more often, the budget for it is missed elsewhere."""
SAFETY = 2.0
"""Times what past hits have needed: a hit that would have needed more was never seen."""
OVERRUNS = 0.04
"""Share of frames that may take more than their budget: with one in twenty its 95th percentile would be at stake."""
RUN_ON = 3
"""Times its budget that such a frame may take beyond it."""
BANDS = 10
"""Bands of distance: balls of the closest faces overlap, then doubling from an eighth of their size."""


def band_of(gap: float) -> int:
    """Band of a gap between the balls of two faces, in units of their mean size: 0 for overlap, else 1 to 9."""
    if not gap > 0.0:
        return 0
    return 1 + max(0, min(math.floor(math.log2(min(gap, 2.0**BANDS))) + 3, BANDS - 2))


@dataclass(eq=False)
class SampleControl:
    """What the searches of a session so far have taught."""

    frame_budget: int
    """Evaluations a frame may take, all its pairs together; at most one in 25 of the frames so far takes more, up to
    four times as many."""
    target_recall: float
    """Share of the hits to be had for the whole budget that is to be had for less."""
    searches: int = 0
    passed_over: int = 0
    frames: int = 0
    overruns: int = 0
    hits: FloatArray = field(default_factory=lambda: np.zeros(BANDS))
    needed: FloatArray = field(default_factory=lambda: np.zeros(64))
    """Hits by the power of two of evaluations they took."""
    level_hits: FloatArray = field(default_factory=lambda: np.zeros(len(LEVELS)))
    level_work: FloatArray = field(default_factory=lambda: np.zeros(len(LEVELS)))

    def level(self) -> int:
        """Which of ``LEVELS`` a search beyond its probe samples: the one with most hits for its work.

        Thinner samples are tried now and then, and taken only after ``ENOUGH`` hits of their own: what is not in the
        sample is missed however long the search.
        """
        self.searches += 1
        if self.searches % TRY_LEVEL == 0:
            return (self.searches // TRY_LEVEL) % len(LEVELS)
        rate = self.level_hits / (self.level_work + 1.0)
        rate[1:][self.level_hits[1:] < ENOUGH] = 0.0
        return int(np.argmax(rate))

    def allowance(self, band: int, left: int, pairs: int) -> int:
        """Evaluations a pair in this band may take, of those left to it and the pairs after it."""
        total = float(self.hits.sum())
        if total < ENOUGH:
            return left // pairs
        # a share of 99 % is known from a hundred hits on, not from eight
        known = total * (1.0 - self.target_recall) >= 1.0
        if known and float(self.hits[:band].sum()) >= self.target_recall * total:
            self.passed_over += 1
            return left // pairs if self.passed_over % EXPLORE == 0 else 0
        enough = int(np.searchsorted(np.cumsum(self.needed), self.target_recall * float(self.needed.sum())))
        return int(min(left // pairs, SAFETY * 2.0**enough))

    def begin(self) -> int:
        """Another frame with candidates; returns its budget."""
        self.frames += 1
        return self.frame_budget

    def run_on(self) -> int:
        """Evaluations beyond its budget for a frame that has lost a contact of the frame before; asked once a frame."""
        if self.overruns + 1 > OVERRUNS * self.frames:
            return 0
        self.overruns += 1
        return RUN_ON * self.frame_budget

    def learn(self, level: int, band: int, evaluations: int, hit: bool) -> None:
        """Take in a search beyond its probe."""
        self.level_work[level] += evaluations
        if not hit:
            return
        self.level_hits[level] += 1
        self.hits[band] += 1
        self.needed[max(0, evaluations).bit_length()] += 1
        if self.hits.sum() >= FORGET:
            for counts in (self.hits, self.needed, self.level_hits, self.level_work):
                counts /= 2
