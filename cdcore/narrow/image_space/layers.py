"""Rays through closed meshes: where each enters and leaves, and how long two solids share it.

An edge belongs to one of its two faces: its side is computed from its ends in one order, so that both faces round
alike, and a ray through it counts once.
"""

from typing import NamedTuple

import numpy as np

from cdcore.kernels.compiling import hot_kernel, kernel, stay_one_function
from cdcore.numerics import FloatArray, IntArray


class Window(NamedTuple):
    """Corner, size of a pixel, number of pixels along each axis, (3,) each; ``shift`` (2,) of the rays, in pixels."""

    low: FloatArray
    size: FloatArray
    pixels: IntArray
    shift: FloatArray


class Layers(NamedTuple):
    """Where each pixel's layers start (n + 1,), their depths, ascending within a pixel, and their turns.

    A turn is -1 where a ray enters a mesh whose normals point out.
    """

    start: IntArray
    depths: FloatArray
    turns: IntArray


@hot_kernel
def side_of_edge(pu: float, pv: float, qu: float, qv: float, x: float, y: float) -> float:
    """Twice the area of p, q and the ray at (x, y): positive on the left of p -> q; exactly opposite for q -> p."""
    stay_one_function()
    swapped = pu > qu or (pu == qu and pv > qv)
    if swapped:
        pu, pv, qu, qv = qu, qv, pu, pv
    area: float = (qu - pu) * (y - pv) - (qv - pv) * (x - pu)
    if area == 0.0:
        area = 5e-324
    return -area if swapped else area


@hot_kernel
def crossing(face: FloatArray, u: int, v: int, w: int, x: float, y: float, depth: FloatArray) -> int:
    """0 where the ray at (x, y) along w misses the face; else 1 or -1, the turn of the face, and where in ``depth``."""
    stay_one_function()
    ab = side_of_edge(face[0, u], face[0, v], face[1, u], face[1, v], x, y)
    bc = side_of_edge(face[1, u], face[1, v], face[2, u], face[2, v], x, y)
    if (ab > 0.0) != (bc > 0.0):
        return 0
    ca = side_of_edge(face[2, u], face[2, v], face[0, u], face[0, v], x, y)
    if (ab > 0.0) != (ca > 0.0):
        return 0
    depth[0] = (bc * face[0, w] + ca * face[1, w] + ab * face[2, w]) / (ab + bc + ca)
    return 1 if ab > 0.0 else -1


@kernel
def pixels_of_face(low: float, high: float, start: float, size: float, count: int) -> tuple[int, int]:
    """First and last but one of the pixels whose centres may lie in [low, high]; one more on each side for rounding."""
    first = int(np.floor((low - start) / size)) - 1
    last = int(np.floor((high - start) / size)) + 2
    return max(0, min(count, first)), max(0, min(count, last))


@kernel
def visit_layers(
    world: FloatArray, axis: int, window: Window, cursor: IntArray, depths: FloatArray, turns: IntArray, keep: bool
) -> None:
    """Raise ``cursor`` of a pixel (n,) for each layer over it, and where asked keep depth and turn at the cursor."""
    low, size, count, shift = window
    u, v, w = (axis + 1) % 3, (axis + 2) % 3, axis
    depth = np.empty(1)
    for f in range(len(world)):
        face = world[f]
        u_low, u_high = min(face[0, u], face[1, u], face[2, u]), max(face[0, u], face[1, u], face[2, u])
        v_low, v_high = min(face[0, v], face[1, v], face[2, v]), max(face[0, v], face[1, v], face[2, v])
        first_i, last_i = pixels_of_face(u_low, u_high, low[u], size[u], count[u])
        first_j, last_j = pixels_of_face(v_low, v_high, low[v], size[v], count[v])
        for i in range(first_i, last_i):
            x = low[u] + (i + 0.5 + shift[0]) * size[u]
            for j in range(first_j, last_j):
                turn = crossing(face, u, v, w, x, low[v] + (j + 0.5 + shift[1]) * size[v], depth)
                if turn != 0:
                    pixel = i * count[v] + j
                    if keep:
                        depths[cursor[pixel]], turns[cursor[pixel]] = depth[0], turn
                    cursor[pixel] += 1


@kernel
def sort_layers(depths: FloatArray, turns: IntArray, start: int, stop: int) -> None:
    """Insertion sort of one pixel's layers by depth: there are few."""
    for place in range(start + 1, stop):
        at = place
        while at > start and depths[at - 1] > depths[at]:
            depths[at - 1], depths[at] = depths[at], depths[at - 1]
            turns[at - 1], turns[at] = turns[at], turns[at - 1]
            at -= 1


@kernel
def layers_of(world: FloatArray, axis: int, window: Window) -> Layers:
    """The layers of placed faces ``world`` (f, 3, 3) over a window, seen along ``axis``; turns of their own normals."""
    start = np.zeros(window.pixels[(axis + 1) % 3] * window.pixels[(axis + 2) % 3] + 1, dtype=np.int64)
    depths, turns = np.empty(0), np.empty(0, dtype=np.int64)
    visit_layers(world, axis, window, start[1:], depths, turns, False)
    for pixel in range(len(start) - 1):
        start[pixel + 1] += start[pixel]
    depths, turns = np.empty(start[-1]), np.empty(start[-1], dtype=np.int64)
    visit_layers(world, axis, window, start[:-1].copy(), depths, turns, True)
    for pixel in range(len(start) - 1):
        sort_layers(depths, turns, start[pixel], start[pixel + 1])
    return Layers(start, depths, turns)


@hot_kernel
def shared_length(
    a: Layers, flip_a: int, b: Layers, flip_b: int, pixel: int, least: float, lengths: FloatArray
) -> bool:
    """Add to ``lengths`` (3,) how long a ray is in A, B, both for more than ``least``; whether it ends outside."""
    stay_one_function()
    i, j, in_a, in_b = a.start[pixel], b.start[pixel], 0, 0
    stop_a, stop_b = a.start[pixel + 1], b.start[pixel + 1]
    last = 0.0
    while i < stop_a or j < stop_b:
        from_a = j >= stop_b or (i < stop_a and a.depths[i] <= b.depths[j])
        depth = a.depths[i] if from_a else b.depths[j]
        if in_a > 0:
            lengths[0] += depth - last
        if in_b > 0:
            lengths[1] += depth - last
        if in_a > 0 and in_b > 0 and depth - last > least:
            lengths[2] += depth - last
        last = depth
        if from_a:
            in_a -= a.turns[i] * flip_a
            i += 1
        else:
            in_b -= b.turns[j] * flip_b
            j += 1
        if in_a < 0 or in_b < 0:
            return False
    return in_a == 0 and in_b == 0


@kernel
def overlap_along(
    world_a: FloatArray, flip_a: int, world_b: FloatArray, flip_b: int, axis: int, window: Window, least: float,
    lengths: FloatArray,
) -> tuple[int, int]:  # fmt: skip
    """Lengths (3,) of all rays of a window together; returns how many rays do not balance, and layers met."""
    a, b = layers_of(world_a, axis, window), layers_of(world_b, axis, window)
    unbalanced = 0
    for pixel in range(len(a.start) - 1):
        if not shared_length(a, flip_a, b, flip_b, pixel, least, lengths):
            unbalanced += 1
    return unbalanced, len(a.depths) + len(b.depths)
