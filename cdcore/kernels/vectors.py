"""Points and directions as three numbers, in kernels: every sum has one order, so that who asks twice rounds alike."""

from cdcore.kernels.compiling import always_inlined, hot_kernel
from cdcore.numerics import FloatArray

Vector = tuple[float, float, float]


@hot_kernel
def vector_at(numbers: FloatArray, k: int) -> Vector:
    """``numbers[k:k + 3]``."""
    always_inlined()
    return numbers[k], numbers[k + 1], numbers[k + 2]


@hot_kernel
def between(p: Vector, q: Vector) -> Vector:
    """The way from p to q."""
    always_inlined()
    px, py, pz = p
    qx, qy, qz = q
    return qx - px, qy - py, qz - pz


@hot_kernel
def beyond(p: Vector, fraction: float, direction: Vector) -> Vector:
    """Returns the point at p plus a fraction of a direction."""
    always_inlined()
    px, py, pz = p
    dx, dy, dz = direction
    return px + fraction * dx, py + fraction * dy, pz + fraction * dz


@hot_kernel
def dot(p: Vector, q: Vector) -> float:
    """The dot product."""
    always_inlined()
    px, py, pz = p
    qx, qy, qz = q
    return px * qx + py * qy + pz * qz


@hot_kernel
def cross(p: Vector, q: Vector) -> Vector:
    """The cross product."""
    always_inlined()
    px, py, pz = p
    qx, qy, qz = q
    return py * qz - pz * qy, pz * qx - px * qz, px * qy - py * qx


@hot_kernel
def rotated_vector(pose: FloatArray, p: Vector) -> Vector:
    """A direction turned by a pose (12,): rotation by rows, then place."""
    always_inlined()
    return dot(vector_at(pose, 0), p), dot(vector_at(pose, 3), p), dot(vector_at(pose, 6), p)
