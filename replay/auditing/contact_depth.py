"""How deep two bodies are in each other during a contact or a miss, at the deepest frame of it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from math import isnan, nan
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray
from replay.auditing.fault import Fault
from replay.auditing.outcome import Episode
from replay.auditing.sample_budget import spread_frames
from replay.cutting.solid_overlap import Intersection, Solid, intersection_of, solid_of
from replay.prepare.assembly import Assembly

LEAST_FRAMES_SEARCHED: Final = 5
"""Frames of each contact that are searched for the deepest one where there are too many."""

FRAMES_SEARCHED: Final = 1500
"""Pair-frames of all contacts and misses that may be searched, 4 ms each with meshes of 3,000 faces."""

MOST_MEASURED_CONTACTS: Final = 200
"""Contacts and misses whose depth is measured, 20 ms each; of more, the longest ones."""

TOO_MANY_REASON: Final = "too many contacts were to be measured"

Segment = tuple[int, int, int]
"""Column of a pair, first and last frame."""


DepthsByPairAndFrame = Mapping[int, Mapping[int, float]]
"""Column of a pair -> frame of a contact -> metres that the bodies are in each other, at least."""


@dataclass(frozen=True)
class ContactDepth:
    """Depth and common volume at the deepest of the frames that were searched.

    Parameters
    ----------
    depth : metres from the deepest point of one body in the other to the other's surface; nan: not measured.
    volume : cubic metres in common; nan: not measured.
    frame : where that is.
    at_least : whether frames were left out of the search, so that another may be deeper.
    reason : why it was not measured, as a clause; ``""``: it was.
    """

    depth: float = nan
    volume: float = nan
    frame: int = 0
    at_least: bool = False
    reason: str = ""

    @property
    def is_measured(self) -> bool:
        """Whether there is a depth."""
        return not isnan(self.depth)


class DepthMeter:
    """Measures depths of pairs of an assembly, each segment once."""

    def __init__(self, assembly: Assembly) -> None:
        self._assembly = assembly
        self._measured_depths: dict[Segment, ContactDepth] = {}
        self._depths: dict[tuple[int, int], float] = {}
        self._searched_depths: dict[int, dict[int, tuple[float, float]]] = {}
        self._intersections: dict[int, Intersection | None] = {}  # of frames of the segment that is measured

    @property
    def series(self) -> DepthsByPairAndFrame:
        """Depths at the corners of the common parts, of every frame that was searched."""
        return {
            pair: {frame: depth for frame, (depth, _) in depths_by_frame.items()}
            for pair, depths_by_frame in self._searched_depths.items()
        }

    def measure(self, segments: Iterable[Segment]) -> None:
        """Measure segments, the longest first, until the budget is used up."""
        sorted_segments = sorted({*segments}, key=lambda segment: (segment[1] - segment[2], segment))
        measured_segments = sorted_segments[:MOST_MEASURED_CONTACTS]
        frame_count = len(
            {(pair, frame) for pair, first, last in measured_segments for frame in range(first, last + 1)}
        )
        most_frames = (
            frame_count
            if frame_count <= FRAMES_SEARCHED
            else max(LEAST_FRAMES_SEARCHED, FRAMES_SEARCHED // len(measured_segments))
        )
        for segment in measured_segments:
            self._measured_depths[segment] = self._deepest(segment, most_frames)
        for segment in sorted_segments[MOST_MEASURED_CONTACTS:]:
            self._measured_depths[segment] = ContactDepth(frame=segment[1], reason=TOO_MANY_REASON)

    def depth_of(self, segment: Segment) -> ContactDepth:
        """The depth of a segment that was measured."""
        return self._measured_depths[segment]

    @cached_property
    def _solids(self) -> tuple[Solid, ...]:
        return tuple(solid_of(body.mesh) for body in self._assembly.bodies)

    def _deepest(self, segment: Segment, most_frames: int) -> ContactDepth:
        """Depth at the frame of a segment, of at most so many, whose common part has the deepest corner."""
        pair, first, last = segment
        a, b = (self._solids[index] for index in self._assembly.pairs[pair].tolist())
        body_names = self._assembly.bodies_of(pair)
        reasons = [f"{name} {solid.reason}" for name, solid in zip(body_names, (a, b), strict=True) if solid.reason]
        if reasons:
            return ContactDepth(frame=first, reason=" and ".join(reasons))
        frames = [frame for frame in spread_frames(first, last, most_frames).tolist() if self._has_pose(frame, pair)]
        if not frames:
            return ContactDepth(frame=first, reason="a pose is lost")
        searched_depths = self._search(pair, frames)
        # Corners tell less of a thin wall than of a solid body: the largest common part is measured as well.
        deepest = max(frames, key=lambda frame: searched_depths.get(frame, (0.0, 0.0)))
        largest = max(frames, key=lambda frame: searched_depths.get(frame, (0.0, 0.0))[1])
        depths = {frame: self._depth(frame, pair) for frame in (deepest, largest)}
        frame = max(depths, key=lambda frame: depths[frame])
        depth = max(depths[frame], searched_depths[frame][0])
        at_least = most_frames < last - first + 1
        return ContactDepth(depth=depth, volume=searched_depths[frame][1], frame=frame, at_least=at_least)

    def _depth(self, frame: int, pair: int) -> float:
        """Depth of a pair in a frame, measured once."""
        if (frame, pair) not in self._depths:
            is_intersected = frame in self._intersections
            intersection = self._intersections[frame] if is_intersected else self._intersection(frame, pair)
            self._depths[frame, pair] = 0.0 if intersection is None else intersection.depth
        return self._depths[frame, pair]

    def _intersection(self, frame: int, pair: int) -> Intersection | None:
        a, b = (self._solids[index] for index in self._assembly.pairs[pair].tolist())
        return intersection_of(a, b, *self._relative_pose(frame, pair))

    def _search(self, pair: int, frames: Sequence[int]) -> Mapping[int, tuple[float, float]]:
        """Depth at corners and common volume in frames of a pair, but those that cannot be the deepest.

        No depth changes by more than the bodies move against each other.
        """
        self._intersections.clear()
        searched_depths = self._searched_depths.setdefault(pair, {})
        corners = self._box_corners(frames, pair)
        depth_bounds, deepest = np.full(len(frames), np.inf), 0.0
        for frame_index in _indices_by_halving(len(frames)):
            frame = frames[frame_index]
            if depth_bounds[frame_index] < deepest:
                continue
            if frame not in searched_depths:
                intersection = self._intersections[frame] = self._intersection(frame, pair)
                searched_depths[frame] = (
                    (0.0, 0.0) if intersection is None else (intersection.depth_at_corners, intersection.volume)
                )
            depth = searched_depths[frame][0]
            corner_moves = np.linalg.norm(corners - corners[frame_index], axis=2).max(axis=1)
            deepest, depth_bounds = max(deepest, depth), np.minimum(depth_bounds, depth + corner_moves)
        return searched_depths

    def _box_corners(self, frames: Sequence[int], pair: int) -> FloatArray:
        """Corners (n, 8, 3) of the box around the first body of a pair, in the axes of the second, in some frames."""
        vertices = self._solids[int(self._assembly.pairs[pair, 0])].mesh.vertices
        box = np.array([*product(*zip(vertices.min(axis=0), vertices.max(axis=0), strict=True))])
        poses = [self._relative_pose(frame, pair) for frame in frames]
        return np.array([box @ rotation.T + translation for rotation, translation in poses])

    def _has_pose(self, frame: int, pair: int) -> bool:
        return bool(self._assembly.motion.valid[frame, self._assembly.pairs[pair]].all())

    def _relative_pose(self, frame: int, pair: int) -> tuple[FloatArray, FloatArray]:
        """Pose of the first body of a pair in the axes of the second."""
        motion = self._assembly.motion
        a, b = self._assembly.pairs[pair].tolist()
        to_second = motion.rotations[frame, b].T
        origin_difference = motion.translations[frame, a] - motion.translations[frame, b]
        return to_second @ motion.rotations[frame, a], to_second @ origin_difference


@dataclass(frozen=True)
class MeasuredDepths:
    """Depths of the contacts of the reference, the misses of each detector with theirs, and depths over time."""

    contacts: tuple[ContactDepth, ...]
    misses: Mapping[str, tuple[Fault, ...]]
    series: DepthsByPairAndFrame


def _indices_by_halving(count: int) -> list[int]:
    """Numbers below a count: both ends, the middle, the middles of the halves, and so on."""
    indices = dict.fromkeys([0, count - 1])
    gaps = 1
    while len(indices) < count:
        gaps *= 2
        indices |= dict.fromkeys(round(k * (count - 1) / gaps) for k in range(gaps + 1))
    return [*indices]


def contact_depths(
    assembly: Assembly, contacts: Sequence[Episode], misses: Mapping[str, Sequence[Fault]]
) -> MeasuredDepths:
    """Return the depth of each contact of the reference, and the misses of each detector with theirs."""
    depth_meter = DepthMeter(assembly)
    all_misses = [miss for of_detector in misses.values() for miss in of_detector]
    segments = [(contact.pair, contact.first, contact.last) for contact in contacts]
    depth_meter.measure([*segments, *((miss.pair, miss.first, miss.last) for miss in all_misses)])
    measured_misses = {
        label: tuple(
            replace(
                miss,
                depth=depth.depth,
                volume=depth.volume,
                depth_at_least=depth.at_least,
                not_measured=depth.reason,
            )
            for miss in of_detector
            for depth in (depth_meter.depth_of((miss.pair, miss.first, miss.last)),)
        )
        for label, of_detector in misses.items()
    }
    return MeasuredDepths(
        tuple(depth_meter.depth_of(segment) for segment in segments), measured_misses, depth_meter.series
    )


def deepest(depths: Iterable[ContactDepth]) -> ContactDepth | None:
    """The deepest of those that were measured; ``None``: none was."""
    return max((depth for depth in depths if depth.is_measured), key=lambda depth: depth.depth, default=None)
