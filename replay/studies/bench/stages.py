"""Where the time of ``exact`` goes, in seconds a stage, and how its cost grows with frames, bodies and faces.

Spheres, trees and faces take turns in one compiled loop, so they are told apart by leaving out: the search is run once
more with trees that are cut to their root, and once with trees whose leaves are empty. That splits complete face sets;
a boolean ends at its first contact, so there trees and faces stay together.

Reading the poses is linear and cannot be otherwise. The search among distant bodies is not: its counters grow by a test
a pair where frames grow eightfold.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

import numpy as np

from cdcore import Motion, TriangleMesh
from cdcore.kernels.memory import row_of
from cdcore.narrow.spacetime.box_tree import BoxTree, build_box_tree
from cdcore.narrow.spacetime.pair_job import Poses
from cdcore.narrow.spacetime.whole_motion import decide_motion
from replay.studies.bench.engines import OwnExact
from replay.studies.bench.race import timed
from replay.studies.bench.workload import BenchWorkload, make_workload

STAGES: Final = ("check", "poses", "spheres", "trees", "faces", "exact", "sorting")
"""Are poses finite and rigid; reading them; spheres over spans and paths; box trees; faces at leaves; what only exact
arithmetic decides; sorting and collecting face sets."""
REPEATS: Final = 5
ARRAYS: Final = BoxTree._fields[:-2]

WHERE: Final = ("distant", "near")
READING: Final = ("check", "poses")
"""Stages that read every pose: is it finite and rigid, where is the body, how far does it move."""
SIZE_REPEATS: Final = 4


@dataclass(frozen=True)
class Stages:
    """Seconds of ``STAGES`` for one workload; ``faces`` of a boolean is within ``trees`` and missing."""

    workload: str
    what: str
    faces: int
    seconds: dict[str, float]


def stages(workload: str, load: BenchWorkload, what: str) -> Stages:
    """Time the stages of one call, trees kept: the least of some repeats each."""
    trees = [build_box_tree(TriangleMesh(*mesh).triangles) for mesh in load.meshes]
    times = np.arange(len(load.poses)) / load.rate_hz
    checked = [timed(partial(Motion.from_matrices, times, load.poses)) for _ in range(REPEATS + 1)]
    motion = checked[0][1]
    poses = Poses(motion.rotations, motion.translations, motion.valid, motion.still)

    def spent(some: Sequence[BoxTree]) -> dict[str, float]:
        runs = [decide_motion(some, load.pairs, poses, faces=what == "faces").seconds for _ in range(REPEATS + 1)]
        return {name: min(run[name] for run in runs) for name in runs[0]}

    whole, roots = spent(trees), spent([root_only(tree) for tree in trees])["search"]
    seconds = {"check": min(each for each, _ in checked), "poses": whole["poses"], "spheres": roots}
    inside = max(0.0, whole["search"] - roots)
    if what == "faces":
        hollow = spent([without_faces(tree) for tree in trees])["search"]
        seconds["trees"] = min(inside, max(0.0, hollow - roots))
        seconds["faces"] = inside - seconds["trees"]
    else:
        seconds["trees"] = inside
    seconds |= {"exact": whole["exact"], "sorting": whole["faces"]}
    return Stages(workload, what, len(load.meshes[0][1]), seconds)


def root_only(tree: BoxTree) -> BoxTree:
    """A tree whose root is a leaf without faces: bodies are dismissed as by the whole tree, then nothing is asked."""
    links, leaves = np.array([[-1, 0]], dtype=np.int32), np.zeros((1, 4), dtype=np.int32)
    return _with(tree, boxes=tree.boxes[:1].copy(), links=links, leaves=leaves)


def without_faces(tree: BoxTree) -> BoxTree:
    """A tree whose leaves have no faces: it is descended as the whole tree is where all faces are asked for."""
    leaves = tree.leaves.copy()
    leaves[:, [1, 3]] = 0
    return _with(tree, leaves=leaves)


def _with(tree: BoxTree, **arrays: Any) -> BoxTree:
    changed = tree._replace(**arrays)
    return changed._replace(row=row_of([getattr(changed, name) for name in ARRAYS]))


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
        (timed(partial(engine.staged, "bool")) for _ in range(SIZE_REPEATS)), key=lambda one: one[0]
    )
    work = {name: int(np.sum(count)) for name, count in found.work.items()}
    return Growth(where, grows, size, found.verdict.size, seconds, work, stages)
