"""The short way to write a detector: say which pairs touch in one frame, and this class does the rest."""

import sys
import traceback
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from cdcore.errors import InvalidPairError, OwnDetectorError
from cdcore.numerics import ByteArray, FloatArray, IntArray
from cdcore.protocol.blocks import pair_has_pose
from cdcore.protocol.body import Body
from cdcore.protocol.detection import Detection
from cdcore.protocol.motion import Motion
from cdcore.protocol.pair_detector import PairDetector
from cdcore.protocol.verdict import Verdict

Answer: TypeAlias = "NDArray[np.bool_] | NDArray[np.uint8] | Sequence[bool] | Sequence[Verdict]"
"""What ``look`` may say."""


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

    name = "frame"
    online = True
    Settings = NoSettings

    def __init_subclass__(cls) -> None:
        if "name" not in cls.__dict__:
            cls.name = cls.__name__

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, settings: Any = None) -> None:
        super().__init__(bodies, pairs, self.Settings() if settings is None else settings)

    def prepare(self) -> None:
        """Forget what earlier frames said."""

    @abstractmethod
    def look(self, rotations: FloatArray, translations: FloatArray) -> Answer:
        """Say of each pair whether it touches, (P,) bool, or its ``Verdict``: (P,) uint8 values, or the members.

        Parameters
        ----------
        rotations, translations : (N, 3, 3) and (N, 3), body to world, metres, of this frame. Pairs with a body that
            has no pose are NO_POSE, whatever is answered.

        Distances, counts and other numbers are refused: cast, they would be verdicts that nobody meant.
        """

    def _fresh_memory(self) -> list[int]:
        self.prepare()
        return [0]

    def _run(self, motion: Motion, memory: list[int], _faces: bool) -> Detection:
        verdict = np.zeros((len(motion), len(self.pairs)), dtype=np.uint8)
        seconds = np.zeros(len(motion))
        for frame in range(len(motion)):
            begin = perf_counter()
            try:
                answer = self.look(motion.rotations[frame], motion.translations[frame])
            except Exception as error:
                raise own_failure(f"in look, frame {memory[0] + frame}", type(self), error) from error
            seconds[frame] = perf_counter() - begin
            verdict[frame] = self._as_verdicts(answer)
        memory[0] += len(motion)
        verdict[~pair_has_pose(motion, self.pairs)] = Verdict.NO_POSE
        refused = ("refused: not tested",) * len(self.pairs)
        work = {"looks": len(motion)}
        return self._detection(motion, verdict, containment=refused, work=work, seconds={"look": seconds})

    def _as_verdicts(self, answer: Any) -> ByteArray:
        """The answer of a look as verdicts, (P,) uint8."""
        verdicts = np.asarray(answer)
        if verdicts.shape != (len(self.pairs),):
            raise InvalidPairError(
                f"{self.name}.look answered with shape {verdicts.shape}; give one per pair: ({len(self.pairs)},)"
            )
        members = not isinstance(answer, np.ndarray) and all(isinstance(member, Verdict) for member in answer)
        if members or verdicts.dtype == bool:
            return verdicts.astype(np.uint8)
        if verdicts.dtype == np.uint8 and verdicts.max() <= max(Verdict):
            return verdicts
        what = (
            verdicts.dtype
            if verdicts.dtype != np.uint8
            else f"uint8 with the value {verdicts.max()}, which is no Verdict"
        )
        raise OwnDetectorError(
            f"{self.name}.look answered with {what}; answer with bools, uint8 values of Verdict, or Verdict members"
        )


def own_failure(doing: str, kind: type, error: Exception) -> OwnDetectorError:
    """Returns the error to raise for an exception in somebody's detector: it names class, file and line.

    The line is the last one in the file of the class: a mistake is seldom in the library that it calls.
    """
    steps = traceback.extract_tb(error.__traceback__)
    file = getattr(sys.modules.get(kind.__module__), "__file__", None)
    at = next((step for step in reversed(steps) if step.filename == file), steps[-1])
    what = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
    return OwnDetectorError(f"{kind.__name__} failed {doing}: {what} ({at.filename}, line {at.lineno})")
