"""A polygon of any shape cut into triangles between its own corners, by clipping one ear after another.

An ear is a corner whose two neighbours see each other: the triangle of the three lies inside, and no other corner in
it or on the line that cuts it off. Every polygon that neither crosses nor touches itself has one (Meisters 1975). Where
the outline touches itself, in a bridge to a hole or in the tip of a notch, corners may be left of which none is an ear:
`least_area` cuts these.

Every triangle winds as the polygon does, or is flat. Where that holds for all of them, they cover the polygon exactly
once: their signed areas add up to the winding number of the outline at every point, whichever ears were taken. So a
wrong choice cannot stay unnoticed.
"""

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sessions.geometry.orientation import orientation, winding
from sessions.meshes.least_area import MOST_CORNERS, least_area_triangles

Array = NDArray[np.float64]
Triangle = tuple[int, int, int]

FLAT: Final = 1e-12
"""A triangle below this fraction of the polygon's squared size has no area that float64 could tell from rounding."""

FEW_CORNERS: Final = 64
"""Up to so many corners a plain loop over them is quicker than NumPy."""

ROUNDS: Final = 3
"""All corners are tried again so often, since a corner becomes an ear only where a neighbour was clipped."""


@dataclass(frozen=True)
class Cut:
    """Triangles of corner numbers, as many as corners less two.

    ``covers``: whether each winds as the polygon or is flat, so that together they are the polygon; else it has no area
    or crosses itself, and some triangle winds the other way.
    """

    triangles: tuple[Triangle, ...]
    covers: bool


def clip_ears(points: Array) -> Cut:
    """Return the triangles of a polygon in the plane, (n, 2) with n >= 3, in the sense of its corners.

    First a triangle flatter than rounding counts as flat: corners on a straight edge are then cut without slivers where
    the coordinates only nearly lie on one line. Where that does not cover the polygon, it is decided exactly.

    Cost: a corner is compared with all others about three times.
    """
    area = winding(points.tolist())
    outline = points * (-1.0 if area < 0 else 1.0, 1.0)  # mirrored, so that it winds to the left; exact
    size = float(np.ptp(outline, axis=0).max())
    cut = _Clipper(outline, flat=FLAT * size * size).cut()
    return cut if cut.covers else _Clipper(outline, flat=0.0).cut()


