"""Faces of two bodies that meet, from all pairs of faces in whole numbers: slow, short, with nothing of the core.

Places points by the one formula that counts, leaves out what boxes or a wide margin in floats keep apart, and asks the
rest with separating axes in integers.
"""

import numpy as np
from oracles.separating_axes import meets_by_axes


def placed(triangles, rotation, translation):
    """World corners of triangles (f, 3, 3): ``((r00 x + r01 y) + r02 z) + t`` in float64."""
    x, y, z = np.moveaxis(triangles, -1, 0)
    return np.stack(
        [((rotation[i, 0] * x + rotation[i, 1] * y) + rotation[i, 2] * z) + translation[i] for i in range(3)], axis=-1
    )


def far_separate(pairs):
    """Marks triangle pairs (n, 2, 3, 3) with a gap along an axis that rounding could not close, (n,)."""
    with np.errstate(all="ignore"):
        size = np.abs(pairs).max(axis=(1, 2, 3))
        unit = pairs / size[:, None, None, None]
        local = unit - unit[:, :1, :1]
        edges = np.roll(local, -1, axis=2) - local
        normals = np.cross(edges[:, :, 0], edges[:, :, 1])
        crosses = np.cross(edges[:, 0, :, None], edges[:, 1, None]).reshape(-1, 9, 3)
        axes = np.concatenate([normals, crosses], axis=1)
        along = np.einsum("nak,nbck->nabc", axes, local)
        a, b = along[:, :, 0], along[:, :, 1]
        gap = np.maximum(a.min(-1) - b.max(-1), b.min(-1) - a.max(-1))
        length = np.abs(axes).sum(axis=2)
        return (gap > 1e-9 * length).any(axis=1)


def meeting_faces(first, second):
    """Face pairs (k, 2) of placed triangles (f, 3, 3) and (g, 3, 3) with a point in common, sorted."""
    near = (first.min(axis=1)[:, None] <= second.max(axis=1)) & (second.min(axis=1) <= first.max(axis=1)[:, None])
    rows = np.argwhere(near.all(axis=2))
    pairs = np.stack([first[rows[:, 0]], second[rows[:, 1]]], axis=1)
    left = np.flatnonzero(~far_separate(pairs))
    return rows[[k for k in left.tolist() if meets_by_axes(pairs[k])]].reshape(-1, 2)
