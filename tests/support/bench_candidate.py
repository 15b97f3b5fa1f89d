"""The detector ``exact`` as a candidate of a common collision benchmark: the whole public path, validation included.

A workload has ``names``, ``meshes``, ``poses`` (T, N, 4, 4) from body to world, ``pairs`` (P, 2) and ``rate_hz``.
"""

from time import perf_counter

import numpy as np

from cdcore import Body, Motion, TriangleMesh, Verdict, create_detector


class OwnExact:
    """The detector ``exact`` by default settings: poses checked in every call, trees kept, answers never.

    Containment is decided, which no peer does; it is no contact of surfaces and so not part of the answer.
    """

    def __init__(self, load):
        self.load = load
        bodies = [Body(name, TriangleMesh(*mesh)) for name, mesh in zip(load.names, load.meshes, strict=True)]
        self._detector = create_detector("exact", bodies, pairs=load.pairs)

    def staged(self, what):
        """Seconds of every stage, the check of the poses first, and the ``Detection``."""
        begin = perf_counter()
        motion = Motion.from_matrices(np.arange(len(self.load.poses)) / self.load.rate_hz, self.load.poses)
        checked = perf_counter() - begin
        found = self._detector.detect(motion, faces=what == "faces")
        return {"check": checked} | {name: float(np.sum(spent)) for name, spent in found.seconds.items()}, found

    def ask(self, what):
        """Of every pair in every frame (T, P): for "faces" how many pairs of faces meet, for "bool" 0 or 1."""
        found = self.staged(what)[1]
        return found.face_counts if what == "faces" else (found.verdict == Verdict.CONTACT).view(np.int8)


class Candidate:
    """Answers ``(workload, what)`` as `OwnExact` does; trees are kept between calls for the same meshes."""

    engine = None

    def __call__(self, workload, what):
        if self.engine is None or self.engine.load.meshes is not workload.meshes:
            self.engine = OwnExact(workload)
        self.engine.load = workload
        return self.engine.ask(what)


run = Candidate()
"""For ``peers.py --candidate support.bench_candidate:run``, with ``tests`` on the path."""
