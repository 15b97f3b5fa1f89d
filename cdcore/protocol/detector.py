"""The protocol of every detector, so that one can replace another."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, ClassVar, Protocol, runtime_checkable

from cdcore.numerics import IntArray
from cdcore.protocol.detection import Detection
from cdcore.protocol.motion import Motion


@dataclass(frozen=True, kw_only=True)
class Explanation:
    """Answers of the stages; ``None``: the detector has no such stage, or it did not run there.

    Parameters
    ----------
    looked : whether it tested this frame; False: it holds the answer of an earlier one.
    shapes_meet : whether the shapes it puts in place of the meshes meet.
    spheres_meet : whether the bounding spheres overlap.
    boxes_meet : whether the bounding boxes do, which are tested where the spheres overlap.
    sample_meets : whether a pair of faces that meets is among those it may draw.
    found_with_more : whether the search finds one with ten times the budget.
    within_clock : whether the frame lies within the uncertainty of the detector's clock.
    """

    looked: bool | None = None
    shapes_meet: bool | None = None
    spheres_meet: bool | None = None
    boxes_meet: bool | None = None
    sample_meets: bool | None = None
    found_with_more: bool | None = None
    within_clock: bool | None = None


@runtime_checkable
class Explains(Protocol):
    """A detector that can say, afterwards, where it lost a contact. A detector need not have this method."""

    def explain(self, motion: Motion, frame: int, pair: int, faces: IntArray) -> Explanation:
        """Decide one pair in one frame again, stage by stage.

        Parameters
        ----------
        motion : the motion that was detected.
        frame, pair : row and column of its answer.
        faces : (k, 2) the face pairs that meet there, by an exact detector; empty for one body inside another.
        """


@runtime_checkable
class Detector(Protocol):
    """Decides about pairs of bodies over a motion.

    All preparation (trees, spheres) happens in ``__init__(bodies, pairs, settings)``; ``detect`` may be called again
    and again. ``online`` is True for a detector that can be asked live: one frame after the other, as an engine asks.
    ``Settings`` is the frozen dataclass of its settings; ``settings`` is the one in force, printed into results.
    """

    name: ClassVar[str]
    online: ClassVar[bool]
    Settings: ClassVar[type]

    @property
    def settings(self) -> Any:
        """The settings in force."""

    def detect(self, motion: Motion, *, faces: bool = False) -> Detection:
        """Answer for every frame and pair of the whole motion; face pairs on request."""

    def stream(self, motions: Iterable[Motion], *, faces: bool = False) -> Iterator[Detection]:
        """Answer block by block; the joined answers equal those of ``detect`` on the whole, for any block size."""
