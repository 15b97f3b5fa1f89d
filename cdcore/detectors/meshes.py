"""The detectors that ask FCL about meshes: ``hybrid`` at every frame, ``discrete`` at ticks, ``static`` after a move.

Volumes leave the pair-frames that may meet, meshes decide them, and each answer is held until the next question.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from time import perf_counter
from typing import Any, ClassVar, NamedTuple

import numpy as np

from cdcore.broad.broad_phase import BroadAnswer, BroadPhase
from cdcore.broad.live_pairs import LivePairs
from cdcore.containment.containment_stage import ContainmentStage
from cdcore.detectors.detector_table import FCL, PAPER
from cdcore.narrow.mesh_stage import MeshAnswer, MeshStage
from cdcore.narrow.sections.section_source import section_of_faces
from cdcore.numerics import BoolArray, ByteArray, FloatArray, Int32Array, IntArray, true_indices
from cdcore.protocol import (
    NO_FACES,
    Body,
    Detection,
    Explanation,
    FaceSets,
    Live,
    LiveAtRate,
    Motion,
    PairDetector,
    Verdict,
    ZeroOrderHold,
    is_sampled,
    ordered_by_name,
    pair_has_pose,
)
from cdcore.protocol.detection import SectionSource
from cdcore.protocol.settings import MOST_METRES, ContainmentSettings, RateSettings, number
from cdcore.protocol.zero_order_hold import BEFORE_BLOCK, answering_samples
from cdcore.tolerances import LARGEST_OF_SQUARES_M


class _LastQueries(ZeroOrderHold):
    """Keeps the last query of each pair and its answer; nothing else passes from block to block."""

    def __init__(self, pairs: int, rate_hz: float | None, offset_s: float) -> None:
        super().__init__(pairs, rate_hz, offset_s)
        self.poses: FloatArray = np.full((pairs, 2, 12), np.nan)
        """Rotation by rows and translation of both bodies; NaN before the first query."""
        self.faces: list[Int32Array] = [NO_FACES] * pairs
        """Face pairs that met, (k, 2)."""


class _Queries(NamedTuple):
    """The queries of a block of T frames, L of them samples, and what the meshes answered about K pair-frames."""

    samples: Motion
    """The frames that are samples."""
    sampled: BoolArray
    """(T,) which frames are."""
    queried: BoolArray
    """(L, P) which samples query a pair."""
    frames: IntArray
    """(K,) samples at which meshes were asked."""
    columns: IntArray
    """(K,) pairs about which they were asked."""
    meshes: MeshAnswer


class MeshDetector(PairDetector[Any]):
    """Asks the meshes of a pair, and holds each answer until the next question (zero-order hold).

    A pair is asked at every frame, or at the first frame at or after each tick of ``rate_hz``, or where its bodies have
    moved against each other by more than ``epsilon``; a row that has no such setting asks as if it were ``None``.
    """

    kind = "engine"
    online = True
    largest_m = LARGEST_OF_SQUARES_M
    stages: ClassVar[tuple[str, ...]] = ("spheres", "boxes", "meshes", "containment")

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, settings: Any) -> None:
        super().__init__(bodies, pairs, settings)
        self._rate_hz: float | None = getattr(settings, "rate_hz", None)
        self._offset_s: float = getattr(settings, "sampling_offset_s", 0.0)
        self._epsilon: float | None = getattr(settings, "epsilon", None)
        self._broad = BroadPhase(bodies, pairs, boxes="boxes" in self.stages)
        self._meshes = MeshStage(bodies, pairs)
        self._containment = ContainmentStage(bodies, pairs, enabled=settings.containment)
        # How far one body moved as seen from the other depends on which is which.
        self._ordered, self._swapped = ordered_by_name(bodies, pairs)

    def live(self) -> Live:
        """A session that is asked one frame after the other."""
        if self._epsilon:
            return super().live()
        live = LivePairs(self._broad, self._meshes.decide_now, self._containment.question, self._containment.holed)
        return LiveAtRate(live, self.pairs, self._rate_hz, self._offset_s) if self._rate_hz else live

    def faces_of(self, motion: Motion, hits: BoolArray) -> FaceSets | None:
        """Ask the meshes in these pair-frames; ``None`` where a frame may hold an earlier one's faces."""
        if self._rate_hz is not None or self._epsilon:
            return None
        frames, columns = true_indices(hits)
        return self._meshes.decide(motion, frames, columns, faces=True).face_sets(frames, columns)

    def _fresh_memory(self) -> _LastQueries:
        return _LastQueries(len(self.pairs), self._rate_hz, self._offset_s)

    def _run(self, motion: Motion, memory: _LastQueries, faces: bool) -> Detection:
        known, sampled = pair_has_pose(motion, self.pairs), memory.sampled(motion.times)
        samples = motion if sampled.all() else motion.take(np.flatnonzero(sampled))
        queried = known[sampled] if self._epsilon is None else self._after_moves(motion, known, memory, self._epsilon)
        near = self._broad.candidates(samples)
        queries = self._search(samples, sampled, queried, near, faces)
        containment_tests = self._contain(queries, near)
        verdict, hold_work = memory.hold(near.verdict, queried, sampled, known)
        face_sets, sections = self._remember(memory, queries, verdict, faces)
        work = {
            "pair_looks": int(queried.sum()),
            "mesh_queries": queries.meshes.queries,
            "reused": queries.meshes.reused,
            "containment_tests": containment_tests,
            "face_pairs": sum(len(faces) for faces in queries.meshes.sets),
        }
        return self._detection(
            motion,
            verdict,
            face_sets=face_sets,
            containment=self._containment.labels,
            work=near.work | hold_work | work,
            seconds=self._seconds(near.clock),
            section_source=sections,
        )

    def _search(
        self, samples: Motion, sampled: BoolArray, queried: BoolArray, near: BroadAnswer, faces: bool
    ) -> _Queries:
        """Queries the meshes of near pair-frames, and marks contacts in ``near.verdict``."""
        chosen = queried[near.frames, near.columns]
        frames, columns = near.frames[chosen], near.columns[chosen]
        meshes = self._meshes.decide(samples, frames, columns, faces=faces)
        near.verdict[frames[meshes.hits], columns[meshes.hits]] = Verdict.CONTACT
        near.clock.append(perf_counter())
        return _Queries(samples, sampled, queried, frames, columns, meshes)

    def _contain(self, queries: _Queries, near: BroadAnswer) -> int:
        """Marks containment in ``near.verdict`` where meshes do not meet; returns the number of tests."""
        clear = ~queries.meshes.hits
        tests = self._containment.mark(queries.samples, queries.frames[clear], queries.columns[clear], near.verdict)
        near.clock.append(perf_counter())
        return tests

    def _remember(
        self, memory: _LastQueries, queries: _Queries, verdict: ByteArray, faces: bool
    ) -> tuple[FaceSets, SectionSource] | tuple[None, None]:
        """Keeps poses and faces of the newest query of each pair; returns the faces of every contact, if requested."""
        samples, queried, meshes = queries.samples, queries.queried, queries.meshes
        renewed = np.flatnonzero(queried.any(axis=0))
        # The last True of a column is the first from its end.
        newest = len(queried) - 1 - queried[::-1, renewed].argmax(axis=0) if len(renewed) else renewed
        poses_before = memory.poses.copy()
        memory.poses[renewed] = _poses_of(samples, newest, self.pairs[renewed])
        if not faces:
            return None, None
        # Sets of this block, none, and those of queries before it, one a pair.
        none, before = len(meshes.sets), len(meshes.sets) + 1
        sets = [*meshes.sets, NO_FACES, *memory.faces]
        set_of_sample = np.full(queried.shape, none, dtype=np.int64)
        set_of_sample[queries.frames, queries.columns] = meshes.which
        answering = answering_samples(queried, queries.sampled)
        frame, pair = np.nonzero(verdict == Verdict.CONTACT)
        sample = answering[frame, pair]
        which, of_block = before + pair, sample != BEFORE_BLOCK
        which[of_block] = set_of_sample[sample[of_block], pair[of_block]]
        for column, last in zip(renewed.tolist(), newest.tolist(), strict=True):
            memory.faces[column] = sets[set_of_sample[last, column]]
        sections = partial(self._section, samples, answering, poses_before)
        return FaceSets.from_shared(frame, pair, which, sets), sections

    def _after_moves(self, motion: Motion, known: BoolArray, memory: _LastQueries, epsilon: float) -> BoolArray:
        """Marks the pair-frames (T, P) that are queried because a body moved since the last query."""
        queried = np.zeros(known.shape, dtype=np.bool_)
        for column, ends in enumerate(self.pairs):
            frames = np.flatnonzero(known[:, column])
            poses = np.concatenate([memory.poses[[column]], _poses_of(motion, frames, ends)])
            if epsilon == 0.0:
                queried[frames, column] = (poses[1:] != poses[:-1]).any(axis=(1, 2))
                continue
            centre, radius, _ = (entries[self._ordered[column, 0]] for entries in self._broad.spheres.spheres)
            ordered = poses[:, ::-1] if self._swapped[column] else poses
            queried[frames, column] = _moved_poses(ordered, centre, float(radius), epsilon)
        return queried

    def _section(
        self, samples: Motion, answering: IntArray, before: FloatArray, frame: int, pair: int, faces: IntArray
    ) -> FloatArray:
        """Segments at the poses of the query whose faces they are, not at those of a frame that keeps the answer.

        ``before`` (P, 2, 12): poses of the last query before the block.
        """
        sample, ends = int(answering[frame, pair]), self.pairs[pair]
        poses = before[pair] if sample == BEFORE_BLOCK else _poses_of(samples, np.array(sample), ends)
        a, b = ((self.bodies[k], (pose[:9].reshape(3, 3), pose[9:])) for k, pose in zip(ends, poses, strict=True))
        return section_of_faces(*a, *b, faces)


