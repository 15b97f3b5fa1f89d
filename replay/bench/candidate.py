"""The detector ``exact`` as a candidate of the common collision benchmark: the whole public path, validation included.

Trees are kept between calls for the same meshes, answers never.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from cdcore import Body, Detector, Motion, TriangleMesh, create_detector


class Workload(Protocol):
    """What the benchmark hands over: N meshes, their poses in T frames, P pairs."""

    names: Sequence[str]
    meshes: Sequence[tuple[NDArray[np.float64], NDArray[np.integer[Any]]]]
    poses: NDArray[np.float64]
    pairs: NDArray[np.int64]
    rate_hz: float


class Candidate:
    """Answers ``(workload, what)`` with one detector, prepared once per list of meshes."""

    def __init__(self, detector: str = "exact", **settings: object) -> None:
        self._name, self._settings = detector, settings
        self._meshes: object = None
        self._detector: Detector | None = None

    def __call__(self, workload: Workload, what: str) -> NDArray[np.integer[Any]]:
        """Face pairs per frame and pair (T, P) for "faces", 0 and 1 for "bool"."""
        motion = Motion.from_matrices(np.arange(len(workload.poses)) / workload.rate_hz, workload.poses)
        detection = self._prepared(workload).detect(motion, faces=what == "faces")
        return detection.face_counts if what == "faces" else detection.verdict

    def _prepared(self, workload: Workload) -> Detector:
        if self._detector is None or self._meshes is not workload.meshes:
            bodies = [
                Body(name, TriangleMesh(*mesh)) for name, mesh in zip(workload.names, workload.meshes, strict=True)
            ]
            self._detector = create_detector(self._name, bodies, pairs=workload.pairs, **self._settings)
            self._meshes = workload.meshes
        return self._detector


run = Candidate(containment=False)
"""``peers.py --candidate replay.bench.candidate:run``: the peers do not ask about containment, so neither does it."""
