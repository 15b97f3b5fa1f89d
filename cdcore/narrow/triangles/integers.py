"""The exact triangle test in Python integers: slow, short, and right for every finite double of any exponent.

All eighteen coordinates are brought to integers on one common power-of-two scale; from there nothing rounds. It
serves pairs whose exponents lie too far apart for exact sums (2^-500 beside 1), and as the reference the compiled
test is checked against.
"""

from collections.abc import Sequence
from itertools import chain

Vector = tuple[int, int, int]
Triangle = tuple[Vector, Vector, Vector]


def integers_on_one_scale(values: Sequence[float]) -> list[int]:
    """The doubles as integers, all multiplied by the same power of two."""
    fractions = [value.as_integer_ratio() for value in values]
    shared = max(denominator for _, denominator in fractions)
    return [numerator * (shared // denominator) for numerator, denominator in fractions]


def difference(a: Vector, b: Vector) -> Vector:
    """The vector a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """The vector a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def dot(a: Vector, b: Vector) -> int:
    """The number a . b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def sign(value: int) -> int:
    """-1, 0 or 1."""
    return (value > 0) - (value < 0)


def normal(triangle: Triangle) -> Vector:
    """The normal, twice the area long; zero for a triangle without area."""
    return cross(difference(triangle[1], triangle[0]), difference(triangle[2], triangle[0]))


def turn(a: Vector, b: Vector, c: Vector, axis: int) -> int:
    """Sign of the turn a, b, c seen along ``axis``."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    return sign((b[i] - a[i]) * (c[j] - a[j]) - (b[j] - a[j]) * (c[i] - a[i]))


def mixed(signs: Sequence[int]) -> bool:
    """Both strict signs occur."""
    return min(signs) < 0 < max(signs)


def in_box(q: Vector, a: Vector, b: Vector) -> bool:
    """Point q in the closed box of a and b."""
    return all(min(a[k], b[k]) <= q[k] <= max(a[k], b[k]) for k in range(3))


def flattened(point: Vector, axis: int) -> Vector:
    """The point without its coordinate along ``axis``."""
    return tuple(0 if k == axis else point[k] for k in range(3))  # type: ignore[return-value]


def segments_meet_in_plane(a: Vector, b: Vector, c: Vector, d: Vector, axis: int) -> bool:
    """Closed segments ab and cd seen along ``axis``."""
    a, b, c, d = (flattened(point, axis) for point in (a, b, c, d))
    c_side, d_side, a_side, b_side = turn(a, b, c, axis), turn(a, b, d, axis), turn(c, d, a, axis), turn(c, d, b, axis)
    if c_side * d_side < 0 and a_side * b_side < 0:
        return True
    on_first = (c_side == 0 and in_box(c, a, b)) or (d_side == 0 and in_box(d, a, b))
    return on_first or (a_side == 0 and in_box(a, c, d)) or (b_side == 0 and in_box(b, c, d))


def segments_meet(a: Vector, b: Vector, c: Vector, d: Vector) -> bool:
    """Closed segments ab and cd in space; either may be a point."""
    across = cross(difference(b, a), difference(d, c))
    if dot(across, difference(c, a)) != 0:
        return False
    for axis in range(3):
        if across[axis] != 0:
            return segments_meet_in_plane(a, b, c, d, axis)
    if any(cross(difference(b, a), difference(c, a))) or any(cross(difference(d, c), difference(a, c))):
        return False
    return all(max(min(a[k], b[k]), min(c[k], d[k])) <= min(max(a[k], b[k]), max(c[k], d[k])) for k in range(3))


def point_in_triangle(q: Vector, triangle: Triangle, axis: int) -> bool:
    """Point q of the plane in the closed proper triangle."""
    return not mixed([turn(triangle[k], triangle[(k + 1) % 3], q, axis) for k in range(3)])


def segment_meets_triangle(a: Vector, b: Vector, triangle: Triangle) -> bool:
    """Closed segment ab (perhaps a point) against a closed proper triangle."""
    across = normal(triangle)
    axis = next(k for k in range(3) if across[k] != 0)
    a_side, b_side = sign(dot(across, difference(a, triangle[0]))), sign(dot(across, difference(b, triangle[0])))
    if a_side * b_side > 0:
        return False
    edges = [(triangle[k], triangle[(k + 1) % 3]) for k in range(3)]
    if a_side == 0 and b_side == 0:
        inside = point_in_triangle(a, triangle, axis)
        return inside or any(segments_meet_in_plane(a, b, c, d, axis) for c, d in edges)
    if a_side == 0 or b_side == 0:
        return point_in_triangle(a if a_side == 0 else b, triangle, axis)
    along = difference(b, a)
    return not mixed([sign(dot(cross(along, difference(d, c)), difference(c, a))) for c, d in edges])


def triangles_meet(first: Triangle, second: Triangle) -> bool:
    """Closed triangles with integer corners, degenerate ones included."""
    flat_first, flat_second = not any(normal(first)), not any(normal(second))
    if flat_first and flat_second:
        return segments_meet(min(first), max(first), min(second), max(second))
    if flat_first:
        return segment_meets_triangle(min(first), max(first), second)
    if flat_second:
        return segment_meets_triangle(min(second), max(second), first)
    edges = [(first, k, second) for k in range(3)] + [(second, k, first) for k in range(3)]
    return any(segment_meets_triangle(one[k], one[(k + 1) % 3], other) for one, k, other in edges)


def pair_intersects_integers(pair: Sequence[Sequence[Sequence[float]]]) -> bool:
    """Exact answer for one pair (2, 3, 3) of finite Python floats."""
    numbers = integers_on_one_scale(list(chain.from_iterable(chain.from_iterable(pair))))
    points: list[Vector] = [(numbers[i], numbers[i + 1], numbers[i + 2]) for i in range(0, 18, 3)]
    return triangles_meet((points[0], points[1], points[2]), (points[3], points[4], points[5]))
