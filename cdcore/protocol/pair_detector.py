"""The common part of all detectors: they keep their bodies, and answer a motion in blocks as they answer it whole."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, ClassVar, Generic, TypeVar

import numpy as np

from cdcore.numerics import BoolArray, ByteArray, IntArray
from cdcore.protocol.blocks import blocks_in_order, require_bodies
from cdcore.protocol.body import Body
from cdcore.protocol.detection import Detection
from cdcore.protocol.face_sets import FaceSets
from cdcore.protocol.live import Live, LiveBlocks
from cdcore.protocol.motion import Motion

SettingsT = TypeVar("SettingsT")


class PairDetector(ABC, Generic[SettingsT]):
    """Decides with ``_run``, to which ``_fresh_memory`` is handed from block to block.

    Derive from it for a detector over whole motions; from ``FrameDetector`` for one that looks at a frame at a time.
    """

    name: ClassVar[str]
    online: ClassVar[bool] = False
    Settings: ClassVar[type]
    sources: ClassVar[tuple[str, ...]]
    choose_when: ClassVar[str]
    cannot: ClassVar[str]
    stages: ClassVar[tuple[str, ...]]
    """Names of what is timed."""
    kind: ClassVar[str] = "own"
    """Whose answer it is: *own* method, *paper*, *re-creation* of an engine, or the *engine* itself."""

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, settings: SettingsT) -> None:
        self.bodies = tuple(bodies)
        self.pairs = pairs
        self.settings = settings

    def detect(self, motion: Motion, *, faces: bool = False) -> Detection:
        """Answer for every frame and pair of the motion; face pairs on request, where the detector knows any."""
        require_bodies(motion, self.bodies)
        return self._run(motion, self._fresh_memory(), faces)

    def stream(self, motions: Iterable[Motion], *, faces: bool = False) -> Iterator[Detection]:
        """Answer block by block, as if the blocks were one motion."""
        memory = self._fresh_memory()
        for motion in blocks_in_order(motions):
            require_bodies(motion, self.bodies)
            yield self._run(motion, memory, faces)

    def live(self) -> Live:
        """A session that is asked one frame after the other."""
        memory = self._fresh_memory()
        return LiveBlocks(lambda now: self._run(now, memory, False))

    def contact_reach(self, _pair: int) -> float:
        """Metres between two surfaces from which it reports contact of a pair: its contact offset, on both sides."""
        return 0.0

    def faces_of(self, _motion: Motion, _hits: BoolArray) -> FaceSets | None:
        """The face pairs of contacts that it found, ``hits`` (T, P); ``None`` where only all its work again tells."""
        return None

    def _fresh_memory(self) -> Any:
        """Returns the state that passes from block to block, as it is before the first; none by default."""
        return None

    @abstractmethod
    def _run(self, motion: Motion, memory: Any, faces: bool) -> Detection:
        """Answer for one block, and bring the memory up to date."""

    def _seconds(self, clock: list[float]) -> dict[str, float]:
        """Seconds of each of ``stages``, from readings of the performance counter before and after each of them."""
        return dict(zip(self.stages, np.diff(clock).tolist(), strict=False))

    def _detection(
        self,
        motion: Motion,
        verdict: ByteArray,
        *,
        containment: Sequence[str],
        work: Mapping[str, int],
        seconds: Mapping[str, Any],
        **more: Any,
    ) -> Detection:
        """A detection by this detector; ``more`` are its further fields."""
        return Detection(
            detector=self.name,
            names=tuple(body.name for body in self.bodies),
            pairs=self.pairs,
            times=motion.times,
            verdict=verdict,
            containment=tuple(containment),
            work=dict(work),
            seconds=dict(seconds),
            **more,
        )
