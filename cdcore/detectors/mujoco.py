"""A real engine: MuJoCo itself decides about the convex hulls of the meshes, at fixed steps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import ClassVar

import numpy as np

from cdcore.narrow.mujoco_hulls import MujocoHulls
from cdcore.numerics import IntArray
from cdcore.protocol import DECIDED, Body, Detection, Explanation, Motion, PairDetector, contact_or_clear, pair_has_pose
from cdcore.protocol.blocks import HeldVerdicts, looks_at, looks_of
from cdcore.protocol.settings import MOST_HERTZ, MOST_METRES, CheckedSettings, number


@dataclass(frozen=True, kw_only=True)
class MujocoSettings(CheckedSettings):
    """Settings of ``mujoco``.

    ``rate_hz``: looks per second of session time, 500 is MuJoCo's own step; ``None``: every frame.
    ``margin_m``: metres of distance at which MuJoCo already lists a contact.
    """

    rate_hz: float | None = number(None, 0, MOST_HERTZ, above=True, unit="looks per second", optional=True)
    margin_m: float = number(0.0, 0, MOST_METRES, unit="metres")


class MujocoDetector(PairDetector[MujocoSettings]):
    """Asks MuJoCo for its list of contacts between convex hulls, and holds each answer until its next look.

    Choose it to see a shipped engine's own answer, where ``collider`` re-creates one. A hull within a hull is CONTACT.
    It lists no faces. A mesh thinner than 10 micrometres gets that thickness, because MuJoCo refuses flat ones.

    Source: ``mj_collision`` with MuJoCo's own settings. Needs the extra ``engines``, else a MissingEngineError.
    """

    name: ClassVar[str] = "mujoco"
    kind: ClassVar[str] = "engine"
    online: ClassVar[bool] = True
    Settings: ClassVar[type] = MujocoSettings
    sources: ClassVar[tuple[str, ...]] = (
        "E. Todorov, T. Erez, Y. Tassa, MuJoCo: a physics engine for model-based control, IROS 2012",
    )
    choose_when: ClassVar[str] = "you want the answer of a shipped engine, not of its re-creation"
    cannot: ClassVar[str] = "see hollows, list faces, or tell distances below a micrometre"

    def __init__(self, bodies: Sequence[Body], pairs: IntArray, settings: MujocoSettings) -> None:
        super().__init__(bodies, pairs, settings)
        self._hulls = MujocoHulls(bodies, pairs, settings.margin_m)

    def explain(self, motion: Motion, frame: int, pair: int, faces: IntArray) -> Explanation:
        """Say whether the frame was tested, and whether MuJoCo lists the pair there."""
        del faces
        hits = self._hulls.touch(motion.rotations[frame], motion.translations[frame], motion.valid[frame])
        return Explanation(looked=looks_at(motion.times, frame, self.settings.rate_hz), shapes_meet=bool(hits[pair]))

    def _fresh_memory(self) -> HeldVerdicts:
        return HeldVerdicts(len(self.pairs))

    def _run(self, motion: Motion, memory: HeldVerdicts, _faces: bool) -> Detection:
        looks, memory.tick = looks_of(motion.times, self.settings.rate_hz, memory.tick)
        hits, seconds = np.zeros((int(looks.sum()), len(self.pairs)), dtype=np.bool_), np.zeros(len(motion))
        for row, frame in enumerate(np.flatnonzero(looks).tolist()):
            start = perf_counter()
            hits[row] = self._hulls.touch(motion.rotations[frame], motion.translations[frame], motion.valid[frame])
            seconds[frame] = perf_counter() - start
        seen = contact_or_clear(hits, motion.take(np.flatnonzero(looks)), self.pairs)
        verdict, work = memory.hold(seen, looks, pair_has_pose(motion, self.pairs))
        decided = (DECIDED,) * len(self.pairs)
        return self._detection(motion, verdict, containment=decided, work=work, seconds={"engine": seconds})
