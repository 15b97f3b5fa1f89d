"""One query per pair at load and after any change of a pose; between changes the answer is the cached one."""

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import ClassVar

import numpy as np

from cdcore.bounding.sphere import Sphere, sphere_best
from cdcore.broad.broad_looks import LivePairs
from cdcore.broad.broad_phase import BroadPhase
from cdcore.broad.sphere_stage import SphereStage
from cdcore.detectors import FCL, PAPER
from cdcore.narrow.containment.containment_stage import ContainmentStage
from cdcore.narrow.mesh_stage import MeshStage
from cdcore.narrow.sections.section_source import sections_of
from cdcore.numerics import BoolArray, ByteArray, FloatArray, Int32Array, IntArray
from cdcore.protocol import (
    NO_FACES,
    Body,
    Detection,
    FaceSets,
    Motion,
    PairDetector,
    Verdict,
    ordered_by_name,
    pair_has_pose,
)
from cdcore.protocol.live import Live
from cdcore.protocol.settings import MOST_METRES, CheckedSettings, flag, number


@dataclass(frozen=True, kw_only=True)
class StaticSettings(CheckedSettings):
    """Settings of ``static``.

    ``epsilon``: metres; an answer stays while no point of one body has moved further than this relative to the other
    since the last query. 0: while both poses are bit for bit those of the last query.
    ``containment``: whether to ask, where surfaces do not meet, if one body is inside the other.
    """

    epsilon: float = number(0.0, 0, MOST_METRES, unit="metres")
    containment: bool = flag(True)


@dataclass(eq=False)
class _StaticMemory:
    """Per pair, the poses of its last query and what it answered; passes from block to block."""

    poses: list[FloatArray | None]
    verdict: ByteArray
    faces: list[Int32Array]