def _poses_of(motion: Motion, frames: IntArray, ends: IntArray) -> FloatArray:
    """Rotation by rows and translation of both ends (2,) or (K, 2) of a pair at frames (K,), as (K, 2, 12)."""
    rotation, move = motion.rotations[frames[..., None], ends], motion.translations[frames[..., None], ends]
    return np.concatenate([rotation.reshape(*rotation.shape[:-2], 9), move], axis=-1)


def _moved_poses(poses: FloatArray, centre: FloatArray, radius: float, epsilon: float) -> BoolArray:
    """Marks which of K poses (1 + K, 2, 12) are further than ``epsilon`` from the last query; the first is that query.

    Seen from the second body, the ball of the first moves by at most ``|dR|_F d + |dc|``: the Frobenius norm bounds the
    map, the centre moves by itself. Each question sets the pose that the next are compared with, so errors do not add.
    """
    rotations, moves = poses[..., :9].reshape(-1, 2, 3, 3), poses[..., 9:]
    back = rotations[:, 1].transpose(0, 2, 1)
    rotation = back @ rotations[:, 0]
    centres = np.einsum("kab,b->ka", rotation, centre) + np.einsum("kab,kb->ka", back, moves[:, 0] - moves[:, 1])
    queried, moved = 0, np.zeros(len(poses), dtype=np.bool_)
    for k in range(1, len(poses)):
        path = np.linalg.norm(rotation[k] - rotation[queried]) * radius + np.linalg.norm(centres[k] - centres[queried])
        if not path <= epsilon:  # so that what is not a number has moved
            moved[k], queried = True, k
    return moved[1:]


