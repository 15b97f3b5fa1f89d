"""The simple solids that game engines put in place of a mesh; a hull and a box hold the mesh, the others may not.

Sphere and capsule are fitted to the box along the body's axes as an editor proposes them: a sphere about its middle
with the largest half extent as radius, a capsule along its longest side. Corners of the mesh may stick out of both.
"""

from collections.abc import Callable
from itertools import product
from typing import Final

import numpy as np

from cdcore.bounding.hull import hull_collider, hull_of
from cdcore.mesh import TriangleMesh

AROUND: Final = 48
"""Corners around a meshed sphere or capsule: its surface lies at most 0.5 % of the radius inside the true one."""


def box_collider(mesh: TriangleMesh, grown: float = 0.0) -> TriangleMesh:
    """The box along the body's axes, ``grown`` by metres on every side."""
    least, most = mesh.bounds
    corners = list(product(*zip(least - grown, most + grown, strict=True)))
    quads = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))
    faces = [face for a, b, c, d in quads for face in ((a, b, c), (a, c, d))]
    return TriangleMesh(corners, faces)


def sphere_collider(mesh: TriangleMesh) -> TriangleMesh:
    """A sphere about the middle of the box, its radius the largest half extent."""
    least, most = mesh.bounds
    return _capsule(mesh, float((most - least).max()) / 2, 0.0, 1)


def capsule_collider(mesh: TriangleMesh) -> TriangleMesh:
    """A capsule along the longest side of the box, its radius half the longer of the other two."""
    least, most = mesh.bounds
    size = most - least
    axis = int(size.argmax())
    radius = float(np.delete(size, axis).max()) / 2
    return _capsule(mesh, radius, max(0.0, float(size[axis]) / 2 - radius), axis)


SHAPES: Final[dict[str, Callable[[TriangleMesh], TriangleMesh]]] = {
    "hull": hull_collider,
    "box": box_collider,
    "sphere": sphere_collider,
    "capsule": capsule_collider,
    "mesh": lambda mesh: mesh,
}
"""What may stand in place of a mesh, made from it; ``mesh`` leaves it as it is."""


def _capsule(mesh: TriangleMesh, radius: float, half: float, axis: int) -> TriangleMesh:
    """The hull of rings about an axis through the middle of the box, and of two poles; of a needle the mesh itself.

    ``half``: of the straight part, metres.
    """
    least, most = mesh.bounds
    polar = np.linspace(0, np.pi / 2, AROUND // 4 + 1)[1:, None]
    angle = 2 * np.pi * np.arange(AROUND) / AROUND
    out, along = radius * np.sin(polar), half + radius * np.cos(polar)
    upper = np.stack(np.broadcast_arrays(out * np.sin(angle), along, out * np.cos(angle)), axis=-1).reshape(-1, 3)
    upper = np.concatenate([[[0.0, half + radius, 0.0]], upper])
    points = np.unique(np.concatenate([upper, upper * [1, -1, 1]]), axis=0)
    hull = hull_of(np.roll(points, axis - 1, axis=1))
    return mesh if hull is None else TriangleMesh(hull.vertices + (least + most) / 2, hull.faces)
