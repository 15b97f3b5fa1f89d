"""The common part of rows that ask a physics engine: which frames it is asked, and what its list of contacts means."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any, ClassVar, Protocol, TypeVar

import numpy as np

from cdcore.engines.engine_solids import EngineSolid, engine_poses, engine_solid
from cdcore.numerics import BoolArray, FloatArray, IntArray
from cdcore.protocol import (
    DECIDED,
    Body,
    Detection,
    Explanation,
    Motion,
    PairDetector,
    Verdict,
    ZeroOrderHold,
    contact_or_clear,
    is_sampled,
    pair_has_pose,
)
from cdcore.protocol.settings import RateSettings, choice
from cdcore.tolerances import LARGEST_OF_SQUARES_M


@dataclass(frozen=True, kw_only=True)
class ShapedSettings(RateSettings):
    """Settings of a row whose engine has triangle meshes.

    ``shape``: hull, the convex hull of every mesh; or mesh, the triangles of a mesh that is not convex.
    """

    shape: str = choice("hull", ("hull", "mesh"))


class EngineWorld(Protocol):
    """An engine with the solids of a scene in it."""

    def __init__(self, solids: list[EngineSolid], pairs: IntArray, settings: Any) -> None:
        """The engine with these solids, asked about ``pairs`` (P, 2).

        MissingEngineError where it is not installed, InvalidMeshError where it refuses a mesh.
        """

    def touching(self, translations: FloatArray, rotations: FloatArray, valid: BoolArray) -> Any:
        """Numbers of two solids for every contact in the engine's list, (k, 2).

        ``translations`` (N, 3) metres, ``rotations`` (N, 4) quaternions x, y, z, w; rows that are not ``valid`` (N,)
        have no pose and touch nothing.
        """
        ...


SettingsT = TypeVar("SettingsT", bound=RateSettings)


class EngineDetector(PairDetector[SettingsT]):
    """Asks an engine for its contacts at the recorded poses, and holds each answer until its next look.

    A pair of shapes that the engine has no test for is INVALID, "not supported", not CLEAR. Bodies stand in the order
    of their names, so that neither their order nor that of a pair changes an answer.
    """

    kind = "engine"
    stages = ("engine",)
    online = True
    largest_m = LARGEST_OF_SQUARES_M
    title: ClassVar[str]
    """The engine's name in sentences."""
    World: ClassVar[type[EngineWorld]]
    meshes_meet = False
    """Whether the engine tests one triangle mesh against another."""
    least_thickness = 1e-4
    """Metres: engines refuse flat meshes, so one that is thinner than this gets this thickness."""

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, settings: SettingsT) -> None:
        super().__init__(bodies, pairs, settings)
        self._order = np.array(sorted(range(len(bodies)), key=lambda k: bodies[k].name), dtype=np.int64)
        shape = getattr(settings, "shape", "hull")
        self._solids = [engine_solid(bodies[k], shape, self.title, self.least_thickness) for k in self._order.tolist()]
        self._columns = np.sort(np.argsort(self._order)[pairs], axis=1)
        meshes = np.array([solid.faces is not None for solid in self._solids], dtype=np.bool_)
        self._refused: BoolArray = np.zeros(len(pairs), dtype=np.bool_)
        if not self.meshes_meet:
            self._refused |= meshes[self._columns].all(axis=1)
        self.world = self.World(self._solids, self._columns, settings)

    def explain(self, motion: Motion, frame: int, pair: int, faces: IntArray) -> Explanation:
        """Say whether the frame was tested, and whether the engine lists the pair there; ``None``: not supported."""
        del faces
        is_tested = motion.valid[frame, self.pairs[pair]].all() and not self._refused[pair]
        meet = bool(self._touch(motion, frame)[pair]) if is_tested else None
        settings = self.settings
        sampled = is_sampled(motion.times, frame, settings.rate_hz, settings.sampling_offset_s)
        return Explanation(looked=sampled, shapes_meet=meet)

    def _fresh_memory(self) -> ZeroOrderHold:
        return ZeroOrderHold(len(self.pairs), self.settings.rate_hz, self.settings.sampling_offset_s)

    def _touch(self, motion: Motion, frame: int) -> BoolArray:
        """Marks the pairs that the engine lists, (P,)."""
        valid = motion.valid[frame, self._order]
        # A pose that is not valid may hold anything.
        rotations = np.where(valid[:, None, None], motion.rotations[frame, self._order], np.eye(3))
        translations = np.where(valid[:, None], motion.translations[frame, self._order], 0.0)
        touching = self.world.touching(*engine_poses(self._solids, rotations, translations), valid)
        hits = np.zeros((len(valid), len(valid)), dtype=np.bool_)
        lower, upper = np.sort(np.reshape(touching, (-1, 2)).astype(np.int64), axis=1).T
        hits[lower, upper] = True
        return hits[tuple(self._columns.T)]

    def _run(self, motion: Motion, memory: ZeroOrderHold, _faces: bool) -> Detection:
        sampled, known = memory.sampled(motion.times), pair_has_pose(motion, self.pairs)
        frames = np.flatnonzero(sampled)
        hits, seconds = np.zeros((len(frames), len(self.pairs)), dtype=np.bool_), np.zeros(len(motion))
        for row, frame in enumerate(frames.tolist()):
            start = perf_counter()
            hits[row] = self._touch(motion, frame)
            seconds[frame] = perf_counter() - start
        sample_verdict = contact_or_clear(hits, motion.take(frames), self.pairs)
        verdict, work = memory.hold(sample_verdict, known[sampled], sampled, known)
        verdict[self._refused & (verdict != Verdict.NO_POSE)] = Verdict.INVALID
        why = f"not supported: {self.title} tests no triangle mesh against another"
        in_vain = [(int(frame), int(pair)) for frame, pair in np.argwhere(verdict == Verdict.INVALID)]
        return self._detection(
            motion,
            verdict,
            containment=[f"refused: {why}" if refused else DECIDED for refused in self._refused],
            work=work,
            seconds={"engine": seconds},
            reasons=dict.fromkeys(in_vain, why),
        )