@dataclass(frozen=True, kw_only=True)
class StaticSettings(ContainmentSettings):
    """Settings of ``static``.

    ``epsilon``: metres; an answer stays while no point of one body has moved further than this relative to the other
    since the last query. 0: while both poses are bit for bit those of the last query.
    """

    epsilon: float = number(0.0, 0, MOST_METRES, unit="metres")


class StaticDetector(MeshDetector):
    """Asks the meshes of a pair only when one of the two has moved: N frozen frames are one query.

    A query is a sphere test and, where spheres overlap, a mesh query. ``work``: ``pair_looks``, the queries done,
    ``hold_work`` pair-frames answered from the query before, ``mesh_queries`` among the queries. With ``epsilon`` above
    0 a held answer can be wrong by that distance.

    Source: the paper's row *static*, "suitable when objects are stationary and do not collide".
    """

    name = "static"
    Settings = StaticSettings
    stages = ("spheres", "meshes", "containment")
    sources = (f"{PAPER}, Fig. 5, static detection", FCL)
    choose_when = "things stand still most of the time"
    cannot = "be fast when everything moves"


@dataclass(frozen=True, kw_only=True)
class DiscreteSettings(ContainmentSettings, RateSettings):
    """When to look, and whether to ask for containment."""


class DiscreteDetector(MeshDetector):
    """Tests every pair at each tick of its rate and holds the answer until the next test (zero-order hold).

    A test (a *look*) happens at the first frame at or after a tick ``sampling_offset_s + k / rate_hz``, and at the
    first frame of all. The verdict of a frame between two looks is *held*: a live engine would still believe it, and it
    may be wrong. A look at which a pair has no pose keeps the verdict before. A frame without a pose is NO_POSE, even
    where a verdict is held.

    ``hybrid`` gives the same verdicts at every frame. ``work["held"]`` counts the pair-frames between looks.
    """

    name = "discrete"
    Settings = DiscreteSettings
    sources = (f"{PAPER}, Fig. 5, discrete detection", FCL)
    choose_when = "you want to know what an engine of that rate misses"
    cannot = "see what happens between its samples"

    def explain(self, motion: Motion, frame: int, pair: int, faces: IntArray) -> Explanation:
        """Say whether a frame was tested, and where it was whether the volumes meet."""
        del faces
        if not is_sampled(motion.times, frame, self._rate_hz, self._offset_s):
            return Explanation(looked=False)
        spheres_meet, boxes_meet = self._broad.volumes_meet(motion, frame, pair)
        return Explanation(looked=True, spheres_meet=spheres_meet, boxes_meet=boxes_meet)


class HybridDetector(MeshDetector):
    """The paper's pipeline without its search: spheres over the whole motion, boxes, FCL meshes, containment.

    It is complete in general position, and inherits FCL's limits on degenerate faces and resting ties (see
    ``cdcore.narrow.fcl_meshes``); ``exact`` has none.

    Source: section 4 of the paper, with its inverted condition put right: spheres that do *not* meet end the matter.
    Cost: spheres and boxes some ten nanoseconds a pair-frame, meshes some ten microseconds each.
    """

    name = "hybrid"
    Settings = ContainmentSettings
    sources = (f"{PAPER}, section 4", FCL)
    choose_when = "you want contacts and faces of ordinary meshes from a widely used engine"
    cannot = "be exact on degenerate faces and resting ties"
