"""Contacts of a recording under one assumption, how deep bodies stand in each other, and how near they come."""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Final

import numpy as np

from cdcore import Body, Motion
from cdcore.numerics import BoolArray, FloatArray, IntArray
from cdcore.protocol import counts_as_contact
from replay import words
from replay.advice.overlap_depth import SampledSurface, overlap_depth
from replay.advice.sampled_contacts import evenly
from replay.auditing.episodes import episodes
from replay.detection.detector_spec import DetectorSpec
from replay.detection.run_detector import make_detector
from replay.prepare.assembly import Assembly
from replay.words import length, plural

if TYPE_CHECKING:
    from cdcore.narrow.mesh_stage import MeshStage
    from cdcore.protocol import Detector

DEPTH_FRAMES: Final = 24
"""Contact frames of an alternative whose depth is measured, evenly chosen."""

DEEP_OVERLAP_M: Final = 0.005
"""A body that stands deeper in another is no body that rests: glass is thinner, and trackers err by less."""

REST_WINDOW_S: Final = 0.5
"""Seconds over which a resting body is watched."""

MOST_REST_MOTION_M: Final = 0.002
"""Metres that a resting body moves in them at most: trackers jitter."""

GAP_FRAMES: Final = 48
"""Frames without contact whose gap is measured, of each pair those of the nearest bodies."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """The contacts of a recording under one assumption.

    Parameters
    ----------
    contacts : how many there are; ``contact`` (T, P) where.
    deepest : metres that bodies stand in each other at most, in the contact frames that are measured.
    deep_at_rest : fraction of the contact frames of two resting bodies in which one stands deep in the other; 0: none.
    closest : metres between two bodies at most; 0 with a contact, ``None``: not measured.
    closest_frame : the frame of the closest moment, and its pair.
    """

    contacts: int
    contact: BoolArray
    deepest: float
    closest: float | None
    closest_frame: int
    closest_pair: int
    deep_at_rest: float = 0.0


def resting_bodies(motion: Motion) -> BoolArray:
    """Returns whether each body hardly moves from a frame on for half a second, (T, N)."""
    frame_count = len(motion)
    is_resting = np.zeros(motion.valid.shape, dtype=np.bool_)
    width = np.searchsorted(motion.times, motion.times + REST_WINDOW_S)
    rows = np.flatnonzero(width < frame_count)
    moved_distance = np.linalg.norm(motion.translations[width[rows]] - motion.translations[rows], axis=2)
    is_resting[rows] = motion.valid[rows] & motion.valid[width[rows]] & (moved_distance <= MOST_REST_MOTION_M)
    return is_resting


class ReplayedBodies:
    """The bodies of a recording with what is built of them once: a detector, points on surfaces, trees for gaps.

    Every alternative that only moves these bodies, such as other axes of their meshes, uses them again.
    """

    def __init__(self, assembly: Assembly) -> None:
        self._assembly = assembly
        self._surfaces = dict[int, SampledSurface]()

    @cached_property
    def _detector(self) -> "Detector":
        return make_detector(DetectorSpec("exact", "exact"), self._assembly, 0)

    @cached_property
    def _mesh_stage(self) -> "MeshStage":
        from cdcore.narrow.mesh_stage import MeshStage

        return MeshStage(self.bodies, self.pairs)

    @property
    def bodies(self) -> tuple[Body, ...]:
        """The bodies, N."""
        return self._assembly.bodies

    @property
    def pairs(self) -> IntArray:
        """Their pairs (P, 2)."""
        return self._assembly.pairs

    def _surface(self, body: int) -> SampledSurface:
        if body not in self._surfaces:
            self._surfaces[body] = SampledSurface(self.bodies[body].mesh)
        return self._surfaces[body]

    def outcome(self, motion: Motion) -> Outcome:
        """Returns the contacts by the exact detector, their depth, and how near bodies come without one."""
        detection = self._detector.detect(motion)
        contact = counts_as_contact(detection.verdict)
        depths, rows = self._depths(motion, contact)
        is_resting = resting_bodies(motion)
        resting_depths, _ = self._depths(motion, contact & is_resting[:, self.pairs].all(axis=2))
        if len(depths):
            frame, pair = rows[int(depths.argmax())].tolist()
            closest_gap: float | None = 0.0
        else:
            closest_gap, frame, pair = self._closest(motion)
        return Outcome(
            contacts=len(episodes(detection, motion.valid)),
            contact=contact,
            deepest=float(depths.max(initial=0.0)),
            deep_at_rest=float((resting_depths > DEEP_OVERLAP_M).mean()) if len(resting_depths) else 0.0,
            closest=closest_gap,
            closest_frame=frame,
            closest_pair=pair,
        )

    def _depths(self, motion: Motion, contact: BoolArray) -> tuple[FloatArray, IntArray]:
        """Metres of overlap (n,) in contact frames that are evenly chosen, and their frames and pairs (n, 2)."""
        frames, pairs = np.nonzero(contact)
        # Pair by pair, so that each pair is among those chosen.
        pair_order = np.lexsort((frames, pairs))
        sampled_rows = pair_order[evenly(len(pair_order), DEPTH_FRAMES)]
        rows = np.stack([frames[sampled_rows], pairs[sampled_rows]], axis=1)
        depths = np.zeros(len(rows))
        for number, (frame, pair) in enumerate(rows.tolist()):
            first, second = self.pairs[pair].tolist()
            surfaces = self._surface(first), self._surface(second)
            depths[number] = overlap_depth(*surfaces, motion, frame, (first, second))
        return depths, rows

    def _closest(self, motion: Motion) -> tuple[float | None, int, int]:
        """Metres of the smallest gap among the frames in which two bodies are nearest, its frame and its pair."""
        best_gap_frame_pair: tuple[float | None, int, int] = None, 0, 0
        most_frames = max(1, GAP_FRAMES // len(self.pairs)) if len(self.pairs) else 0
        for pair, (first, second) in enumerate(self.pairs.tolist()):
            posed_frames = np.flatnonzero(motion.valid[:, first] & motion.valid[:, second])
            for frame in posed_frames[self._nearest(motion, posed_frames, first, second)[:most_frames]].tolist():
                gap, _ = self._mesh_stage.gap(motion, frame, pair)
                if best_gap_frame_pair[0] is None or gap < best_gap_frame_pair[0]:
                    best_gap_frame_pair = gap, frame, pair
        return best_gap_frame_pair

    def _nearest(self, motion: Motion, frames: IntArray, first: int, second: int) -> IntArray:
        """Rows of frames, those first in which the middles of two bodies are nearest."""
        body_middles: list[FloatArray] = []
        for body in (first, second):
            local_middle = self.bodies[body].mesh.vertices.mean(axis=0)
            body_middles.append(motion.rotations[frames, body] @ local_middle + motion.translations[frames, body])
        distance_order: IntArray = np.argsort(np.linalg.norm(body_middles[0] - body_middles[1], axis=1), kind="stable")
        return distance_order


def outcome_text(outcome: Outcome) -> str:
    """Returns what a recording shows: ``3 contacts, bodies up to 40 mm deep in each other``."""
    if not outcome.contacts:
        nearest_text = "" if outcome.closest is None else f", {length(outcome.closest)} at the closest"
        return f"no contact{nearest_text}"
    contacts = plural(outcome.contacts, "contact")
    if outcome.deepest > DEEP_OVERLAP_M:
        return f"{contacts}, bodies up to {words.decimal(1e3 * outcome.deepest, 0)} mm deep in each other"
    return f"{contacts}, at most {words.decimal(max(1.0, np.ceil(1e3 * outcome.deepest)), 0)} mm deep"
