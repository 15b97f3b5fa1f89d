"""The bench as a picture, drawn without a graphics card: a depth for every pixel, glass translucent."""

import io
from collections.abc import Iterator, Mapping
from typing import Any, Final

import numpy as np

from cdcore import TriangleMesh
from cdcore.numerics import BoolArray, FloatArray, IntArray, place_points
from replay.outputs.camera import FIELD_OF_VIEW, Eye, look_rotation
from replay.outputs.palette import INVENTED, MISSED, albedo, is_ghost, tags_of
from replay.prepare.assembly import Assembly
from sessions.model.scene import Scene

WIDE, HIGH = 900, 520
NEAREST: Final = 0.01
"""Metres in front of the eye where drawing begins."""

LARGE: Final = 0.12
"""Metres: longer triangles are cut into four until they are not. What reaches behind the eye is left out, and a bench
top may be one triangle."""

PAPER: Final = 0.4
"""Share of white mixed into opaque colours: they were chosen for a dark screen."""

BEHIND: Final = np.array([0.93, 0.945, 0.96])
GLASS_ALPHA: Final = 0.22
GHOST_ALPHA: Final = 0.30
SOLID_ALPHA: Final = 0.18

AT_ONCE: Final = 1 << 20
"""Pixels of triangles looked at in one step: 100 MB."""

Faces = Mapping[int, IntArray]
"""Body -> numbers of the faces to mark."""

Solids = Mapping[int, TriangleMesh]
"""Body -> what a detector puts in its place."""


def bench_picture(
    assembly: Assembly, scene: Scene, frame: int, eye: Eye, marked: Faces | None = None, solids: Solids | None = None
) -> bytes:
    """A PNG of all bodies that have a pose in this frame; marked faces in the red of missed contacts, in front.

    ``solids`` are a yellow veil with an outline. Choose it for a page; the recording shows the same in motion.
    """
    from matplotlib.image import imsave

    parts = [*_parts(assembly, scene, frame, marked or {}, solids or {})]
    corners, colours, kinds = (np.concatenate(one) for one in zip(*parts, strict=True)) if parts else _NOTHING
    local = (corners - np.array(eye.position)) @ look_rotation(eye)
    nothing = np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64), np.zeros(0)
    found = [np.concatenate(one) for one in zip(nothing, *_covered(local), strict=True)]
    seen = _composed((found[0], found[1], found[2]), _shaded(local, colours), kinds).reshape(HIGH, WIDE, 3)
    buffer = io.BytesIO()
    how: Any = {"format": "png", "metadata": {"Software": None}}
    imsave(buffer, np.clip(seen, 0.0, 1.0), **how)
    return buffer.getvalue()


_NOTHING: Final = (np.zeros((0, 3, 3)), np.zeros((0, 4)), np.zeros(0))
PLAIN, MARKED, SOLID = range(3)


def _parts(
    assembly: Assembly, scene: Scene, frame: int, marked: Faces, solids: Solids
) -> Iterator[tuple[FloatArray, ...]]:
    """Placed triangles (n, 3, 3), their colours (n, 4) and kinds (n,) of every body, and of every solid its own."""
    motion = assembly.motion
    for body in np.flatnonzero(motion.valid[frame]).tolist():
        tags = tags_of(assembly.bodies[body].name, scene)
        colour, kind = np.array(albedo(tags)) / 255.0, np.zeros(len(assembly.bodies[body].mesh.faces))
        if is_ghost(tags) or colour[3] < 1.0:
            colour[3] = GHOST_ALPHA if is_ghost(tags) else GLASS_ALPHA
        else:
            colour[:3] += PAPER * (1.0 - colour[:3])
        colours = np.tile(colour, (len(kind), 1))
        if body in marked:
            kind[marked[body]], colours[marked[body]] = MARKED, np.array(MISSED) / 255.0
        drawn = [(assembly.bodies[body].mesh, colours, kind)]
        if body in solids:
            count = len(solids[body].faces)
            veil = np.array([*np.array(INVENTED[:3]) / 255.0, SOLID_ALPHA])
            drawn.append((solids[body], np.tile(veil, (count, 1)), np.full(count, SOLID + body)))
        for mesh, own, sort in drawn:
            points = place_points(mesh.vertices, motion.rotations[frame, body], motion.translations[frame, body])
            yield _small(points[mesh.faces], own, sort)


def _small(corners: FloatArray, *others: FloatArray) -> tuple[FloatArray, ...]:
    """Triangles none of which is large, and what belongs to each."""
    while (large := np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1) > LARGE).any():
        old, middle = corners[large], (corners + np.roll(corners, -1, axis=1))[large] / 2
        ends = [np.stack([old[:, k], middle[:, k], middle[:, k - 1]], axis=1) for k in range(3)]
        corners = np.concatenate([corners[~large], middle, *ends])
        others = tuple(np.concatenate([one[~large], *[one[large]] * 4]) for one in others)
    return corners, *others


