"""The collider that was shipped: a hull, box, sphere or capsule in place of each mesh, tested at fixed steps."""

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import ClassVar

import numpy as np

from cdcore.bounding.collider_shapes import SHAPES
from cdcore.broad.broad_looks import BroadLooks
from cdcore.broad.broad_phase import BroadPhase
from cdcore.errors import InvalidSettingError
from cdcore.narrow.containment.containment_stage import ContainmentStage
from cdcore.narrow.spacetime.box_tree import build_box_tree
from cdcore.narrow.spacetime.frame_looks import FrameLooks
from cdcore.narrow.spacetime.pair_job import Poses
from cdcore.narrow.spacetime.whole_motion import decide_motion
from cdcore.numerics import ByteArray, IntArray
from cdcore.protocol import Body, Detection, Explanation, Motion, PairDetector, Verdict, contact_or_clear, pair_has_pose
from cdcore.protocol.blocks import HeldVerdicts, looks_at, looks_of, require_rate
from cdcore.protocol.live import Live, LiveHeld, LivePairs


@dataclass(frozen=True, kw_only=True)
class ColliderSettings:
    """Settings of ``collider``.

    ``shape``: what stands in place of every mesh: hull, box, sphere, capsule, or mesh.
    ``rate_hz``: looks per second of session time, as 50, 60, 72 or 90; ``None``: every frame.
    """

    shape: str = "hull"
    rate_hz: float | None = None

    def __post_init__(self) -> None:
        if self.shape not in SHAPES:
            raise InvalidSettingError(f"shape={self.shape!r} is no collider; choose one of: {', '.join(SHAPES)}")
        require_rate(self.rate_hz)


class ColliderDetector(PairDetector[ColliderSettings]):
    """Decides exactly about solids that stand in place of the meshes, and holds each answer until its next look.

    Choose it to see what the simple colliders of a game engine invent (a rod in the hull of a beaker) and miss (a
    corner outside its sphere), and at which step rate. Verdicts speak of the solids: a body inside a collider is
    CONTAINED. It lists no faces, because those of a collider are not the mesh's.

    Source: shapes as in ``cdcore.bounding.collider_shapes``. Cost: that of ``exact`` on small meshes; not an engine's.
    """

    name: ClassVar[str] = "collider"
    kind: ClassVar[str] = "re-creation"
    online: ClassVar[bool] = True
    Settings: ClassVar[type] = ColliderSettings
    sources: ClassVar[tuple[str, ...]] = (
        "C. B. Barber, D. P. Dobkin, H. Huhdanpaa, The Quickhull algorithm for convex hulls, ACM Transactions on "
        "Mathematical Software 22(4), 1996",
    )
    choose_when: ClassVar[str] = "you want to know what the simple colliders of an engine invent and miss"
    cannot: ClassVar[str] = "list faces: those of a collider are not the mesh's"

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, settings: ColliderSettings) -> None:
        super().__init__(bodies, pairs, settings)
        self.colliders = tuple(Body(body.name, SHAPES[settings.shape](body.mesh)) for body in bodies)
        self._trees = [build_box_tree(body.mesh.triangles) for body in self.colliders]
        self._containment = ContainmentStage(self.colliders, pairs)

    def explain(self, motion: Motion, frame: int, pair: int, faces: IntArray) -> Explanation:
        """Say whether the frame was tested, and whether the solids meet there."""
        del faces
        looked = looks_at(motion.times, frame, self.settings.rate_hz)
        verdict, _, _ = self._decide(motion.frames(frame, frame + 1))
        return Explanation(looked=looked, shapes_meet=int(verdict[0, pair]) in (Verdict.CONTACT, Verdict.CONTAINED))

    def live(self) -> Live:
        """A session that is asked one frame after the other."""
        broad, surfaces = BroadPhase(self.colliders, self.pairs), FrameLooks(self._trees, self.pairs)
        looks = LivePairs(BroadLooks(broad), surfaces.decide, self._containment.question)
        return LiveHeld(looks, self.pairs, self.settings.rate_hz) if self.settings.rate_hz else looks

    def _fresh_memory(self) -> HeldVerdicts:
        return HeldVerdicts(len(self.pairs))

    def _run(self, motion: Motion, memory: HeldVerdicts, _faces: bool) -> Detection:
        looks, memory.tick = looks_of(motion.times, self.settings.rate_hz, memory.tick)
        seen, work, seconds = self._decide(motion.take(np.flatnonzero(looks)))
        verdict, held = memory.hold(seen, looks, pair_has_pose(motion, self.pairs))
        return self._detection(motion, verdict, containment=self._containment.words, work=work | held, seconds=seconds)

    def _decide(self, motion: Motion) -> tuple[ByteArray, dict[str, int], dict[str, float]]:
        """Verdicts of the solids in every frame, counters, and seconds."""
        clock = [perf_counter()]
        poses = Poses(motion.rotations, motion.translations, motion.valid)
        answer = decide_motion(self._trees, self.pairs, poses)
        verdict = contact_or_clear(answer.hits, motion, self.pairs)
        clock.append(perf_counter())
        columns, frames = np.nonzero(verdict.T == Verdict.CLEAR)
        inside = self._containment.contained(motion, frames, columns)
        verdict[frames[inside], columns[inside]] = Verdict.CONTAINED
        clock.append(perf_counter())
        seconds = dict(zip(("traversal", "containment"), np.diff(clock).tolist(), strict=True))
        return verdict, answer.work | {"containment_tests": len(frames)}, seconds
