"""Classes to derive a detector from: ``PairDetector`` over whole motions, ``FrameDetector`` for a frame at a time."""

import math
import sys
import traceback
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any, ClassVar, Generic, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from cdcore.errors import InvalidMeshError, InvalidPairError, InvalidPoseError, OwnDetectorError
from cdcore.numerics import BoolArray, ByteArray, FloatArray, IntArray
from cdcore.protocol.body import Body
from cdcore.protocol.detection import Detection, FaceSets
from cdcore.protocol.live import Live, LiveBlocks
from cdcore.protocol.motion import Motion, blocks_in_order, pair_has_pose
from cdcore.protocol.verdict import Verdict

SettingsT = TypeVar("SettingsT")

Answer: TypeAlias = "NDArray[np.bool_] | NDArray[np.uint8] | Sequence[bool] | Sequence[Verdict]"
"""What ``look`` may say."""


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
    largest_m: ClassVar[float] = math.inf
    """Metres from its origin that a body may reach at most; a larger one is refused."""

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, settings: SettingsT) -> None:
        for body in bodies:
            if (size_m := float(np.abs(body.mesh.bounds).max())) > self.largest_m:
                raise InvalidMeshError(
                    f"body {body.name!r} reaches {size_m:.1e} m from its origin, beyond all that is in nature; "
                    f"{self.name} decides up to {self.largest_m:.0e} m: give its vertices in metres"
                )
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


def require_bodies(motion: Motion, bodies: Sequence[Body]) -> None:
    """Refuse what is no motion, or one of another number of bodies than the detector has, with an InvalidPoseError."""
    if not isinstance(motion, Motion):
        raise InvalidPoseError(
            f"a detector takes a Motion, not {type(motion).__name__}; make one: "
            "cdcore.Motion(times, translations, rotations)"
        )
    posed = motion.valid.shape[1]
    if posed != len(bodies):
        names = ", ".join(body.name for body in bodies)
        raise InvalidPoseError(
            f"the motion has poses of {posed} bodies, the detector has {len(bodies)}; "
            f"give one column for each of: {names}"
        )


def contact_or_clear(hits: BoolArray, motion: Motion, pairs: IntArray) -> ByteArray:
    """Verdicts (T, P): CONTACT where a pair was hit, NO_POSE where a body has no pose, else CLEAR."""
    verdict: ByteArray = hits * np.uint8(Verdict.CONTACT)
    if not motion.valid.all():
        verdict[~pair_has_pose(motion, pairs)] = Verdict.NO_POSE
    return verdict


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


def own_failure(action: str, kind: type, error: Exception) -> OwnDetectorError:
    """Returns the error to raise for an exception in somebody's detector: it names class, file and line.

    The line is the last one in the file of the class: a mistake is seldom in the library that it calls.
    """
    steps = traceback.extract_tb(error.__traceback__)
    file = getattr(sys.modules.get(kind.__module__), "__file__", None)
    at = next((step for step in reversed(steps) if step.filename == file), steps[-1])
    what = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
    return OwnDetectorError(f"{kind.__name__} failed {action}: {what} ({at.filename}, line {at.lineno})")
