"""Where the time of ``exact`` goes, in seconds a stage.

Spheres, trees and faces take turns in one compiled loop, so they are told apart by leaving out: the search is run once
more with trees that are cut to their root, and once with trees whose leaves are empty. That splits complete face sets;
a boolean ends at its first contact, so there trees and faces stay together.
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
from replay.studies.bench.race import timed
from replay.studies.bench.workload import BenchWorkload

STAGES: Final = ("check", "poses", "spheres", "trees", "faces", "exact", "sorting")
"""Are poses finite and rigid; reading them; spheres over spans and paths; box trees; faces at leaves; what only exact
arithmetic decides; sorting and collecting face sets."""
REPEATS: Final = 5
ARRAYS: Final = BoxTree._fields[:-2]


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
