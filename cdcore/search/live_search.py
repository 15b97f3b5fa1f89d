"""A search asked one frame after the other: volumes of all pairs in one call, then the pairs that may meet."""

from collections import Counter

from cdcore.broad.broad_phase import BroadPhase
from cdcore.broad.live_pairs import LivePairs
from cdcore.protocol import Motion, Verdict
from cdcore.search.stage import SearchAnswer, SearchStage


class LiveSearch(LivePairs):
    """Looks of ``search`` at the pairs that ``volumes`` leave: CONTACT where it confirms one, else NOT_FOUND."""

    def __init__(self, volumes: BroadPhase, search: SearchStage) -> None:
        memory = search.fresh_memory()
        self._answer = SearchAnswer((1, len(memory)), faces=False)

        def decide(now: Motion, column: int, _margin: float) -> tuple[int, bool]:
            meets = search.decide_frame(now, 0, column, memory[column], self._answer)
            return int(Verdict.CONTACT if meets else Verdict.NOT_FOUND), False

        super().__init__(volumes, decide, None)

    @property
    def seconds(self) -> dict[str, float]:
        """Seconds of the last sample, by stage."""
        seconds = super().seconds
        return {"volumes": seconds["volumes"], "search": seconds["surfaces"]}

    @property
    def work(self) -> Counter[str]:
        """Counters of all samples so far."""
        return Counter(self._answer.work)