def _shaded(local: FloatArray, colours: FloatArray) -> FloatArray:
    """Light comes from the eye and a little from above."""
    normal = np.cross(local[:, 1] - local[:, 0], local[:, 2] - local[:, 0])
    length = np.linalg.norm(normal, axis=1)
    facing = np.abs(normal @ np.array([0.15, 0.45, 0.88])) / np.where(length > 0, length, 1.0)
    shaded = colours.copy()
    shaded[:, :3] *= (0.45 + 0.55 * facing)[:, None]
    return shaded


Covered = tuple[IntArray, IntArray, FloatArray]
"""Triangle, pixel and 1 / depth, (k,) each."""


def _covered(local: FloatArray) -> Iterator[Covered]:
    """Every pixel whose middle a triangle in the eye's axes (n, 3, 3) covers.

    Barycentric coordinates over depth are linear on the screen, so they bound a stretch of each row of pixels.
    Source: Olano and Greer 1997.
    """
    size = np.array([WIDE, HIGH])
    depth = -local[..., 2:]
    # x and y in pixels times depth, y downwards
    flat = local[..., :2] * [1, -1] / np.tan(FIELD_OF_VIEW / 2) * size[1] / 2 + depth * size / 2
    screen = np.concatenate([flat, depth], axis=2)
    there = np.flatnonzero((np.abs(np.linalg.det(screen)) > 1e-12) & (depth.min(axis=(1, 2)) > NEAREST))
    inverse, place = np.linalg.inv(screen[there]), flat[there, :, 1] / depth[there, :, 0] - 0.5
    low = np.clip(np.ceil(place.min(axis=1)), 0, HIGH).astype(np.int64)
    high = np.clip(np.floor(place.max(axis=1)) + 1, 0, HIGH).astype(np.int64)
    one, row = _counted_up(low, np.maximum(high, low))
    slope, at_left = inverse[one, 0], inverse[one, 1] * (row + 0.5)[:, None] + inverse[one, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        border = -at_left / slope - 0.5
    begin = np.where(slope > 0, border, np.where((slope < 0) | (at_left >= 0), -np.inf, np.inf)).max(axis=1)
    end = np.where(slope < 0, border, np.inf).min(axis=1)
    left = np.clip(np.ceil(begin), 0, WIDE).astype(np.int64)
    right = np.clip(np.floor(end) + 1, left, WIDE).astype(np.int64)
    near, step = at_left.sum(axis=1), slope.sum(axis=1)
    blocks = np.flatnonzero(np.diff(np.cumsum(right - left) // AT_ONCE)) + 1
    for some in np.split(np.arange(len(row)), blocks):
        stretch, x = _counted_up(left[some], right[some])
        of = some[stretch]
        yield there[one[of]], x + WIDE * row[of], near[of] + step[of] * (x + 0.5)


def _counted_up(first: IntArray, last: IntArray) -> tuple[IntArray, IntArray]:
    """The whole numbers from ``first`` to before ``last`` one range after the other: which range, and the number."""
    count = last - first
    one = np.repeat(np.arange(len(count)), count)
    return one, np.arange(len(one)) + np.repeat(first - np.cumsum(count) + count, count)


def _composed(found: Covered, colours: FloatArray, kinds: FloatArray) -> FloatArray:
    """The colour of every pixel (p, 3): the nearest opaque triangle, through all translucent ones before it."""
    face, pixel, near = found
    near = near + (kinds[face] == MARKED) / NEAREST
    alpha, count = colours[face, 3], WIDE * HIGH
    seen, depth = np.tile(BEHIND, (count, 1)), np.zeros(count)
    opaque = np.flatnonzero(alpha == 1.0)
    np.maximum.at(depth, pixel[opaque], near[opaque])
    first = opaque[near[opaque] == depth[pixel[opaque]]]
    seen[pixel[first]] = colours[face[first], :3]
    clear = np.flatnonzero((alpha < 1.0) & (near > depth[pixel]))
    clear = clear[np.lexsort((near[clear], pixel[clear]))]
    seen = _veiled(seen, pixel[clear], colours[face[clear]])
    for kind in np.unique(kinds[kinds >= SOLID]):
        seen[_rim(np.isin(np.arange(count), pixel[kinds[face] == kind]))] = RIM
    return seen


def _veiled(seen: FloatArray, pixel: IntArray, colours: FloatArray) -> FloatArray:
    """Pixels (p, 3) through translucent colours (k, 4), sorted by pixel and from far to near."""
    alpha, count = colours[:, 3], len(seen)
    let = np.log1p(-alpha)
    through = np.bincount(pixel, let, count)
    share = alpha * np.exp(np.cumsum(through)[pixel] - np.cumsum(let))
    veil = np.stack([np.bincount(pixel, share * colours[:, k], count) for k in range(3)], axis=1)
    covered: FloatArray = seen * np.exp(through)[:, None] + veil
    return covered


RIM: Final = np.array(INVENTED[:3]) / 255.0 * 0.8


def _rim(covered: BoolArray) -> BoolArray:
    """Pixels at the border of what is covered, (p,): the outline."""
    inside = covered.reshape(HIGH, WIDE)
    moved = [np.roll(inside, step, axis) for step in (2, -2) for axis in (0, 1)]
    return (inside & ~np.logical_and.reduce(moved)).reshape(-1)
