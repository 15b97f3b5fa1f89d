"""Bounding boxes in the body's frame, along its own axes or its principal ones: every used vertex lies inside."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from cdcore.mesh import TriangleMesh
from cdcore.numerics import FloatArray, readonly
from cdcore.tolerances import EPS

FIT_ULPS: Final = 16.0
"""Half extents grow by this many eps of the box's reach: projecting a vertex on an axis rounds by at most 6."""


@dataclass(frozen=True, eq=False)
class Box:
    """A box in a body's frame: ``centre + axes @ s`` with ``|s| <= half``, in metres.

    ``centre`` (3,); ``axes`` (3, 3), whose columns are the box's axes, orthonormal; ``half`` (3,) extents along them.
    """

    centre: FloatArray
    axes: FloatArray
    half: FloatArray

    def __post_init__(self) -> None:
        for array in (self.centre, self.axes, self.half):
            readonly(array)

    @property
    def surface(self) -> float:
        """Area of its six sides, square metres."""
        x, y, z = self.half
        return float(8.0 * (x * y + y * z + z * x))


def box_by_body_axes(mesh: TriangleMesh) -> Box:
    """The axis-aligned box in the body's own frame (AABB at rest; it turns with the body)."""
    return _fitted_box(mesh.referenced_vertices, np.eye(3))


def box_by_principal_axes(mesh: TriangleMesh) -> Box:
    """The box along the principal axes of the vertices: tight around a slanted rod, loose where vertices cluster."""
    points = mesh.referenced_vertices
    spread = points - points.mean(axis=0)
    # Divided by its size, so that the covariance of a mesh of 1e-200 m neither vanishes nor overflows.
    size = float(np.abs(spread).max())
    scaled = spread / size if size > 0 else spread
    _, axes = np.linalg.eigh(scaled.T @ scaled)
    return _fitted_box(points, np.ascontiguousarray(axes))


def box_best(mesh: TriangleMesh) -> Box:
    """The one with the smaller surface; body axes win a tie."""
    return min(box_by_body_axes(mesh), box_by_principal_axes(mesh), key=lambda box: box.surface)


def _fitted_box(points: FloatArray, axes: FloatArray) -> Box:
    along = points @ axes
    lower, upper = along.min(axis=0), along.max(axis=0)
    middle = lower / 2 + upper / 2
    reach = float(np.abs(points).max())
    half = np.maximum(upper - middle, middle - lower) + FIT_ULPS * EPS * reach
    return Box(axes @ middle, axes, half)
