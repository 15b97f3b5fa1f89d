"""Two nodes of trees in many frames: apart by a separating axis of their boxes, or because no two faces meet."""

from __future__ import annotations

from itertools import product
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from replay.proof.bodies import PAD, CheckedBody, Poses
from replay.proof.exact import Floats, meeting, placed

ITEMS: Final = 50_000
"""Boxes or faces tested at once; bounds the memory."""
Rows = NDArray[Any]


class Two(NamedTuple):
    """The bodies of a pair, their columns among the poses, and the poses."""

    bodies: tuple[CheckedBody, CheckedBody]
    columns: tuple[int, int]
    poses: Poses


def apart(two: Two, frame: Rows, nodes: Rows) -> NDArray[np.bool_]:
    """Whether an axis or a sphere keeps the faces below two nodes apart: K frames (K,), their nodes (K, 2)."""
    parts = [_apart(two, frame[k : k + ITEMS], nodes[k : k + ITEMS]) for k in range(0, len(frame), ITEMS)]
    return np.concatenate([np.zeros(0, dtype=np.bool_), *parts])


def _apart(two: Two, frame: Rows, nodes: Rows) -> NDArray[np.bool_]:
    a, b = two.bodies
    (turn_a, turn_b), (place_a, place_b) = (
        [values[frame, column] for column in two.columns] for values in (two.poses.rotation, two.poses.translation)
    )
    # rows are the axes of a box in the world
    axes_a, axes_b = a.axes[nodes[:, 0]] @ _turned(turn_a), b.axes[nodes[:, 1]] @ _turned(turn_b)
    half_a, half_b = a.half[nodes[:, 0]], b.half[nodes[:, 1]]
    centre_a, centre_b = _times(turn_a, a.centre[nodes[:, 0]]), _times(turn_b, b.centre[nodes[:, 1]])
    between = (place_b - place_a) + (centre_b - centre_a)
    pad = PAD * (a.reach + b.reach + np.abs(place_a).sum(axis=1) + np.abs(place_b).sum(axis=1))
    cosine = axes_a @ _turned(axes_b)
    size = np.abs(cosine)
    along_a, along_b = _times(axes_a, between), _times(axes_b, between)
    found = _beyond(along_a, half_a, _times(size, half_b), b.radius[nodes[:, 1]], pad)
    found |= _beyond(along_b, half_b, _times(_turned(size), half_a), a.radius[nodes[:, 0]], pad)
    for i, j in product(range(3), range(3)):
        p, q, r, s = (i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3
        distance = np.abs(along_a[:, q] * cosine[:, p, j] - along_a[:, p] * cosine[:, q, j])
        reach = half_a[:, p] * size[:, q, j] + half_a[:, q] * size[:, p, j]
        found |= distance > reach + half_b[:, r] * size[:, i, s] + half_b[:, s] * size[:, i, r] + pad
    return found


def _beyond(along: Floats, half: Floats, other: Floats, radius: Floats, pad: Floats) -> NDArray[np.bool_]:
    """Whether the other box lies beyond a side of this one, or the ball around it beyond the box."""
    over = np.maximum(np.abs(along) - half, 0.0)
    beyond: NDArray[np.bool_] = np.sqrt((over**2).sum(axis=1)) > radius + pad
    return beyond | (np.abs(along) > half + other + pad[:, None]).any(axis=1)


def _turned(matrix: Floats) -> Floats:
    return np.swapaxes(matrix, 1, 2)


def _times(matrix: Floats, vector: Floats) -> Floats:
    product_: Floats = (matrix @ vector[..., None])[..., 0]
    return product_


def faces_apart(two: Two, frame: Rows, nodes: Rows) -> tuple[NDArray[np.bool_], int, int]:
    """Whether no faces below two nodes meet, asked one by one: (K,); how many were asked, and how many of integers."""
    first, counts = (np.stack([one.nodes[nodes[:, k], c] for k, one in enumerate(two.bodies)], 1) for c in (0, 1))
    pairs = counts[:, 0] * counts[:, 1]
    ends, clear, exact = np.cumsum(pairs), np.ones(len(frame), dtype=np.bool_), 0
    total = int(pairs.sum())
    for start in range(0, total, ITEMS):
        number = np.arange(start, min(start + ITEMS, total))
        item = np.searchsorted(ends, number, side="right")
        within = number - (ends[item] - pairs[item])
        places = first[item, 0] + within // counts[item, 1], first[item, 1] + within % counts[item, 1]
        faces = [one.order[place] for one, place in zip(two.bodies, places, strict=True)]
        meet, asked = faces_meet(two, frame[item], faces[0], faces[1])
        clear[item[meet]] = False
        exact += asked
    return clear, total, exact


def faces_meet(two: Two, frame: Rows, face_a: Rows, face_b: Rows) -> tuple[NDArray[np.bool_], int]:
    """Whether two faces meet in each of K frames, and how many of them integers decided."""
    corners = [
        placed(one.triangles[face], two.poses.rotation[frame, k][:, None], two.poses.translation[frame, k][:, None])
        for one, k, face in zip(two.bodies, two.columns, (face_a, face_b), strict=True)
    ]
    return meeting(corners[0], corners[1])