class StaticDetector(PairDetector[StaticSettings]):
    """Asks the meshes of a pair only when one of the two has moved: N frozen frames are one query.

    Choose it for scenes that mostly stand still; a pair that moves costs a query every frame. A query is a sphere test
    and, where spheres overlap, a mesh query. ``work``: ``queries`` done, ``cached`` pair-frames answered from the query
    before, ``mesh_queries`` among the queries. With ``epsilon`` above 0 a cached answer can be wrong by that distance.

    Source: the paper's row *static*, "suitable when objects are stationary and do not collide".
    """

    name: ClassVar[str] = "static"
    kind: ClassVar[str] = "engine"
    online: ClassVar[bool] = True
    Settings: ClassVar[type] = StaticSettings
    sources: ClassVar[tuple[str, ...]] = (f"{PAPER}, Fig. 5, static detection", FCL)
    choose_when: ClassVar[str] = "things stand still most of the time"
    cannot: ClassVar[str] = "be fast when everything moves"

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, settings: StaticSettings) -> None:
        super().__init__(bodies, pairs, settings)
        self._spheres = [sphere_best(body.mesh) for body in bodies]
        self._broad = SphereStage(self._spheres, pairs)
        self._meshes = MeshStage(bodies, pairs)
        # How far one body moved as seen from the other depends on which is which.
        self._ordered, _ = ordered_by_name(bodies, pairs)
        self._containment = ContainmentStage(bodies, pairs, asked=settings.containment)

    def live(self) -> Live:
        """A session that is asked one frame after the other."""
        if self.settings.epsilon > 0.0:
            return super().live()
        return LivePairs(BroadPhase(self.bodies, self.pairs), self._meshes.decide_now, self._containment.question)

    def _fresh_memory(self) -> _StaticMemory:
        count = len(self.pairs)
        return _StaticMemory([None] * count, np.full(count, Verdict.NO_POSE, dtype=np.uint8), [NO_FACES] * count)

    def _run(self, motion: Motion, memory: _StaticMemory, faces: bool) -> Detection:
        start = perf_counter()
        near = self._broad.candidates(motion).verdict == Verdict.CANDIDATE
        known = pair_has_pose(motion, self.pairs)
        fresh = np.zeros(known.shape, dtype=np.bool_)
        for column in range(len(self.pairs)):
            frames = np.flatnonzero(known[:, column])
            fresh[frames, column] = self._fresh(motion, frames, column, memory)
        # Row 0 is the query before the block; ``last`` (T, P): the row of the query that answers a frame.
        last = np.maximum.accumulate(np.where(fresh, np.arange(1, len(motion) + 1)[:, None], 0), axis=0)
        columns, frames = np.nonzero((fresh & near).T)
        answer = self._meshes.decide(motion, frames, columns, faces=faces)
        asked = np.full(known.shape, Verdict.CLEAR, dtype=np.uint8)
        asked[frames[answer.hits], columns[answer.hits]] = Verdict.CONTACT
        self._containment.mark(motion, frames[~answer.hits], columns[~answer.hits], asked)
        answers = np.take_along_axis(np.concatenate([memory.verdict[None], asked]), last, axis=0)
        sets, which = [NO_FACES, *memory.faces, *answer.sets], np.zeros((len(motion) + 1, len(self.pairs)), np.int64)
        which[0] = 1 + np.arange(len(self.pairs))
        if faces:
            which[frames + 1, columns] = 1 + len(self.pairs) + answer.which
        which = np.take_along_axis(which, last, axis=0)
        if len(motion):
            memory.verdict, memory.faces = answers[-1], [sets[k] for k in which[-1].tolist()]
        queries, (frame, pair) = int(fresh.sum()), np.nonzero(known)
        return self._detection(
            motion,
            np.where(known, answers, np.uint8(Verdict.NO_POSE)),
            face_sets=FaceSets.from_shared(frame, pair, which[known], sets) if faces else None,
            containment=self._containment.words,
            work={"queries": queries, "cached": int(known.sum()) - queries, "mesh_queries": len(frames)},
            seconds={"queries": perf_counter() - start},
            section_source=sections_of(self.bodies, self.pairs, motion) if faces else None,
        )

    def _fresh(self, motion: Motion, frames: IntArray, column: int, memory: _StaticMemory) -> BoolArray:
        """Which frames need a query, (K,); remembers the poses of the last one."""
        if not len(frames):
            return np.zeros(0, dtype=np.bool_)
        i, j = self._ordered[column].tolist()
        poses = np.concatenate([_flat(motion, frames, i), _flat(motion, frames, j)], axis=1)
        last = memory.poses[column]
        if self.settings.epsilon == 0.0:
            before = np.concatenate([poses[:1] * np.nan if last is None else last[None], poses[:-1]])
            memory.poses[column] = poses[-1].copy()
            return (poses != before).any(axis=1)
        fresh, memory.poses[column] = _moved(poses, last, self._spheres[i], self.settings.epsilon)
        return fresh


def _flat(motion: Motion, frames: IntArray, body: int) -> FloatArray:
    """Poses as rows of twelve numbers, (K, 12): rotation, translation."""
    turn = motion.rotations[frames, body].reshape(-1, 9)
    return np.concatenate([turn, motion.translations[frames, body]], axis=1)


def _moved(poses: FloatArray, last: FloatArray | None, sphere: Sphere, epsilon: float) -> tuple[BoolArray, FloatArray]:
    """Which rows are further than ``epsilon`` from the pose asked about last, and the one asked about last of all.

    Seen from j, the ball of i moves by at most ``|dR|_F d + |dc|``: the Frobenius norm bounds the map, the centre moves
    by itself. Each query sets the pose that the next rows are compared with, so errors do not add up.
    """
    rows = poses if last is None else np.concatenate([last[None], poses])
    back = rows[:, 12:21].reshape(-1, 3, 3).transpose(0, 2, 1)
    turn = back @ rows[:, :9].reshape(-1, 3, 3)
    centre = np.einsum("kab,b->ka", turn, sphere.centre)
    centre += np.einsum("kab,kb->ka", back, rows[:, 9:12] - rows[:, 21:])
    fresh, asked = np.zeros(len(rows), dtype=np.bool_), 0
    fresh[0] = True
    for k in range(1, len(rows)):
        way = np.linalg.norm(turn[k] - turn[asked]) * sphere.radius + np.linalg.norm(centre[k] - centre[asked])
        if not way <= epsilon:
            fresh[k], asked = True, k
    return fresh[len(rows) - len(poses) :], rows[asked].copy()
