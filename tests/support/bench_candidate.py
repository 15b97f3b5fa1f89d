"""The detector ``exact`` as a candidate of a common collision benchmark: the whole public path, validation included.

Trees are kept between calls for the same meshes, answers never.
"""

from time import perf_counter
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from cdcore import Body, Detection, Motion, TriangleMesh, Verdict, create_detector
from cdcore.numerics import FloatArray, IntArray

Answer = IntArray | NDArray[np.int8]
"""(T, P) distinct face pairs, or 0 and 1."""


class Workload(Protocol):
    """What is asked: bodies with meshes, poses (T, N, 4, 4), body to world, and pairs (P, 2)."""

    names: Any
    meshes: Any
    poses: FloatArray
    pairs: IntArray
    rate_hz: float


class OwnExact:
    """The detector ``exact`` by default settings: poses checked in every call, trees kept, answers never.

    Containment is decided, which no peer does; it is no contact of surfaces and so not part of the answer.
    """

    def __init__(self, load: Workload) -> None:
        self.load = load
        bodies = [Body(name, TriangleMesh(*mesh)) for name, mesh in zip(load.names, load.meshes, strict=True)]
        self._detector = create_detector("exact", bodies, pairs=load.pairs)

    def staged(self, what: str) -> tuple[dict[str, float], Detection]:
        """Seconds of every stage, the check of the poses first, and the ``Detection``."""
        begin = perf_counter()
        times = np.arange(len(self.load.poses)) / self.load.rate_hz
        motion = Motion.from_matrices(times, self.load.poses)
        checked = perf_counter() - begin
        found = self._detector.detect(motion, faces=what == "faces")
        return {"check": checked} | {name: float(np.sum(spent)) for name, spent in found.seconds.items()}, found

    def ask(self, what: str) -> Answer:
        """Every pair in every frame."""
        found = self.staged(what)[1]
        return found.face_counts if what == "faces" else (found.verdict == Verdict.CONTACT).view(np.int8)


class Candidate:
    """Answers ``(workload, what)``: face pairs per frame and pair (T, P) for "faces", 0 and 1 for "bool"."""

    _engine: OwnExact | None = None

    def __call__(self, workload: Workload, what: str) -> Answer:
        """Decide every pair in every frame."""
        if self._engine is None or self._engine.load.meshes is not workload.meshes:
            self._engine = OwnExact(workload)
        self._engine.load = workload
        return self._engine.ask(what)


run = Candidate()
"""For ``peers.py --candidate support.bench_candidate:run``, with ``tests`` on the path."""
