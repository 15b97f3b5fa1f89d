"""The short way to a detector of one's own: say which pairs touch in one frame, the rest is here."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cdcore.errors import InvalidPairError
from cdcore.numerics import FloatArray
from cdcore.protocol.blocks import blocks_in_order, pair_has_pose, require_bodies
from cdcore.protocol.body import Body
from cdcore.protocol.detection import Detection
from cdcore.protocol.motion import Motion
from cdcore.protocol.verdict import Verdict


@dataclass(frozen=True)
class NoSettings:
    """Nothing can be set."""


class FrameDetector(ABC):
    """Decides frame by frame with ``look``, which a class of your own defines; every frame is timed.

    ``self.bodies`` and ``self.pairs`` ((P, 2) body numbers) are there; ``prepare`` is called before the first frame of
    every motion, for what goes from frame to frame. ``Settings`` may be a frozen dataclass of your own.

    Examples
    --------
    >>> class Nothing(FrameDetector):
    ...     def look(self, rotations, translations):
    ...         return [False] * len(self.pairs)
    >>> Nothing.name
    'Nothing'
    """

    name: ClassVar[str] = "frame"
    online: ClassVar[bool] = True
    Settings: ClassVar[type] = NoSettings

    def __init_subclass__(cls) -> None:
        if "name" not in cls.__dict__:
            cls.name = cls.__name__

    def __init__(self, bodies: Sequence[Body], pairs: NDArray[np.int64], settings: Any = None) -> None:
        self.bodies = tuple(bodies)
        self.pairs = pairs
        self.settings = self.Settings() if settings is None else settings

    def prepare(self) -> None:  # noqa: B027 - most detectors keep nothing from frame to frame
        """Forget what earlier frames said."""

    @abstractmethod
    def look(self, rotations: FloatArray, translations: FloatArray) -> ArrayLike:
        """Say of each pair whether it touches, (P,) bool, or its ``Verdict``.

        Parameters
        ----------
        rotations, translations : (N, 3, 3) and (N, 3), body to world, metres, of this frame. Pairs with a body that
            has no pose are NO_POSE, whatever is answered.
        """

    def detect(self, motion: Motion, *, faces: bool = False) -> Detection:
        """Answer for every frame in order; there are no faces."""
        del faces
        self.prepare()
        return self._run(motion)

    def stream(self, motions: Iterable[Motion], *, faces: bool = False) -> Iterator[Detection]:
        """Answer block by block, as if the blocks were one motion."""
        del faces
        self.prepare()
        for motion in blocks_in_order(motions):
            yield self._run(motion)

    def _run(self, motion: Motion) -> Detection:
        require_bodies(motion, self.bodies)
        verdict = np.zeros((len(motion), len(self.pairs)), dtype=np.uint8)
        seconds = np.zeros(len(motion))
        for frame in range(len(motion)):
            begin = perf_counter()
            answer = np.asarray(self.look(motion.rotations[frame], motion.translations[frame]))
            seconds[frame] = perf_counter() - begin
            if answer.shape != (len(self.pairs),):
                raise InvalidPairError(
                    f"{self.name}.look answered with shape {answer.shape}; give one per pair: ({len(self.pairs)},)"
                )
            verdict[frame] = answer
        verdict[~pair_has_pose(motion, self.pairs)] = Verdict.NO_POSE
        return Detection(
            detector=self.name,
            names=tuple(body.name for body in self.bodies),
            pairs=self.pairs,
            times=motion.times,
            verdict=verdict,
            containment=("refused: not asked",) * len(self.pairs),
            work={"looks": len(motion)},
            seconds={"look": seconds},
        )
