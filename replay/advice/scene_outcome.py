"""Contacts of a recording under one assumption, how deep bodies stand in each other, and how near they come."""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Final

import numpy as np

from cdcore import Body, Motion
from cdcore.numerics import BoolArray, FloatArray, IntArray
from cdcore.protocol import counts_as_contact
from replay.advice.overlap_depth import SampledSurface, overlap_depth
from replay.advice.shared_motion import shared_motion
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

DEEP_M: Final = 0.005
"""A body that stands deeper in another is no body that rests: glass is thinner, and trackers err by less."""

VERY_DEEP_M: Final = 0.02
"""Deeper overlaps speak against a scene more than none that touches does."""

GAP_FRAMES: Final = 48
"""Frames without contact whose gap is measured, of each pair those of the nearest bodies."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """The contacts of a recording under one assumption.

    Parameters
    ----------
    contacts : how many there are; ``contact`` (T, P) where.
    deepest : metres that bodies stand in each other at most.
    closest : metres between two bodies at most; 0 with a contact, ``None``: not measured.
    closest_frame : the frame of the closest moment, and its pair.
    touched : bodies that touch another at any time.
    supported : bodies that touch another while both rest.
    carried_contact : fraction with contact of the frames in which two bodies move as one.
    """

    contacts: int
    contact: BoolArray
    deepest: float
    closest: float | None
    closest_frame: int
    closest_pair: int
    touched: int
    supported: int = 0
    carried_contact: float = 0.0


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
        deepest, deep_frame = self._deepest(motion, contact)
        closest, frame, pair = (0.0, *deep_frame) if contact.any() else self._closest(motion)
        shared = shared_motion(motion, self.pairs)
        touched = {body for column in np.flatnonzero(contact.any(axis=0)) for body in self.pairs[column].tolist()}
        return Outcome(
            contacts=len(episodes(detection, motion.valid)),
            contact=contact,
            deepest=deepest,
            closest=closest,
            closest_frame=frame,
            closest_pair=pair,
            touched=len(touched),
            supported=shared.supported(contact, self.pairs),
            carried_contact=shared.carried_contact(contact),
        )

    def _deepest(self, motion: Motion, contact: BoolArray) -> tuple[float, tuple[int, int]]:
        """Metres of the deepest overlap among frames that are evenly chosen, its frame and its pair."""
        frames, pairs = np.nonzero(contact)
        if not len(frames):
            return 0.0, (0, 0)
        chosen = np.unique(np.linspace(0, len(frames) - 1, min(len(frames), DEPTH_FRAMES)).round().astype(np.int64))
        # Pair by pair, so that each pair is among those chosen.
        order = np.lexsort((frames, pairs))
        depths = []
        for row in order[chosen].tolist():
            first, second = self.pairs[pairs[row]].tolist()
            surfaces = self._surface(first), self._surface(second)
            depths.append(overlap_depth(*surfaces, motion, int(frames[row]), (first, second)))
        deepest = int(np.argmax(depths))
        row = int(order[chosen[deepest]])
        return depths[deepest], (int(frames[row]), int(pairs[row]))

    def _closest(self, motion: Motion) -> tuple[float | None, int, int]:
        """Metres of the smallest gap among the frames in which two bodies are nearest, its frame and its pair."""
        best: tuple[float | None, int, int] = None, 0, 0
        most = max(1, GAP_FRAMES // len(self.pairs)) if len(self.pairs) else 0
        for pair, (first, second) in enumerate(self.pairs.tolist()):
            both = np.flatnonzero(motion.valid[:, first] & motion.valid[:, second])
            for frame in both[self._nearest(motion, both, first, second)[:most]].tolist():
                gap, _ = self._mesh_stage.gap(motion, frame, pair)
                if best[0] is None or gap < best[0]:
                    best = gap, frame, pair
        return best

    def _nearest(self, motion: Motion, frames: IntArray, first: int, second: int) -> IntArray:
        """Rows of frames, those first in which the middles of two bodies are nearest."""
        middles: list[FloatArray] = []
        for body in (first, second):
            local = self.bodies[body].mesh.vertices.mean(axis=0)
            middles.append(motion.rotations[frames, body] @ local + motion.translations[frames, body])
        order: IntArray = np.argsort(np.linalg.norm(middles[0] - middles[1], axis=1), kind="stable")
        return order


def outcome_words(outcome: Outcome) -> str:
    """Returns what a recording shows: ``3 contacts, bodies up to 40 mm deep in each other``."""
    if not outcome.contacts:
        nearest = "" if outcome.closest is None else f", {length(outcome.closest)} at the closest"
        return f"no contact{nearest}"
    contacts = plural(outcome.contacts, "contact")
    if outcome.deepest > DEEP_M:
        return f"{contacts}, bodies up to {1e3 * outcome.deepest:.0f} mm deep in each other"
    return f"{contacts}, at most {max(1.0, np.ceil(1e3 * outcome.deepest)):.0f} mm deep"
