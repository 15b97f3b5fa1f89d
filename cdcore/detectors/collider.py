"""The collider that was shipped: a hull, box, sphere or capsule in place of each mesh, tested at fixed steps."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from reprlib import repr as short
from textwrap import shorten
from time import perf_counter
from typing import Final
from urllib.parse import unquote

import numpy as np

from cdcore.bounding.collider_shapes import SHAPES, box_collider
from cdcore.bounding.hull import hull_collider
from cdcore.broad.broad_phase import BroadPhase
from cdcore.broad.live_pairs import LivePairs
from cdcore.containment.containment_stage import ContainmentStage
from cdcore.errors import InvalidSettingError
from cdcore.narrow.bvh.box_tree import box_trees_of
from cdcore.narrow.bvh.whole_motion import FrameLooks, decide_motion
from cdcore.narrow.continuous.clearance import ContactOffset
from cdcore.numerics import ByteArray, IntArray, true_indices
from cdcore.protocol import (
    Body,
    Detection,
    Explanation,
    Live,
    LiveAtRate,
    Motion,
    PairDetector,
    Solids,
    Verdict,
    ZeroOrderHold,
    contact_or_clear,
    is_sampled,
    pair_has_pose,
)
from cdcore.protocol.settings import MOST_METRES, RateSettings, choice, number, text, whole
from cdcore.tolerances import LARGEST_OF_SQUARES_M

FIRST: Final = np.zeros(1, dtype=np.int64)


COMPOUND, SHIPPED = "compound", "shipped"
"""Shapes that come with the body: no other detector asks them."""

CUT_METHODS: Final = ("auto", "hull", "box", "sphere", "capsule", "sectors", "planes", "vhacd", "coacd")
"""How the pieces of a compound may be cut."""


@dataclass(frozen=True, kw_only=True)
class ColliderSettings(RateSettings):
    """Settings of ``collider``.

    ``shape``: what stands in place of every mesh: hull, box, sphere, capsule, mesh; compound, the convex pieces that
    came with the body; or shipped, the colliders that came with the recording, and the hull of a body that has none.
    ``pieces``, ``method`` and ``cut`` are of a compound, for whoever cuts the meshes: the most pieces, how they are
    cut, and the names of the bodies that are cut, joined by ``+``; ``""``: all. ``skin_m``: metres around each body
    within which it is already in contact, the contact offset of an engine: two bodies are in contact from twice that
    distance on.
    """

    shape: str = choice("hull", (*SHAPES, COMPOUND, SHIPPED))
    pieces: int = whole(16, 1, 4096)
    method: str = choice("coacd", CUT_METHODS)
    cut: str = text("", "names of bodies, joined by +")
    skin_m: float = number(0.0, 0, MOST_METRES, unit="metres")


def bodies_to_cut(settings: ColliderSettings, bodies: Sequence[Body]) -> set[str]:
    """Names of the bodies that the setting ``cut`` names; all where it is ``""``.

    A sign that means something in a setting stands as ``%2C``. Raises ``InvalidSettingError``: no body has such a name.
    """
    known = {body.name for body in bodies}
    if not settings.cut:
        return known
    names = {unquote(name) for name in settings.cut.split("+")}
    if not names <= known:
        known_names = shorten(", ".join(sorted(known)), width=120, placeholder=" ...")
        raise InvalidSettingError(
            f"cut={short(settings.cut)} is not allowed; give names of bodies, joined by +; there are: {known_names}"
        )
    return names


class ColliderDetector(PairDetector[ColliderSettings]):
    """Decides exactly about solids that stand in place of the meshes, and holds each answer until its next look.

    Such colliders invent contacts (a rod in the hull of a beaker) and miss some (a corner outside its sphere). Verdicts
    speak of the solids: a body inside a collider is CONTAINED.

    Source: shapes as in ``cdcore.bounding.collider_shapes``. Cost: that of ``exact`` on small meshes; not an engine's.
    """

    name = "collider"
    kind = "re-creation"
    online = True
    largest_m = LARGEST_OF_SQUARES_M
    stages = ("traversal", "containment")
    Settings = ColliderSettings
    sources = (
        "C. B. Barber, D. P. Dobkin, H. Huhdanpaa, The Quickhull algorithm for convex hulls, ACM Transactions on "
        "Mathematical Software 22(4), 1996",
        "X. Wei, M. Liu, Z. Ling, H. Su, Approximate convex decomposition for 3D meshes with collision-aware concavity "
        "and tree search, ACM Transactions on Graphics 41(4), 2022",
    )
    choose_when = "you want to know what the simple colliders of an engine invent and miss"
    cannot = "list faces: those of a collider are not the mesh's"

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, settings: ColliderSettings) -> None:
        super().__init__(bodies, pairs, settings)
        bodies_to_cut(settings, bodies)
        solids = {body.name: _solids_of(body, settings.shape) for body in bodies}
        self.parts = {name: those.parts for name, those in solids.items()}
        """Name of a body -> the solids that stand in its place, in its frame: what a picture draws."""
        self.colliders = tuple(Body(name, those.surface) for name, those in solids.items())
        self._trees = box_trees_of([body.mesh for body in self.colliders])
        self._containment = ContainmentStage(self.colliders, pairs)
        skin = settings.skin_m
        self._offset = ContactOffset(self._trees, pairs, 2 * skin) if skin else None

    @cached_property
    def _broad(self) -> BroadPhase:
        """Volumes of the solids with their skin; whole motions without one are decided by trees alone."""
        skin, grown = self.settings.skin_m, self.colliders
        if skin:
            grown = tuple(Body(body.name, box_collider(body.mesh, skin)) for body in self.colliders)
        return BroadPhase(grown, self.pairs)

    def contact_reach(self, _pair: int) -> float:
        """The skin of both bodies, metres."""
        return 2.0 * self.settings.skin_m

    def explain(self, motion: Motion, frame: int, pair: int, faces: IntArray) -> Explanation:
        """Say whether the frame was tested, and whether the solids meet there."""
        del faces
        settings = self.settings
        sampled = is_sampled(motion.times, frame, settings.rate_hz, settings.sampling_offset_s)
        verdict, _, _ = self._decide(motion.frames(frame, frame + 1))
        meet = int(verdict[0, pair]) in (Verdict.CONTACT, Verdict.CONTAINED)
        return Explanation(looked=sampled, shapes_meet=meet if motion.valid[frame, self.pairs[pair]].all() else None)

    def live(self) -> Live:
        """A session that is asked one frame after the other."""
        surfaces, offset = FrameLooks(self._trees, self.pairs), self._offset

        def decide(now: Motion, column: int, margin: float) -> tuple[int, bool]:
            answer = surfaces.decide(now, column, margin)
            if offset is None or answer[0] == Verdict.CONTACT:
                return answer
            near = offset.near(now, FIRST, np.array([column]))[0]
            return int(Verdict.CONTACT if near else Verdict.CLEAR), False

        live = LivePairs(self._broad, decide, self._containment.question, self._containment.holed)
        rate_hz, offset_s = self.settings.rate_hz, self.settings.sampling_offset_s
        return LiveAtRate(live, self.pairs, rate_hz, offset_s) if rate_hz else live

    def _fresh_memory(self) -> ZeroOrderHold:
        return ZeroOrderHold(len(self.pairs), self.settings.rate_hz, self.settings.sampling_offset_s)

    def _run(self, motion: Motion, memory: ZeroOrderHold, _faces: bool) -> Detection:
        sampled, known = memory.sampled(motion.times), pair_has_pose(motion, self.pairs)
        sample_verdict, work, seconds = self._decide(motion.take(np.flatnonzero(sampled)))
        verdict, hold_work = memory.hold(sample_verdict, known[sampled], sampled, known)
        return self._detection(
            motion, verdict, containment=self._containment.labels, work=work | hold_work, seconds=seconds
        )

    def _decide(self, motion: Motion) -> tuple[ByteArray, dict[str, int], dict[str, float]]:
        """Verdicts of the solids in every frame, counters, and seconds."""
        clock = [perf_counter()]
        answer = decide_motion(self._trees, self.pairs, motion)
        verdict = contact_or_clear(answer.hits, motion, self.pairs)
        if self._offset is not None:
            near = self._broad.candidates(motion)
            clear = verdict[near.frames, near.columns] == Verdict.CLEAR
            frames, columns = near.frames[clear], near.columns[clear]
            verdict[frames, columns] = np.where(
                self._offset.near(motion, frames, columns), Verdict.CONTACT, Verdict.CLEAR
            )
        clock.append(perf_counter())
        frames, columns = true_indices(verdict == Verdict.CLEAR)
        containment_tests = self._containment.mark(motion, frames, columns, verdict)
        clock.append(perf_counter())
        return verdict, answer.work | {"containment_tests": containment_tests}, self._seconds(clock)


def _solids_of(body: Body, shape: str) -> Solids:
    """Returns the solids that replace each body."""
    if shape in (COMPOUND, SHIPPED) and body.colliders is not None:
        return body.colliders
    if shape == COMPOUND:
        raise InvalidSettingError(f"shape='compound' is not allowed: {body.name} has no convex pieces; give colliders")
    solid = SHAPES.get(shape, hull_collider)(body.mesh)
    return Solids((solid,), solid)
