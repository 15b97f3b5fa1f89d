"""Near misses: stretches in which two things came close without touching.

Distances are between points spread over the surfaces, so they are too long by up to the spacing of the points.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from cdcore import Body
from cdcore.numerics import BoolArray, FloatArray, IntArray
from replay.metrics.hands import frames_at
from replay.prepare.assembly import Assembly

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

CLOSE_M: Final = 0.010
"""Closer than this is close: a hand or a glass covers it in a tenth of a second."""

SPACING_M: Final = 0.003
LOOKS_HZ: Final = 10.0
"""Points and looks: a near miss of a tenth of a second at 10 mm is seen, at some milliseconds a session minute."""

APART_S: Final = 0.5
"""Stretches less than this apart are one."""

MOST_POINTS: Final = 20_000

CELL_M: Final = 0.006
"""Edge of the cubes that points are sorted into: a middle stands for about three points."""
HALF_DIAGONAL: Final = 0.8661
"""Of a cube with edge 1, rounded up."""


SEEN_M: Final = CLOSE_M + 0.005
"""A look that finds nothing so near spares the looks until the two have come nearer by what is left."""


@dataclass(frozen=True)
class NearMiss:
    """One near miss: the pair (column of ``assembly.pairs``), and when."""

    pair: int
    start: float
    end: float


def close_stretches(assembly: Assembly, pairs: IntArray) -> tuple[NearMiss, ...]:
    """Stretches in which a pair came closer than ``CLOSE_M``, touching or not, in order of time.

    ``pairs``: columns of ``assembly.pairs`` to look at.
    """
    clouds: dict[int, _Cloud] = {}
    rows = frames_at(assembly.motion.times, 1.0 / LOOKS_HZ, float(assembly.motion.times[-1]))
    found = []
    for pair in pairs.tolist():
        a, b = assembly.pairs[pair].tolist()
        times = assembly.motion.times[rows[_close(assembly, a, b, rows, clouds)]]
        found += [NearMiss(pair, *span) for span in _stretches(times)]
    return tuple(sorted(found, key=lambda one: (one.start, one.pair)))


def without_contact(found: Sequence[NearMiss], touching: FloatArray) -> tuple[NearMiss, ...]:
    """Those with no contact of their pair within half a second.

    ``found``: stretches in which a pair was close.
    ``touching``: (k, 3) column, start and end in seconds of every contact.
    """
    pair, start, end = touching.T
    return tuple(
        one
        for one in found
        if not ((pair == one.pair) & (start <= one.end + APART_S) & (end >= one.start - APART_S)).any()
    )


class _Cloud:
    """Points of a surface sorted into cubes, so that those far from everything are never moved one by one."""

    def __init__(self, points: FloatArray) -> None:
        cell, self.cell = np.unique(np.floor(points / CELL_M), axis=0, return_inverse=True)
        self.points, self.middle = points, (cell + 0.5) * CELL_M
        self.reach = float(np.linalg.norm(points, axis=1).max())


class _Looks:
    """Looks at two bodies, one after the other; ``tree`` holds the points of the second."""

    def __init__(self, cloud: _Cloud, tree: "cKDTree") -> None:
        self._cloud, self._tree = cloud, tree
        self._points = np.zeros(3), np.full(3, np.inf)  # that were close last
        self._turn, self._move, self._spare = np.eye(3), np.zeros(3), 0.0  # of the last search, and what it left

    def close(self, turn: FloatArray, move: FloatArray) -> bool:
        """Whether a point of the cloud, moved, is closer than ``CLOSE_M`` to one of the tree."""
        one, other = self._points
        if np.linalg.norm(turn @ one + move - other) < CLOSE_M:
            return True
        way = np.linalg.norm(turn - self._turn) * self._cloud.reach + np.linalg.norm(move - self._move)
        if way >= self._spare:
            self._turn, self._move, self._spare = turn, move, self._search(turn, move) - CLOSE_M
        return self._spare < 0.0

    def _search(self, turn: FloatArray, move: FloatArray) -> float:
        """Metres that the points keep from the tree's at least; below ``CLOSE_M`` the two that are close are kept."""
        cloud, tree, half = self._cloud, self._tree, HALF_DIAGONAL * CELL_M
        middle, reach = cloud.middle @ turn.T + move, SEEN_M + half
        box = ((middle >= tree.mins - reach) & (middle <= tree.maxes + reach)).all(axis=1)
        apart = np.full(len(middle), reach)
        apart[box] = np.minimum(tree.query(middle[box], distance_upper_bound=reach)[0], reach)
        if apart.min() >= CLOSE_M + half:
            return float(apart.min()) - half
        points = cloud.points[(apart < CLOSE_M + half)[cloud.cell]]
        apart, place = tree.query(points @ turn.T + move, distance_upper_bound=CLOSE_M)
        least = int(apart.argmin())
        if apart[least] < CLOSE_M:
            self._points = points[least], tree.data[place[least]]
        return min(float(apart[least]), CLOSE_M)


