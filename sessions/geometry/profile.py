"""Half-sections of turned glass: polylines (r, y) whose offset lies at exactly the wall's thickness.

A profile is a chain of strokes (straight lines and arcs). It is sampled to a polyline, and the wall's other side is
the *offset* of that polyline, joint by joint, so both sides are parallel at any resolution.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Polyline = NDArray[np.float64]

# A straight stroke needs fewer points than a bent one of its length to look right.
STRAIGHT_FRACTION = 0.45


@dataclass(frozen=True)
class Line:
    """A straight stroke from ``start`` to ``end``, at least ``least`` segments."""

    start: tuple[float, float]
    end: tuple[float, float]
    least: int = 1

    @property
    def weight(self) -> float:
        """How many points the stroke asks for, relative to others."""
        return float(np.hypot(self.end[0] - self.start[0], self.end[1] - self.start[1])) * STRAIGHT_FRACTION

    def sample(self, segments: int) -> Polyline:
        """Return ``segments`` + 1 points."""
        return np.linspace(self.start, self.end, segments + 1)


@dataclass(frozen=True)
class Arc:
    """A circular stroke about ``centre``; angles in radians, 0 along +r, a quarter turn along +y."""

    centre: tuple[float, float]
    radius: float
    begin: float
    finish: float
    least: int = 2

    @property
    def weight(self) -> float:
        """How many points the stroke asks for, relative to others."""
        return abs(self.finish - self.begin) * self.radius

    def sample(self, segments: int) -> Polyline:
        """Return ``segments`` + 1 points."""
        angle = np.linspace(self.begin, self.finish, segments + 1)
        return np.column_stack(
            [self.centre[0] + self.radius * np.cos(angle), self.centre[1] + self.radius * np.sin(angle)]
        )


Stroke = Line | Arc


def rounded_strokes(corners: Iterable[Sequence[float]]) -> list[Stroke]:
    """Return strokes along corners (r, y, rounding, least).

    A rounding of 0, or none, leaves a corner sharp. ``least`` are the fewest segments of the rounding (2 if not
    given), or of the line to a sharp corner (1). Where the outside of the wall is the shorter side, a turn of ``a``
    between two segments makes the wall 1 / cos(a) thick there: 50 degrees or more need 3.
    """
    rows = list(corners)
    points = [np.array(row[:2], dtype=np.float64) for row in rows]
    strokes: list[Stroke] = []
    last = points[0]
    for number, corner in enumerate(points[1:], start=1):
        rounding, least = (*rows[number][2:], 0.0, 0.0)[:2]
        if rounding:
            arc = _fillet(points[number - 1], corner, points[number + 1], rounding, int(least) or 2)
            begin, finish = arc.sample(1)
            strokes += [*_line(last, begin), arc]
            last = finish
        else:
            strokes += _line(last, corner, int(least) or 1)
            last = corner
    return strokes


def sampled_polyline(strokes: Sequence[Stroke], segments: int) -> Polyline:
    """Return a polyline along the strokes of about ``segments`` segments, never fewer than the strokes demand."""
    counts = [stroke.least for stroke in strokes]
    for _ in range(segments - sum(counts)):
        longest = max(range(len(strokes)), key=lambda i: strokes[i].weight / counts[i])
        counts[longest] += 1
    pieces = [stroke.sample(count) for stroke, count in zip(strokes, counts, strict=True)]
    polyline: Polyline = np.concatenate([pieces[0], *(piece[1:] for piece in pieces[1:])])
    return polyline.round(12)  # so that a start on the axis is at r = 0 and not at 4e-19


def offset(polyline: Polyline, distance: float) -> Polyline:
    """Return the polyline moved ``distance`` to its outside, every segment parallel to its original.

    Outside is to the right of the direction of travel: below a floor that runs away from the axis, away from the
    axis for a wall that runs upwards. A start or end on the axis stays on it.
    """
    direction = np.diff(polyline, axis=0)
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    normal = np.column_stack([direction[:, 1], -direction[:, 0]])
    first, last = normal[:1], normal[-1:]
    before = np.concatenate([first * _mirror_on_axis(polyline[0]), normal])
    after = np.concatenate([normal, last * _mirror_on_axis(polyline[-1])])
    cosine = np.einsum("ij,ij->i", before, after)[:, None]
    moved: Polyline = polyline + distance * (before + after) / (1.0 + cosine)
    return moved.round(12)


def volume_below(polyline: Polyline, level: float) -> float:
    """Return the volume in m3 that the turned polyline holds up to the height ``level``."""
    return float(_frusta(clipped_polyline(polyline, level)).sum())


def clipped_polyline(polyline: Polyline, level: float) -> Polyline:
    """Return the polyline up to where it last rises through ``level``; a vertex closer than 1 um below gives way."""
    rising = np.flatnonzero((polyline[:-1, 1] < level) & (polyline[1:, 1] >= level))
    i = int(rising[-1])
    start, end = polyline[i], polyline[i + 1]
    point = start + (end - start) * (level - start[1]) / (end[1] - start[1])
    keep = i + 1 if np.hypot(*(point - start)) > 1e-6 or i == 0 else i
    return np.concatenate([polyline[:keep], point[None]])


def level_holding(polyline: Polyline, volume: float) -> float:
    """Return the height y up to which the turned polyline holds ``volume`` m3."""
    volumes = np.concatenate([[0.0], np.cumsum(_frusta(polyline))])
    segment = int(np.searchsorted(volumes, volume)) - 1
    return solve_rising(lambda y: volume_below(polyline, y) - volume, polyline[segment, 1], polyline[segment + 1, 1])


def solve_rising(rising: Callable[[float], float], lower: float, upper: float, decimals: int | None = None) -> float:
    """Return the root between ``lower`` and ``upper`` of a function that rises through zero there.

    To the last bit, or rounded to so many decimals.
    """
    while lower < (middle := 0.5 * (lower + upper)) < upper:  # no double lies between them: nothing is left to halve
        if decimals is not None and round(lower, decimals) == round(upper, decimals):
            break
        if rising(middle) < 0.0:
            lower = middle
        else:
            upper = middle
    return upper if decimals is None else round(upper, decimals)


def _frusta(polyline: Polyline) -> NDArray[np.float64]:
    """Return the signed volume under each turned segment."""
    r0, r1 = polyline[:-1, 0], polyline[1:, 0]
    return np.pi / 3.0 * np.diff(polyline[:, 1]) * (r0 * r0 + r0 * r1 + r1 * r1)


def _mirror_on_axis(point: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.array([-1.0, 1.0]) if point[0] == 0.0 else np.array([1.0, 1.0])


def _line(start: NDArray[np.float64], end: NDArray[np.float64], least: int = 1) -> list[Stroke]:
    """The line between two points; none where they are one."""
    if np.hypot(*(end - start)) <= 1e-9:
        return []
    return [Line((float(start[0]), float(start[1])), (float(end[0]), float(end[1])), least)]


def _fillet(
    before: NDArray[np.float64], corner: NDArray[np.float64], after: NDArray[np.float64], radius: float, least: int
) -> Arc:
    into = (corner - before) / np.linalg.norm(corner - before)
    out = after - corner
    angle = float(np.arctan2(into[0] * out[1] - into[1] * out[0], into @ out))
    side = np.sign(angle) * np.array([-into[1], into[0]])
    centre = corner - into * radius * np.tan(abs(angle) / 2.0) + side * radius
    begin = float(np.arctan2(-side[1], -side[0]))
    return Arc((float(centre[0]), float(centre[1])), radius, begin, begin + angle, least)
