"""What a detector did with one pair in one frame, stage by stage: a miss gets its cause from the first that failed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from cdcore.numerics import IntArray
from cdcore.protocol.motion import Motion


@dataclass(frozen=True, kw_only=True)
class Explanation:
    """Answers of the stages; ``None``: the detector has no such stage.

    Parameters
    ----------
    looked : whether it looked at this frame at all, or holds an answer from before.
    shapes_meet : whether the shapes it puts in place of the meshes meet.
    spheres_meet : whether its volumes let the pair through to the triangles.
    sample_meets : whether a pair of faces that meets is among those it may draw.
    found_with_more : whether the search finds one with ten times the budget.
    within_clock : whether the frame lies within what is not known of the detector's clock.
    """

    looked: bool | None = None
    shapes_meet: bool | None = None
    spheres_meet: bool | None = None
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
        ...
