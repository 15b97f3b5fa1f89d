"""A detector asked live: one frame after the other, as an engine asks, with what a look costs by stage."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from time import perf_counter
from typing import Final, Protocol

import numpy as np

from cdcore.numerics import ByteArray
from cdcore.protocol.detection import Detection, join
from cdcore.protocol.detector import Detector
from cdcore.protocol.motion import Motion, blocks_in_order

REST: Final = "rest"
"""The stage of what a look took beside its other stages."""


class Live(Protocol):
    """A session of looks: what is learned in one is there for the next."""

    @property
    def seconds(self) -> dict[str, float]:
        """Seconds of the last sample, by stage."""
        ...

    @property
    def work(self) -> Counter[str]:
        """Counters of all looks so far."""
        ...

    def look(self, now: Motion) -> ByteArray:
        """Verdicts of all pairs, (P,), in a motion of one frame, later than the one before; not to be written to."""
        ...


class LiveBlocks:
    """Looks of a detector that answers any block: each frame is a block."""

    def __init__(self, answer: Callable[[Motion], Detection]) -> None:
        self._answer = answer
        self.seconds: dict[str, float] = {}
        self.work: Counter[str] = Counter()
        self.reasons: dict[int, str] = {}
        """By pair, why the last look left it undecided, where the detector noted that."""

    def look(self, now: Motion) -> ByteArray:
        """Verdicts of all pairs (P,) in a motion of one frame; see ``Live.look``."""
        detection = self._answer(now)
        self.seconds = {stage: float(np.sum(spent)) for stage, spent in detection.seconds.items()}
        self.work.update({name: int(np.sum(count)) for name, count in detection.work.items()})
        self.reasons = {pair: why for (_, pair), why in detection.noted_reasons.items()}
        verdict: ByteArray = detection.verdict[0]
        return verdict


def detect_live(detector: Detector, motion: Motion) -> Detection:
    """Ask frame after frame; every frame is timed from outside, and what no stage took is the stage ``rest``.

    Verdicts only: no faces.
    """
    return join(stream_live(detector, [motion]))


def stream_live(detector: Detector, motions: Iterable[Motion]) -> Iterator[Detection]:
    """Runs ``detect_live`` block by block, in one session."""
    head: Detection | None = None
    for motion in blocks_in_order(motions):
        if head is None:
            # It says what does not change from frame to frame; asked before the session, which it would make forget.
            head, session = detector.detect(motion.frames(0, 1)), live_session(detector)
        yield _live_samples(head, session, motion)


def live_session(detector: Detector) -> Live:
    """A session of a detector; of one without ``live`` its stream, in blocks of one frame."""
    if hasattr(detector, "live"):
        live: Live = detector.live()
        return live
    pending: list[Motion] = []
    answers = detector.stream(iter(pending.pop, None))

    def answer(now: Motion) -> Detection:
        pending.append(now)
        return next(answers)

    return LiveBlocks(answer)


def _live_samples(head: Detection, session: Live, motion: Motion) -> Detection:
    before = session.work.copy()
    verdict = np.empty((len(motion), len(head.pairs)), dtype=np.uint8)
    spent, whole = [], np.zeros(len(motion))
    reasons: dict[tuple[int, int], str] = {}
    for k in range(len(motion)):
        now = motion.frames(k, k + 1)
        start = perf_counter()
        verdict[k] = session.look(now)
        whole[k] = perf_counter() - start
        spent.append(session.seconds)
        if isinstance(session, LiveBlocks):
            reasons |= {(k, pair): why for pair, why in session.reasons.items()}
    stages = dict.fromkeys(stage for stage_seconds in spent for stage in stage_seconds)
    seconds = {stage: np.array([stage_seconds.get(stage, 0.0) for stage_seconds in spent]) for stage in stages}
    seconds[REST] = np.maximum(whole - sum(seconds.values(), np.zeros(len(motion))), 0.0)
    work = {name: count - before[name] for name, count in session.work.items()}
    return replace(
        head,
        times=motion.times,
        verdict=verdict,
        work=work,
        seconds=seconds,
        reasons=reasons,
        toi={},
        section_source=None,
    )
