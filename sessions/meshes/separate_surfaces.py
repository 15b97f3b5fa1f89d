"""Tells a mesh of several surfaces far from each other, such as a beaker and a stray object, from that of one thing.

Two groups of faces are far apart where an empty slab lies between them that is thick beside both: thicker than half of
the smaller group is long, and than a tenth of the larger one. A lid above its jar, a wall within a wall and the parts
of a device are nearer.
"""

from itertools import product
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sessions.mesh_data import MeshData
from sessions.quantities import length

Numbers = NDArray[np.float64]

OF_SMALLER: Final = 0.5
OF_LARGER: Final = 0.1
"""An empty slab thicker than these parts of the lengths of the groups on its two sides sets them apart."""
BINS: Final = 64
MOST_GROUPS: Final = 100
"""Of a mesh with more groups, such as a cloud of crumbs, no more are looked for."""


def _directions() -> Numbers:
    """Unit vectors (13, 3) along axes, edges and diagonals of a cube, of each line one."""
    lines = [line for line in product((-1, 0, 1), repeat=3) if line > (0, 0, 0)]
    vectors = np.array(lines, dtype=np.float64)
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


DIRECTIONS: Final = _directions()


def separate_surfaces(mesh: MeshData) -> tuple[int, float]:
    """How many surfaces far apart a mesh holds, and the narrowest distance in metres between two groups of them.

    The distance is at least so large: the thickness of the empty slab. One surface has the distance 0.
    """
    heights = mesh.vertices @ DIRECTIONS.T
    a, b, c = (heights[corner] for corner in mesh.faces.T)
    lower, upper = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    if not _has_thick_gap(lower, upper):
        return 1, 0.0
    triangles = mesh.triangles
    waiting, count, narrowest = [np.arange(len(triangles))], 0, np.inf
    while waiting and count + len(waiting) < MOST_GROUPS:
        faces = waiting.pop()
        below, gap = _halves(triangles[faces], lower[faces], upper[faces])
        if below is None:
            count += 1
            continue
        narrowest = min(narrowest, gap)
        waiting += [faces[below], faces[~below]]
    count += len(waiting)
    return count, float(narrowest) if count > 1 else 0.0


def separate_surfaces_text(mesh: MeshData) -> str:
    """A sentence on the surfaces of a mesh that are far apart, or ``""``."""
    count, gap = separate_surfaces(mesh)
    return separation_text(count, gap) if count > 1 else ""


def separation_text(count: int, gap: float) -> str:
    """The words on so many surfaces with so many metres between them."""
    return f"{count} separate surfaces, {length(gap)} or more apart"


def _has_thick_gap(lower: Numbers, upper: Numbers) -> bool:
    """Whether some direction has an empty slab of a thickness that can set groups apart, by bins; lower, upper (f, 13).

    The groups of a slab are projected onto lengths of at most twice and ten times its thickness: it is thicker than a
    13th of all, which are four of the bins, of which two at least are empty.
    """
    for start, end in zip(lower.T, upper.T, strict=True):
        base, extent = float(start.min()), float(end.max() - start.min())
        if extent == 0.0:
            continue
        scale = BINS / extent
        first = np.bincount(((start - base) * scale).astype(np.int64), minlength=BINS)
        after = np.bincount(((end - base) * scale).astype(np.int64) + 1)
        is_empty = np.cumsum(first[:BINS] - after[:BINS]) == 0
        if (is_empty[1:] & is_empty[:-1]).any():
            return True
    return False


def _halves(triangles: Numbers, lower: Numbers, upper: Numbers) -> tuple[NDArray[np.bool_] | None, float]:
    """The faces (f,) on one side of the thickest empty slab that sets two groups apart, and its thickness."""
    thickest, below = 0.0, None
    for start, end in zip(lower.T, upper.T, strict=True):
        order = np.argsort(start)
        reach = np.maximum.accumulate(end[order])
        gaps = start[order][1:] - reach[:-1]
        if not len(gaps) or gaps.max() <= thickest:
            continue
        row = int(gaps.argmax())
        is_below = start <= reach[row]
        sizes = sorted(_length(triangles[side]) for side in (is_below, ~is_below))
        if gaps[row] > max(OF_SMALLER * sizes[0], OF_LARGER * sizes[1]):
            thickest, below = float(gaps[row]), is_below
    return below, thickest


def _length(triangles: Numbers) -> float:
    """The longest side of the box around faces, in metres."""
    corners = triangles.reshape(-1, 3)
    return float((corners.max(axis=0) - corners.min(axis=0)).max())
