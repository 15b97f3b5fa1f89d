"""A search asked one frame after the other: volumes of all pairs in one call, then the pairs that may meet."""

from collections import Counter
from time import perf_counter

import numpy as np

from cdcore.broad.broad_looks import BroadLooks
from cdcore.broad.broad_phase import BroadPhase
from cdcore.numerics import ByteArray
from cdcore.protocol import Motion, Verdict
from cdcore.search.stage import COUNTERS, SearchAnswer, SearchStage

CONTACT, NOT_FOUND, NO_POSE = (np.uint8(word) for word in (Verdict.CONTACT, Verdict.NOT_FOUND, Verdict.NO_POSE))


class LiveSearch:
    """Looks of ``search`` at the pairs that ``volumes`` leave: CONTACT where it confirms one, else NOT_FOUND."""

    def __init__(self, volumes: BroadPhase, search: SearchStage) -> None:
        self._volumes, self._search, self._memory = BroadLooks(volumes), search, search.fresh_memory()
        self.seconds: dict[str, float] = {}
        self.work: Counter[str] = Counter(dict.fromkeys((*COUNTERS, "mesh_queries"), 0))

    def look(self, now: Motion) -> ByteArray:
        """As ``Live.look``."""
        start, verdict = perf_counter(), self._volumes.verdict
        # A pair that stands is searched again too: what rests got less than the whole budget before.
        verdict.fill(NO_POSE)
        columns = self._volumes.near(now)
        found = perf_counter()
        if columns:
            answer = SearchAnswer((1, len(verdict)), faces=False)
            self._search.decide_frame(now, 0, columns, self._memory, answer)
            verdict[columns] = NOT_FOUND
            verdict[answer.hits[0]] = CONTACT
            for name, count in answer.work.items():
                self.work[name] += count
        self.seconds = {"volumes": found - start, "search": perf_counter() - found}
        return verdict.copy()
