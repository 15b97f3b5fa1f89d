"""Verdicts of colliders at every frame, kept a pair: a choice that changes one body asks the pairs of this body alone.

A search tries hundreds of choices that differ in one body. Every step rate samples these verdicts, so that none is
detected by itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from cdcore import Detection, Verdict
from cdcore.mesh import TriangleMesh
from cdcore.numerics import ByteArray
from cdcore.protocol import Solids, ZeroOrderHold
from replay.detection.detector_spec import DetectorSpec
from replay.detection.run_detector import detect_all, make_detector
from replay.prepare.assembly import Assembly

MOST_BYTES: Final = 2**27
"""Verdicts that are kept at most: 12 choices of an hour of ten bodies, thousands of a minute."""


class ColliderVerdicts:
    """The verdicts of a session's bodies with any colliders; a pair with the same two surfaces is detected once.

    ``skin_m``: metres around each collider within which it is in contact.
    """

    def __init__(self, assembly: Assembly, skin_m: float = 0.0) -> None:
        self._assembly = assembly
        self._spec = DetectorSpec("colliders", "collider", {"shape": "shipped", "skin_m": skin_m})
        self.verdict_by_key: dict[tuple[int, TriangleMesh, TriangleMesh], ByteArray] = {}

    def at_every_frame(self, colliders: Mapping[str, Solids]) -> Detection:
        """The detection of every frame; ``colliders``: name of a body -> its solids, for all bodies."""
        assembly = self._assembly
        surfaces = [colliders[name].surface for name in assembly.names]
        keys = [(column, surfaces[a], surfaces[b]) for column, (a, b) in enumerate(assembly.pairs.tolist())]
        missing_columns = [column for column, key in enumerate(keys) if key not in self.verdict_by_key]
        verdicts_of_key = {
            keys[column]: verdict for column, verdict in self._detect_columns(missing_columns, colliders).items()
        }
        verdict = np.empty((len(assembly.motion), len(keys)), dtype=np.uint8)
        for column, key in enumerate(keys):
            verdict[:, column] = verdicts_of_key[key] if key in verdicts_of_key else self.verdict_by_key[key]
        self._keep(verdicts_of_key)
        return Detection("collider", assembly.names, assembly.pairs, assembly.motion.times, verdict)

    def _detect_columns(self, columns: list[int], colliders: Mapping[str, Solids]) -> dict[int, ByteArray]:
        """Column of a pair -> its verdicts (T,), detected now."""
        if not columns:
            return {}
        bodies = tuple(replace(body, colliders=colliders[body.name]) for body in self._assembly.bodies)
        pair_assembly = replace(self._assembly, bodies=bodies, pairs=self._assembly.pairs[columns])
        verdict = detect_all(make_detector(self._spec, pair_assembly, 0), pair_assembly).verdict
        return {column: verdict[:, number].copy() for number, column in enumerate(columns)}

    def _keep(self, verdicts_of_key: Mapping[tuple[int, TriangleMesh, TriangleMesh], ByteArray]) -> None:
        """Keep verdicts; of too many those that were kept first are dropped."""
        self.verdict_by_key.update(verdicts_of_key)
        most_kept = max(len(self._assembly.pairs), MOST_BYTES // max(1, len(self._assembly.motion)))
        for key in list(self.verdict_by_key)[: max(0, len(self.verdict_by_key) - most_kept)]:
            del self.verdict_by_key[key]


def sampled_at_rate(frame_by_frame: Detection, rate_hz: float | None, offset_s: float = 0.0) -> Detection:
    """The detection of the same detector with a step rate: each sample is held until the next one."""
    has_pose = frame_by_frame.verdict != Verdict.NO_POSE
    samples = ZeroOrderHold(len(frame_by_frame.pairs), rate_hz, offset_s)
    sampled_frames = samples.sampled(frame_by_frame.times)
    verdict, _ = samples.hold(
        frame_by_frame.verdict[sampled_frames], has_pose[sampled_frames], sampled_frames, has_pose
    )
    return replace(frame_by_frame, verdict=verdict)
