"""Rays through closed meshes: where each enters and leaves, and how long two solids share it.

An edge belongs to one of its two faces: its side is computed from its ends in one order, so that both faces round
alike, and a ray through it counts once. Inside is, as for containment, where a ray has crossed the mesh an odd number
of times.
"""

from typing import NamedTuple

import numpy as np

from cdcore.kernels.compiling import hot_kernel, kernel, never_inlined
from cdcore.numerics import FloatArray, IntArray


class Window(NamedTuple):
    """Position of the first ray, size of a pixel, number of pixels along each axis, (3,) each."""

    first: FloatArray
    size: FloatArray
    pixels: IntArray


class Layers(NamedTuple):
    """Start of each pixel's layers (n + 1,), and their depths, ascending within a pixel."""

    start: IntArray
    depths: FloatArray


@hot_kernel
def side_of_edge(pu: float, pv: float, qu: float, qv: float, x: float, y: float) -> float:
    """Twice the area of p, q and the ray at (x, y): positive on the left of p -> q; exactly opposite for q -> p."""
    never_inlined()
    swapped = pu > qu or (pu == qu and pv > qv)
    if swapped:
        pu, pv, qu, qv = qu, qv, pu, pv
    area: float = (qu - pu) * (y - pv) - (qv - pv) * (x - pu)
    if area == 0.0:
        area = 5e-324
    return -area if swapped else area


@hot_kernel
def crossing_depth(face: FloatArray, u: int, v: int, w: int, x: float, y: float) -> float:
    """Depth at which the ray at (x, y) along w crosses the face; infinite where it does not."""
    never_inlined()
    ab = side_of_edge(face[0, u], face[0, v], face[1, u], face[1, v], x, y)
    bc = side_of_edge(face[1, u], face[1, v], face[2, u], face[2, v], x, y)
    if (ab > 0.0) != (bc > 0.0):
        return np.inf
    ca = side_of_edge(face[2, u], face[2, v], face[0, u], face[0, v], x, y)
    if (ab > 0.0) != (ca > 0.0):
        return np.inf
    return (bc * face[0, w] + ca * face[1, w] + ab * face[2, w]) / (ab + bc + ca)


@hot_kernel
def pixels_of_face(lower: float, upper: float, first: float, size: float, count: int) -> tuple[int, int]:
    """First and last but one of the pixels whose rays may lie in [low, high]; one more on each side for rounding."""
    begin, end = int(np.floor((lower - first) / size)), int(np.floor((upper - first) / size)) + 2
    return max(0, min(count, begin)), max(0, min(count, end))


@hot_kernel
def visit_layers(
    world: FloatArray, axis: int, window: Window, cursor: IntArray, depths: FloatArray, keep: bool
) -> None:
    """Raise ``cursor`` of a pixel (n,) for each layer over it, and where asked keep the depth at the cursor."""
    first, size, count = window
    u, v, w = (axis + 1) % 3, (axis + 2) % 3, axis
    for f in range(len(world)):
        face = world[f]
        u_lower, u_upper = min(face[0, u], face[1, u], face[2, u]), max(face[0, u], face[1, u], face[2, u])
        v_lower, v_upper = min(face[0, v], face[1, v], face[2, v]), max(face[0, v], face[1, v], face[2, v])
        begin_i, end_i = pixels_of_face(u_lower, u_upper, first[u], size[u], count[u])
        begin_j, end_j = pixels_of_face(v_lower, v_upper, first[v], size[v], count[v])
        for i in range(begin_i, end_i):
            x = first[u] + i * size[u]
            for j in range(begin_j, end_j):
                depth = crossing_depth(face, u, v, w, x, first[v] + j * size[v])
                if depth != np.inf:
                    pixel = i * count[v] + j
                    if keep:
                        depths[cursor[pixel]] = depth
                    cursor[pixel] += 1


@hot_kernel
def sort_layers(depths: FloatArray, start: int, stop: int) -> None:
    """Insertion sort of one pixel's layers: there are few."""
    for index in range(start + 1, stop):
        at = index
        while at > start and depths[at - 1] > depths[at]:
            depths[at - 1], depths[at] = depths[at], depths[at - 1]
            at -= 1


@kernel
def layers_of(world: FloatArray, axis: int, window: Window) -> Layers:
    """The layers of placed faces ``world`` (f, 3, 3) over a window, seen along ``axis``."""
    start = np.zeros(window.pixels[(axis + 1) % 3] * window.pixels[(axis + 2) % 3] + 1, dtype=np.int64)
    visit_layers(world, axis, window, start[1:], np.empty(0), False)
    for pixel in range(len(start) - 1):
        start[pixel + 1] += start[pixel]
    depths = np.empty(start[-1])
    visit_layers(world, axis, window, start[:-1].copy(), depths, True)
    for pixel in range(len(start) - 1):
        sort_layers(depths, start[pixel], start[pixel + 1])
    return Layers(start, depths)


@hot_kernel
def shared_length(a: Layers, b: Layers, pixel: int, least: float, lengths: FloatArray) -> None:
    """Add to ``lengths`` (3,) how long a ray is in A, B, both for more than ``least``."""
    never_inlined()
    i, j, in_a, in_b, last = a.start[pixel], b.start[pixel], False, False, 0.0
    stop_a, stop_b = a.start[pixel + 1], b.start[pixel + 1]
    while i < stop_a or j < stop_b:
        from_a = j >= stop_b or (i < stop_a and a.depths[i] <= b.depths[j])
        depth = a.depths[i] if from_a else b.depths[j]
        if in_a:
            lengths[0] += depth - last
        if in_b:
            lengths[1] += depth - last
        if in_a and in_b and depth - last > least:
            lengths[2] += depth - last
        last = depth
        if from_a:
            in_a = not in_a
            i += 1
        else:
            in_b = not in_b
            j += 1


@kernel
def overlap_along(
    world_a: FloatArray, world_b: FloatArray, axis: int, window: Window, least: float, lengths: FloatArray
) -> int:
    """Lengths (3,) of all rays of a window together; returns how many layers they met."""
    a, b = layers_of(world_a, axis, window), layers_of(world_b, axis, window)
    for pixel in range(len(a.start) - 1):
        shared_length(a, b, pixel, least, lengths)
    return len(a.depths) + len(b.depths)
