"""One query per pair at load and after any change of a pose; between changes the answer is the cached one."""

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import ClassVar

import numpy as np

from cdcore.bounding.sphere import Sphere, sphere_best
from cdcore.broad.broad_looks import BroadLooks
from cdcore.broad.broad_phase import BroadPhase
from cdcore.broad.sphere_stage import SphereStage
from cdcore.errors import InvalidSettingError
from cdcore.narrow.containment.containment_stage import ContainmentStage
from cdcore.narrow.mesh_stage import MeshStage
from cdcore.narrow.sections.section_source import sections_of
from cdcore.numerics import BoolArray, ByteArray, FloatArray, Int32Array, IntArray
from cdcore.protocol import NO_FACES, Body, Detection, FaceSets, Motion, PairDetector, Verdict, pair_has_pose
from cdcore.protocol.live import Live, LivePairs


@dataclass(frozen=True, kw_only=True)
class StaticSettings:
    """Settings of ``static``.

    ``epsilon``: metres; an answer stays while no point of one body has moved further than this relative to the other
    since the last query. 0: while both poses are bit for bit those of the last query.
    ``containment``: whether to ask, where surfaces do not meet, if one body is inside the other.
    """

    epsilon: float = 0.0
    containment: bool = True

    def __post_init__(self) -> None:
        if not 0.0 <= self.epsilon < float("inf"):
            raise InvalidSettingError(f"epsilon={self.epsilon!r} is no distance; give metres, 0 or more")


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
    sources: ClassVar[tuple[str, ...]] = (
        "Design of Virtual Experiment Teaching of Inorganic Chemistry in Colleges and Universities Based on "
        "Unity3D, Fig. 5, static detection",
        "J. Pan, S. Chitta, D. Manocha, FCL: a general purpose library for collision and proximity queries, ICRA 2012",
    )
    choose_when: ClassVar[str] = "things stand still most of the time"
    cannot: ClassVar[str] = "be fast when everything moves"

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, settings: StaticSettings) -> None:
        super().__init__(bodies, pairs, settings)
        self._spheres = [sphere_best(body.mesh) for body in bodies]
        self._broad = SphereStage(self._spheres, pairs)
        self._meshes = MeshStage(bodies, pairs)
        self._containment = ContainmentStage(bodies, pairs, asked=settings.containment)

    def live(self) -> Live:
        """A session that is asked one frame after the other."""
        if self.settings.epsilon > 0.0:
            return super().live()
        looks = BroadLooks(BroadPhase(self.bodies, self.pairs))
        return LivePairs(looks, self._meshes.decide_now, self._containment.question)

    def _fresh_memory(self) -> _StaticMemory:
        count = len(self.pairs)
        return _StaticMemory([None] * count, np.full(count, Verdict.NO_POSE, dtype=np.uint8), [NO_FACES] * count)

    def _run(self, motion: Motion, memory: _StaticMemory, faces: bool) -> Detection:
        start = perf_counter()
        near = self._broad.candidates(motion).verdict
        known = pair_has_pose(motion, self.pairs)
        verdict = np.full(known.shape, Verdict.NO_POSE, dtype=np.uint8)
        sets: list[Int32Array] = list(memory.faces)
        entries: list[tuple[IntArray, IntArray, IntArray]] = []
        queries = mesh_queries = 0
        for column in range(len(self.pairs)):
            frames = np.flatnonzero(known[:, column])
            fresh = self._fresh(motion, frames, column, memory)
            asked = frames[fresh]
            queries += len(asked)
            close = near[asked, column] == Verdict.CANDIDATE
            mesh_queries += int(close.sum())
            answers, found = self._ask(motion, asked, close, column, faces)
            number = np.cumsum(fresh)
            verdict[frames, column] = np.concatenate([memory.verdict[[column]], answers])[number]
            which = np.concatenate([[column], np.arange(len(found)) + len(sets)])
            sets += found
            if faces:
                entries.append((frames, np.full(len(frames), column), which[number]))
            if len(asked):
                memory.verdict[column] = answers[-1]
                memory.faces[column] = found[-1] if found else NO_FACES
        return self._detection(
            motion,
            verdict,
            face_sets=_face_sets(entries, sets) if faces else None,
            containment=self._containment.words,
            work={"queries": queries, "cached": int(known.sum()) - queries, "mesh_queries": mesh_queries},
            seconds={"queries": perf_counter() - start},
            section_source=sections_of(self.bodies, self.pairs, motion) if faces else None,
        )

    def _ask(
        self, motion: Motion, frames: IntArray, close: BoolArray, column: int, faces: bool
    ) -> tuple[ByteArray, list[Int32Array]]:
        """Verdicts of the frames asked about, and their faces if wanted, one set per frame."""
        rows = np.flatnonzero(close)
        columns = np.full(len(rows), column)
        answer = self._meshes.decide(motion, frames[rows], columns, faces=faces)
        verdicts = np.full(len(frames), Verdict.CLEAR, dtype=np.uint8)
        verdicts[rows[answer.hits]] = Verdict.CONTACT
        apart = rows[~answer.hits]
        inside = self._containment.contained(motion, frames[apart], columns[: len(apart)])
        verdicts[apart[inside]] = Verdict.CONTAINED
        found = [NO_FACES] * len(frames) if faces else []
        for row, which in zip(rows.tolist(), answer.which.tolist(), strict=False):
            found[row] = answer.sets[which]
        return verdicts, found

    def _fresh(self, motion: Motion, frames: IntArray, column: int, memory: _StaticMemory) -> BoolArray:
        """Which frames need a query, (K,); remembers the poses of the last one."""
        if not len(frames):
            return np.zeros(0, dtype=np.bool_)
        i, j = self.pairs[column].tolist()
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


def _face_sets(entries: list[tuple[IntArray, IntArray, IntArray]], sets: list[Int32Array]) -> FaceSets:
    if not entries:
        return FaceSets.from_lists([], [], [])
    frames, columns, which = (np.concatenate(part) for part in zip(*entries, strict=True))
    return FaceSets.from_shared(frames, columns, which, sets)
