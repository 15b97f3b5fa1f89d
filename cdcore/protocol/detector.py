"""What every detector looks like from outside, so that one can stand in another's place."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, ClassVar, Protocol, runtime_checkable

from cdcore.protocol.detection import Detection
from cdcore.protocol.motion import Motion


@runtime_checkable
class Detector(Protocol):
    """Decides about pairs of bodies over a motion.

    All preparation (trees, spheres) happens in ``__init__(bodies, pairs, settings)``; ``detect`` may be called again
    and again. ``online`` is True for a detector that decides frame by frame in order, as a live engine would.
    ``Settings`` is the frozen dataclass of its settings; ``settings`` is the one in force, printed into results.
    """

    name: ClassVar[str]
    online: ClassVar[bool]
    Settings: ClassVar[type]

    @property
    def settings(self) -> Any:
        """The settings in force."""
        ...

    def detect(self, motion: Motion, *, faces: bool = False) -> Detection:
        """Answer for every frame and pair of the whole motion; face pairs on request."""
        ...

    def stream(self, motions: Iterable[Motion], *, faces: bool = False) -> Iterator[Detection]:
        """Answer block by block; the joined answers equal those of ``detect`` on the whole, for any block size."""
        ...
