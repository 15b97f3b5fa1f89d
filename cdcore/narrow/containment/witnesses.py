"""Which part of which body lies inside the other: a corner of it, for whoever wants to check."""

from __future__ import annotations

import numpy as np

from cdcore.narrow.containment.containment_stage import ContainmentStage
from cdcore.numerics import IntArray
from cdcore.protocol import Motion


def corners_inside(stage: ContainmentStage, motion: Motion, column: int) -> IntArray:
    """Of T frames in which a part of one body of a pair is inside the other, (T, 2).

    Whether that is the pair's second body, and a corner of the part, three a face; -1 where none is inside.
    """
    found, left = np.full((len(motion), 2), -1, dtype=np.int64), np.arange(len(motion))
    for inner, outer, parts in stage.nestings[column]:
        poses = motion.rotations, motion.translations, inner, outer
        corners = stage.solids[inner].mesh.triangles.reshape(-1, 3)
        for part in parts:
            inside = left[stage.inside(poses, inner, outer, (part,), left)]
            found[inside] = inner != stage.pairs[column][0], np.flatnonzero((corners == part.probes[0]).all(axis=1))[0]
            left = np.setdiff1d(left, inside)
    return found
