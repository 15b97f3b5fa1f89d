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
    return q[0] - p[0], q[1] - p[1], q[2] - p[2]


@hot_kernel
def beyond(p: Vector, fraction: float, direction: Vector) -> Vector:
    """Returns the point at p plus a fraction of a direction."""
    always_inlined()
    return p[0] + fraction * direction[0], p[1] + fraction * direction[1], p[2] + fraction * direction[2]


@hot_kernel
def dot(p: Vector, q: Vector) -> float:
    """The dot product."""
    always_inlined()
    return p[0] * q[0] + p[1] * q[1] + p[2] * q[2]


@hot_kernel
def cross(p: Vector, q: Vector) -> Vector:
    """The cross product."""
    always_inlined()
    return p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]


@hot_kernel
def rotated(pose: FloatArray, p: Vector) -> Vector:
    """A direction turned by a pose (12,): rotation by rows, then place."""
    always_inlined()
    return dot(vector_at(pose, 0), p), dot(vector_at(pose, 3), p), dot(vector_at(pose, 6), p)
