"""How deep two bodies are in each other during a contact or a miss, at the worst of some frames of it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import isnan, nan
from typing import Final

from cdcore.numerics import FloatArray
from replay.auditing.fault import Fault
from replay.auditing.outcome import Episode
from replay.auditing.sample_budget import spread_frames
from replay.cutting.solid_overlap import Overlap, Solid, common_solid, overlap_of, solid_of
from replay.prepare.assembly import Assembly

FRAMES: Final = 5
"""Frames of a contact whose common volumes are compared, 2 ms each with meshes of 3,000 faces."""

FRAMES_TOTAL: Final = 900
"""The same of all contacts and misses together."""

MOST_MEASURED: Final = 200
"""Contacts and misses whose depth is measured, 0.1 s each; of more, the longest ones."""

TOO_MANY: Final = "too many contacts were to be measured"

Segment = tuple[int, int, int]
"""Column of a pair, first and last frame."""


@dataclass(frozen=True)
class ContactDepth:
    """Depth and common volume at the frame with the largest common volume of those that were compared.

    Parameters
    ----------
    depth : metres from the deepest point of one body in the other to the other's surface; nan: not measured.
    volume : cubic metres in common; nan: not measured.
    frame : where that is.
    reason : why it was not measured, as a clause; ``""``: it was.
    """

    depth: float = nan
    volume: float = nan
    frame: int = 0
    reason: str = ""

    @property
    def measured(self) -> bool:
        """Whether there is a depth."""
        return not isnan(self.depth)


class DepthMeter:
    """Measures depths of pairs of an assembly, each segment once."""

    def __init__(self, assembly: Assembly) -> None:
        self._assembly = assembly
        self._measured: dict[Segment, ContactDepth] = {}
        self._overlaps: dict[tuple[int, int], Overlap] = {}

    def measure(self, segments: Iterable[Segment]) -> None:
        """Measure segments, the longest first, until the budget is used up."""
        queried = sorted({*segments}, key=lambda segment: segment[1] - segment[2])
        frames = max(1, min(FRAMES, FRAMES_TOTAL // max(1, len(queried))))
        for number, segment in enumerate(queried):
            if number < MOST_MEASURED:
                self._measured[segment] = self._worst(segment, frames)
            else:
                self._measured[segment] = ContactDepth(frame=segment[1], reason=TOO_MANY)

    def of(self, segment: Segment) -> ContactDepth:
        """The depth of a segment that was measured."""
        return self._measured[segment]

    @cached_property
    def _solids(self) -> tuple[Solid, ...]:
        return tuple(solid_of(body.mesh) for body in self._assembly.bodies)

    def _worst(self, segment: Segment, most: int) -> ContactDepth:
        pair, first, last = segment
        a, b = (self._solids[index] for index in self._assembly.pairs[pair].tolist())
        names = self._assembly.bodies_of(pair)
        reasons = [f"{name} {solid.reason}" for name, solid in zip(names, (a, b), strict=True) if solid.reason]
        if reasons:
            return ContactDepth(frame=first, reason=" and ".join(reasons))
        frames = [frame for frame in spread_frames(first, last, most).tolist() if self._has_pose(frame, pair)]
        if not frames:
            return ContactDepth(frame=first, reason="a pose is lost")
        volumes = {frame: common_solid(a, b, *self._relative(frame, pair)).volume() for frame in frames}
        worst = max(volumes, key=lambda frame: volumes[frame]) if len(frames) > 1 else frames[0]
        if (worst, pair) not in self._overlaps:
            self._overlaps[worst, pair] = overlap_of(a, b, *self._relative(worst, pair))
        overlap = self._overlaps[worst, pair]
        return ContactDepth(depth=overlap.depth, volume=overlap.volume, frame=worst)

    def _has_pose(self, frame: int, pair: int) -> bool:
        return bool(self._assembly.motion.valid[frame, self._assembly.pairs[pair]].all())

    def _relative(self, frame: int, pair: int) -> tuple[FloatArray, FloatArray]:
        """Pose of the first body of a pair in the axes of the second."""
        motion = self._assembly.motion
        a, b = self._assembly.pairs[pair].tolist()
        to_second = motion.rotations[frame, b].T
        between = motion.translations[frame, a] - motion.translations[frame, b]
        return to_second @ motion.rotations[frame, a], to_second @ between


def contact_depths(
    assembly: Assembly, contacts: Sequence[Episode], misses: Mapping[str, Sequence[Fault]]
) -> tuple[tuple[ContactDepth, ...], dict[str, tuple[Fault, ...]]]:
    """Return the depth of each contact of the reference, and the misses of each detector with theirs."""
    meter = DepthMeter(assembly)
    every = [miss for of_detector in misses.values() for miss in of_detector]
    segments = [(contact.pair, contact.first, contact.last) for contact in contacts]
    meter.measure([*segments, *((miss.pair, miss.first, miss.last) for miss in every)])
    depths = tuple(meter.of((contact.pair, contact.first, contact.last)) for contact in contacts)
    measured = {
        label: tuple(
            replace(miss, depth=depth.depth, volume=depth.volume, not_measured=depth.reason)
            for miss in of_detector
            for depth in (meter.of((miss.pair, miss.first, miss.last)),)
        )
        for label, of_detector in misses.items()
    }
    return depths, measured


def deepest(depths: Iterable[ContactDepth]) -> ContactDepth | None:
    """The deepest of those that were measured; ``None``: none was."""
    return max((depth for depth in depths if depth.measured), key=lambda depth: depth.depth, default=None)
