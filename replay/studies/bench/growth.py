"""How the cost of ``exact`` grows with frames, bodies and faces, where bodies are near each other and where not.

Reading the poses is linear and cannot be otherwise. The search among distant bodies is not: its counters grow by a
test a pair where frames grow eightfold.
"""

from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np

from replay.studies.bench.engines import OwnExact
from replay.studies.bench.race import timed
from replay.studies.bench.workload import make_workload

WHERE: Final = ("distant", "near")
READING: Final = ("check", "poses")
"""Stages that read every pose: is it finite and rigid, where is the body, how far does it move."""
REPEATS: Final = 4


@dataclass(frozen=True)
class Growth:
    """One size of a session: what ``exact`` took and did; ``work`` and ``stages`` say where the time went."""

    where: str
    grows: str
    size: int
    pair_frames: int
    seconds: float
    work: dict[str, int]
    stages: dict[str, float]

    @property
    def reading(self) -> float:
        """Seconds that every pose costs, whatever the bodies do."""
        return sum(self.stages.get(name, 0.0) for name in READING)

    @property
    def search(self) -> float:
        """Seconds spent on pairs: spheres over spans of frames, then trees and faces."""
        return self.stages.get("search", 0.0) + self.stages.get("exact", 0.0)

    @property
    def tests(self) -> int:
        """All tests of the search: spans, gaps along paths, boxes, faces."""
        return sum(self.work.get(name, 0) for name in ("span_tests", "gap_tests", "node_tests", "face_tests"))


def grow(where: str, grows: str, size: int, *, seed: int = 0) -> Growth:
    """Time ``exact`` on a session of one size, with bodies "distant" (5 m from each other) or "near" (on one bench).

    ``grows`` is frames, bodies or faces; the others stay at 5,400, 7 and 500.
    """
    sizes = {"faces": 500, "frames": 5400, "bodies": 7} | {grows: size}
    load = make_workload(sizes["faces"], sizes["frames"], bodies=sizes["bodies"], seed=seed, distant=where == "distant")
    engine = OwnExact(load)
    engine.ask("bool")
    seconds, (stages, found) = min(
        (timed(partial(engine.staged, "bool")) for _ in range(REPEATS)), key=lambda one: one[0]
    )
    work = {name: int(np.sum(count)) for name, count in found.work.items()}
    return Growth(where, grows, size, found.verdict.size, seconds, work, stages)
