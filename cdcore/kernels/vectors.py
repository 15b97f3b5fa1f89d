"""Points and directions as three numbers, in kernels: every sum has one order, so that who asks twice rounds alike."""

from cdcore.kernels.compiling import become_part_of_caller, hot_kernel
from cdcore.numerics import FloatArray

Vector = tuple[float, float, float]


@hot_kernel
def vector_at(numbers: FloatArray, k: int) -> Vector:
    """``numbers[k:k + 3]``."""
    become_part_of_caller()
    return numbers[k], numbers[k + 1], numbers[k + 2]


@hot_kernel
def between(p: Vector, q: Vector) -> Vector:
    """The way from p to q."""
    become_part_of_caller()
    return q[0] - p[0], q[1] - p[1], q[2] - p[2]


@hot_kernel
def beyond(p: Vector, share: float, way: Vector) -> Vector:
    """Where a share of a way from p leads."""
    become_part_of_caller()
    return p[0] + share * way[0], p[1] + share * way[1], p[2] + share * way[2]


@hot_kernel
def dot(p: Vector, q: Vector) -> float:
    """The dot product."""
    become_part_of_caller()
    return p[0] * q[0] + p[1] * q[1] + p[2] * q[2]


@hot_kernel
def cross(p: Vector, q: Vector) -> Vector:
    """The cross product."""
    become_part_of_caller()
    return p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]


@hot_kernel
def turned(pose: FloatArray, p: Vector) -> Vector:
    """A direction turned by a pose (12,): rotation by rows, then place."""
    become_part_of_caller()
    return dot(vector_at(pose, 0), p), dot(vector_at(pose, 3), p), dot(vector_at(pose, 6), p)


@hot_kernel
def placed(pose: FloatArray, p: Vector) -> Vector:
    """A point at a pose (12,), rounded as ``place_points`` rounds."""
    become_part_of_caller()
    return beyond(turned(pose, p), 1.0, vector_at(pose, 9))