class _Clipper:
    """A polygon that winds to the left, and which of its corners are left."""

    def __init__(self, outline: Array, flat: float) -> None:
        count = len(outline)
        self._outline = outline
        self._points: list[Sequence[float]] = outline.tolist()
        self._flat = flat
        self._next = [*range(1, count), 0]
        self._previous = [count - 1, *range(count - 1)]
        self._left = dict.fromkeys(range(count))
        self._is_left = np.ones(count, dtype=bool)
        self._triangles: list[Triangle] = []

    def cut(self) -> Cut:
        """Clip repeated corners, then ears, and cut the rest into triangles of the least area."""
        for corner in list(self._left):
            if len(self._left) > 3 and self._points[corner] == self._points[self._previous[corner]]:
                self._clip(corner)
        self._clip_ears()
        rounds = 1
        while len(self._left) > MOST_CORNERS:
            self._clip(self._next_best())
            if rounds < ROUNDS:
                self._clip_ears()
            rounds += 1
        rest = list(self._left)
        self._triangles += [
            (rest[a], rest[b], rest[c]) for a, b, c in least_area_triangles(self._outline[rest], self._flat)
        ]
        return Cut(tuple(self._triangles), self._covers())

    def _covers(self) -> bool:
        """Whether no triangle winds to the right, and one to the left."""
        sides = {self._side(*triangle) for triangle in self._triangles}
        return -1 not in sides and 1 in sides

    def _clip_ears(self) -> None:
        """Clip whatever is an ear, or becomes one, until a triangle or no ear is left."""
        for _ in range(ROUNDS):
            before = len(self._left)
            queue = deque(self._left)
            queue.rotate(-1)
            while queue and len(self._left) > 3:
                corner = queue.popleft()
                if corner in self._left and self._is_ear(corner):
                    neighbours = self._previous[corner], self._next[corner]
                    self._clip(corner)
                    queue.extendleft(neighbours)  # the next one is tried first: a convex polygon becomes a fan
            if len(self._left) in (3, before):
                break

    def _clip(self, corner: int) -> None:
        previous, following = self._previous[corner], self._next[corner]
        self._triangles.append((previous, corner, following))
        self._next[previous], self._previous[following] = following, previous
        del self._left[corner]
        self._is_left[corner] = False

    def _next_best(self) -> int:
        """The corner to clip of too many without an ear: one without area, else one that turns left, else any."""
        sides = {corner: self._side(self._previous[corner], corner, self._next[corner]) for corner in self._left}
        return min(self._left, key=lambda corner: (0, 1, 2)[sides[corner]])

    def _side(self, a: int, b: int, c: int) -> int:
        """1 where corner ``c`` lies left of the line from ``a`` to ``b``, -1 right of it, 0 on it."""
        first, second, third = self._points[a], self._points[b], self._points[c]
        if not self._flat:
            return orientation(first, second, third)
        doubled_area = (first[0] - third[0]) * (second[1] - third[1]) - (first[1] - third[1]) * (second[0] - third[0])
        return 0 if abs(doubled_area) <= self._flat else 1 if doubled_area > 0 else -1

    def _is_ear(self, corner: int) -> bool:
        previous, following = self._previous[corner], self._next[corner]
        if self._side(previous, corner, following) <= 0:
            return False
        ear = previous, corner, following
        return not any(self._blocks(other, ear) for other in self._corners_in_box(ear) if other not in ear)

    def _corners_in_box(self, ear: Triangle) -> Iterable[int]:
        """Corners that are left and lie within the box about a triangle; of few corners all."""
        if len(self._left) <= FEW_CORNERS:
            return self._left
        corners = self._outline[list(ear)]
        pad = np.sqrt(self._flat)
        lower, upper = corners.min(axis=0) - pad, corners.max(axis=0) + pad
        is_near = self._is_left & ((self._outline >= lower) & (self._outline <= upper)).all(axis=1)
        return self._inside_first(np.flatnonzero(is_near), corners)

    def _inside_first(self, candidates: NDArray[np.int64], corners: Array) -> Iterable[int]:
        """The candidate deepest inside, alone, where float64 is sure that it is inside; else those not outside."""
        if len(candidates) <= FEW_CORNERS:
            return candidates.tolist()
        points = self._outline[candidates]
        edges = np.roll(corners, -1, axis=0) - corners
        offsets = points[:, None] - corners
        sides = edges[:, 0] * offsets[:, :, 1] - edges[:, 1] * offsets[:, :, 0]
        depth = sides.min(axis=1)
        size = float(np.ptp(self._outline, axis=0).max())
        unsure = FLAT * size * size
        deepest = int(depth.argmax())
        if depth[deepest] > unsure:
            return [int(candidates[deepest])]
        return candidates[depth >= -unsure].tolist()

    def _blocks(self, other: int, ear: Triangle) -> bool:
        """Whether a corner lies in a triangle or on its third side, or the outline enters the triangle at it."""
        previous, corner, following = ear
        sides = [
            self._side(previous, corner, other),
            self._side(corner, following, other),
            self._side(following, previous, other),
        ]
        if min(sides) < 0:
            return False
        on_first, on_second, on_third = (side == 0 for side in sides)
        if not (on_first or on_second):
            return True  # inside, or on the third side between its ends
        return any(
            self._enters(neighbour, ear, (on_first, on_second, on_third))
            for neighbour in (self._previous[other], self._next[other])
        )

    def _enters(self, neighbour: int, ear: Triangle, touched: tuple[bool, bool, bool]) -> bool:
        """Whether an edge from a point on the triangle to a neighbour goes inside, or along the third side.

        ``touched``: on which sides the point lies; on two where it lies on a corner. Along the first two sides it may
        run: a bridge does.
        """
        previous, corner, following = ear
        on_first, on_second, on_third = touched
        if on_first and self._side(previous, corner, neighbour) <= 0:
            return False
        if on_second and self._side(corner, following, neighbour) <= 0:
            return False
        return not on_third or self._side(following, previous, neighbour) >= 0
