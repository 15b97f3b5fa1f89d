"""The detector ``exact`` as a candidate of the common collision benchmark: the whole public path, validation included.

Trees are kept between calls for the same meshes, answers never.
"""

from replay.studies.bench.engines import Answer, OwnExact
from replay.studies.bench.workload import BenchWorkload


class Candidate:
    """Answers ``(workload, what)``: face pairs per frame and pair (T, P) for "faces", 0 and 1 for "bool"."""

    _engine: OwnExact | None = None

    def __call__(self, workload: BenchWorkload, what: str) -> Answer:
        """Decide every pair in every frame."""
        if self._engine is None or self._engine.load.meshes is not workload.meshes:
            self._engine = OwnExact(workload)
        self._engine.load = workload
        return self._engine.ask(what)


run = Candidate()
"""For ``peers.py --candidate replay.studies.bench.candidate:run``."""
