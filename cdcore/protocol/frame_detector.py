"""The short way to write a detector: say which pairs touch in one frame, and this class does the rest."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from cdcore.errors import InvalidPairError
from cdcore.numerics import FloatArray, IntArray
from cdcore.protocol.blocks import pair_has_pose
from cdcore.protocol.body import Body
from cdcore.protocol.detection import Detection
from cdcore.protocol.motion import Motion
from cdcore.protocol.pair_detector import PairDetector
from cdcore.protocol.verdict import Verdict


@dataclass(frozen=True)
class NoSettings:
    """Nothing can be set."""


class FrameDetector(PairDetector[Any]):
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

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, settings: Any = None) -> None:
        super().__init__(bodies, pairs, self.Settings() if settings is None else settings)

    def prepare(self) -> None:
        """Forget what earlier frames said."""

    @abstractmethod
    def look(self, rotations: FloatArray, translations: FloatArray) -> ArrayLike:
        """Say of each pair whether it touches, (P,) bool, or its ``Verdict``.

        Parameters
        ----------
        rotations, translations : (N, 3, 3) and (N, 3), body to world, metres, of this frame. Pairs with a body that
            has no pose are NO_POSE, also where contact is answered.
        """

    def _fresh_memory(self) -> None:
        self.prepare()

    def _run(self, motion: Motion, memory: None, faces: bool) -> Detection:
        del memory, faces
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
        refused = ("refused: not asked",) * len(self.pairs)
        work = {"looks": len(motion)}
        return self._detection(motion, verdict, containment=refused, work=work, seconds={"look": seconds})