def spread_points(body: Body) -> FloatArray:
    """Points over a body's surface, (k, 3) in its own frame, no larger gap than ``SPACING_M`` while they suffice."""
    corners = body.mesh.vertices[body.mesh.faces]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    parts = np.maximum(1, np.ceil(longest / SPACING_M)).astype(np.int64)
    while float(((parts + 1) * (parts + 2) // 2).sum()) > MOST_POINTS and parts.max() > 1:
        parts = np.maximum(1, parts // 2)
    points = []
    for count in np.unique(parts).tolist():
        i, j = np.meshgrid(np.arange(count + 1), np.arange(count + 1), indexing="ij")
        u, v = i[i + j <= count] / count, j[i + j <= count] / count
        weights = np.stack([1.0 - u - v, u, v], axis=1)
        points.append(np.einsum("kc,fcx->fkx", weights, corners[parts == count]).reshape(-1, 3))
    return np.unique(np.concatenate(points), axis=0)


def _close(assembly: Assembly, a: int, b: int, rows: IntArray, clouds: dict[int, _Cloud]) -> BoolArray:
    """Whether two bodies are closer than ``CLOSE_M`` at each look; False where a pose lacks."""
    from scipy.spatial import cKDTree

    motion, close = assembly.motion, _boxes_near(assembly, a, b, rows)
    if not close.any():
        return close
    for body in (a, b):
        if body not in clouds:
            clouds[body] = _Cloud(spread_points(assembly.bodies[body]))
    if len(clouds[a].points) > len(clouds[b].points):
        a, b = b, a
    looks = _Looks(clouds[a], cKDTree(clouds[b].points))
    for k in np.flatnonzero(close).tolist():
        back, row = motion.rotations[rows[k], b].T, rows[k]
        move = back @ (motion.translations[row, a] - motion.translations[row, b])
        close[k] = looks.close(back @ motion.rotations[row, a], move)
    return close


def _boxes_near(assembly: Assembly, a: int, b: int, rows: IntArray) -> BoolArray:
    """Looks (K,) with both poses at which no face of a body's box keeps the other's farther away than ``CLOSE_M``."""
    motion, ends = assembly.motion, [assembly.bodies[body].mesh.vertices for body in (a, b)]
    (mid_a, half_a), (mid_b, half_b) = (((v.max(0) + v.min(0)) / 2, (v.max(0) - v.min(0)) / 2) for v in ends)
    turn_a, turn_b = motion.rotations[rows, a], motion.rotations[rows, b]
    between = turn_a @ mid_a + motion.translations[rows, a] - turn_b @ mid_b - motion.translations[rows, b]
    spread = np.abs(np.einsum("kji,kjl->kil", turn_b, turn_a))
    apart_b = np.abs(np.einsum("kji,kj->ki", turn_b, between)) - half_b - spread @ half_a
    apart_a = np.abs(np.einsum("kji,kj->ki", turn_a, between)) - half_a - np.einsum("kij,i->kj", spread, half_b)
    known = motion.valid[rows, a] & motion.valid[rows, b]
    return known & (np.maximum(apart_a, apart_b).max(axis=1) <= CLOSE_M)


def _stretches(times: FloatArray) -> list[tuple[float, float]]:
    """Of times at which two were close."""
    parts = np.split(times, np.flatnonzero(np.diff(times) > APART_S) + 1)
    return [(float(part[0]), float(part[-1])) for part in parts if len(part)]
