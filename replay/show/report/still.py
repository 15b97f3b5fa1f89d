"""The picture of a fault: one body white, the other blue glass, the collider yellow, and the gap with its length."""

import io
from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, Final

import numpy as np

from cdcore import TriangleMesh
from cdcore.numerics import BoolArray, FloatArray, IntArray
from cdcore.poses import place_points
from replay.auditing.fault import Fault, FaultKind
from replay.auditing.first_touch import at_touch
from replay.document.run_result import RunResult
from replay.show.camera import across, towards_user
from replay.show.drawn_mesh import bends, edges_of, face_normals
from replay.show.palette import COLOUR_NAMES, FALSE_CONTACT, Rgba, fault_colour, fault_key
from replay.show.report.markup import filled
from replay.show.report.rasteriser import Colour, Lines, Shape, View, drawn
from replay.words import length as length_words

FIRST: Final = (470, 352)
CARD: Final = (300, 170)
"""Width and height of a picture, in its own units."""

SHARPER: Final = {FIRST: 1.8, CARD: 1.4}
"""Pixels a unit."""

WORDS: Final = 150
"""Units on the right of the first picture that its words take."""

MOST_CHARACTERS: Final = 19
"""That fit into it."""

LINES: Final = 44.0
"""Units from one name to the next."""

WHITE: Final[Colour] = (0.95, 0.96, 0.97)
GLASS: Final[Colour] = (0.45, 0.70, 0.95)
GLASS_ALPHA: Final = 0.13
DARK: Final = np.array([18, 26, 37]) / 255
LIGHTER: Final = np.array([40, 55, 74]) / 255

HOLLOW: Final = 1.1
"""A solid of so many times the volume of its mesh differs from it enough to be drawn."""

LARGEST_MARK: Final = 0.03
"""Metres; a face that is larger is not painted where bodies meet."""

SHORTEST_ARROW: Final = 14.0
"""Units; a shorter gap is a ring."""

SHARP_DEG: Final = 30.0
"""Faces that meet in a larger angle have an edge between them."""

LID: Final = 0.03
"""Share of the cage's size by which a face is away from the mesh where it closes a hollow."""

MANY_ROWS: Final = 400
"""In a picture of fewer rows lines are thinner."""

WALL_ALPHA, LID_ALPHA = 0.24, 0.42


@dataclass(frozen=True)
class Placed:
    """A body at the moment of a fault."""

    name: str
    mesh: TriangleMesh
    pose: tuple[FloatArray, FloatArray]
    solid: TriangleMesh | None  # what a detector asks in its place, where that differs to the eye
    faces: IntArray  # that meet the other body, of a miss

    @property
    def outline(self) -> FloatArray:
        """Vertices of the body or of what stands for it, world metres."""
        return place_points((self.solid or self.mesh).vertices, *self.pose)

    @property
    def filled(self) -> float:
        """Cubic metres that what stands for the body has more than its mesh."""
        return 0.0 if self.solid is None else _volume(self.solid) - _volume(self.mesh)


@dataclass(frozen=True)
class Sight:
    """Contents of a picture: the white body, the glass body, and their nearest or common points."""

    white: Placed
    glass: Placed
    point: FloatArray
    gap: FloatArray | None  # nearest points (2, 3) of the surfaces; ``None`` where they meet
    away: FloatArray  # direction to look from
    kind: FaultKind

    @property
    def length(self) -> str:
        """The gap in words, ``""`` where the bodies meet."""
        return "" if self.gap is None else length_words(float(np.linalg.norm(self.gap[1] - self.gap[0])))


def fault_still(result: RunResult, label: str, fault: Fault, size: tuple[int, int] = CARD) -> tuple[str, str]:
    """A fault as SVG around a raster picture, and its colours in words; in the first of a page each part is named."""
    sight, factor, worded = _sight(result, label, fault), SHARPER[size], size == FIRST
    pixels = round(size[0] * factor), round(size[1] * factor)
    view = View.of(_shown(sight), sight.away, pixels, round(WORDS * factor) if worded else 0)
    picture, shape = drawn(view, *_parts(sight, view), background(pixels))
    strokes, middle = _arrow(sight, view, factor)
    how = f"are {sight.length} apart, and {label} reports contact" if sight.gap is not None else "meet, unreported"
    svg = filled(
        "show/report/still.html",
        size=size,
        description=f"{sight.white.name} and {sight.glass.name} {how}",
        picture=webp(picture),
        strokes=strokes,
        middle=middle,
        ring=f"ring {fault_key(fault.kind)}" if sight.gap is None else "ring",
        words=_words(sight, label, view, shape == 0, middle) if worded else (),
        x=FIRST[0] - WORDS + 8,
    )
    colours = [f"{sight.white.name} white", f"{sight.glass.name} blue"]
    if sight.white.solid or sight.glass.solid:
        colours.append("collider yellow")
    if fault.kind.is_miss:
        colours.append(f"where they meet {COLOUR_NAMES[fault_key(fault.kind)]}")
    return svg, ", ".join(colours)


def paired_stills(result: RunResult, labels: Sequence[str], fault: Fault, size: tuple[int, int] = CARD) -> list[str]:
    """The moment of a false contact of the first detector as an SVG a detector, with its colliders, by one camera."""
    first, factor = _sight(result, labels[0], fault), SHARPER[size]
    pixels = round(size[0] * factor), round(size[1] * factor)
    view = View.of(_shown(first), first.away, pixels)
    stills = []
    for label in labels:
        sight = _with_colliders(first, result, label)
        picture, _ = drawn(view, *_parts(sight, view), background(pixels))
        strokes, middle = _arrow(sight, view, factor)
        names = f"{sight.white.name} and {sight.glass.name}"
        stills.append(
            filled(
                "show/report/still.html",
                size=size,
                description=f"{names} {sight.length} apart, with the colliders of {label}",
                picture=webp(picture),
                strokes=strokes,
                middle=middle,
                ring="ring",
                words=(),
                x=0,
            )
        )
    return stills


def _with_colliders(sight: Sight, result: RunResult, label: str) -> Sight:
    """The same moment with the colliders of another detector."""
    names = result.assembly.names
    white, glass = _solids(result, label, [names.index(sight.white.name), names.index(sight.glass.name)])
    return replace(sight, white=replace(sight.white, solid=white), glass=replace(sight.glass, solid=glass))


def webp(picture: FloatArray) -> str:
    """A raster picture as it lies in an address."""
    import PIL.Image
    import PIL.WebPImagePlugin  # without it the first picture loads the plugins of all forty formats

    out = io.BytesIO()
    PIL.Image.fromarray(np.round(picture * 255).astype(np.uint8)).save(out, "WEBP", quality=82, method=2)
    return b64encode(out.getvalue()).decode()


def _sight(result: RunResult, label: str, fault: Fault) -> Sight:
    """The two bodies of a fault where there is most to see of it."""
    assembly, row = result.assembly, 0
    ends = assembly.pairs[fault.pair].tolist()
    none = np.zeros(0, dtype=np.int64)
    faces, solids = [none, none], list[TriangleMesh | None]([None, None])
    user = towards_user(assembly, result.session.scene, fault.frame, fault.point)
    touch = fault.evidence.touch
    if fault.kind.is_miss:
        row = fault.frame
        if touch is not None:
            assembly, row = at_touch(assembly, fault.pair, touch), 0
        reference = result.detections[result.oracle]
        met = fault.evidence.faces if reference.face_sets is None else reference.faces(fault.frame, fault.pair)
        if met is not None:
            faces = [np.unique(met[:, 0]), np.unique(met[:, 1])]
    else:
        row = fault.frame
        solids = _solids(result, label, ends)
    motion = assembly.motion
    two = [
        Placed(
            assembly.bodies[body].name,
            assembly.bodies[body].mesh,
            (motion.rotations[row, body], motion.translations[row, body]),
            solid,
            meeting,
        )
        for body, solid, meeting in zip(ends, solids, faces, strict=True)
    ]
    hollow = fault.evidence.hollow
    two.sort(key=lambda placed: (placed.name == hollow, placed.filled, np.ptp(placed.mesh.vertices, axis=0).max()))
    gap = None if fault.evidence.nearest is None else np.array(fault.evidence.nearest)
    along = fault.evidence.normal if fault.kind.is_miss else np.zeros(3) if gap is None else gap[1] - gap[0]
    return Sight(two[0], two[1], np.asarray(fault.point), gap, across(np.asarray(along), user), fault.kind)


def _solids(result: RunResult, label: str, bodies: Sequence[int]) -> list[TriangleMesh | None]:
    """Colliders of a detector that differ visibly from their mesh; if none does, those that differ at all."""
    colliders: Sequence[Any] = getattr(result.detectors.get(label), "colliders", ())
    if not colliders:
        return [None for _ in bodies]
    two = [(result.assembly.bodies[body].mesh, colliders[body].mesh) for body in bodies]
    larger = [_volume(solid) > HOLLOW * _volume(mesh) for mesh, solid in two]
    chosen = larger if any(larger) else [solid is not mesh for mesh, solid in two]
    return [solid if other else None for (_, solid), other in zip(two, chosen, strict=True)]


def _volume(mesh: TriangleMesh) -> float:
    a, b, c = np.moveaxis(mesh.triangles - mesh.vertices.mean(axis=0), 1, 0)
    return abs(float((a * np.cross(b, c)).sum())) / 6


def _shown(sight: Sight) -> FloatArray:
    """Points that the picture must hold: both bodies, no farther from the fault than the smaller is large."""
    outlines = [sight.white.outline, sight.glass.outline]
    near = min(float(np.linalg.norm(np.ptp(points, axis=0))) for points in outlines)
    every = np.concatenate(outlines)
    close = np.linalg.norm(every - sight.point, axis=1) < near * (0.5 if sight.gap is None else 1.0)
    return np.concatenate([sight.point[None], every[close]])


def _parts(sight: Sight, view: View) -> tuple[list[Shape], list[Shape], list[Lines]]:
    """Opaque shapes, the white body first, those of glass, and the lines of the cages."""
    opaque, glass, lines = list[Shape](), list[Shape](), list[Lines]()
    for placed in (sight.white, sight.glass):
        corners = place_points(placed.mesh.vertices, *placed.pose)[placed.mesh.faces]
        # Two triangles of a bench top would paint it whole.
        painted = placed.faces[np.ptp(corners[placed.faces], axis=1).max(axis=1) < LARGEST_MARK]
        rest = np.delete(corners, painted, axis=0)
        if placed is sight.white:
            opaque.append(Shape(rest, WHITE))
        else:
            glass.append(Shape(rest, GLASS, GLASS_ALPHA))
        opaque.append(Shape(corners[painted], unit_colour(fault_colour(sight.kind))))
        if placed.solid is not None:
            walls, edges = _cage(placed.solid, placed.mesh, placed.pose, view, unit_colour(FALSE_CONTACT))
            glass.append(walls)
            lines += edges
    return opaque, glass, lines


def _cage(
    solid: TriangleMesh, mesh: TriangleMesh, pose: tuple[FloatArray, FloatArray], view: View, colour: Colour
) -> tuple[Shape, list[Lines]]:
    """A ``solid`` that stands for a ``mesh`` at a pose (rotation, translation): its walls, and as lines for this view
    its outline and its sharp edges."""
    normals = face_normals(solid.triangles)[1] @ pose[0].T
    corners = place_points(solid.triangles, *pose)
    edges, faces = edges_of(solid)
    edges = place_points(edges, *pose)
    front = (normals * (view.position - corners.mean(axis=1))).sum(axis=1) > 0
    walls = Shape(corners, colour, np.where(_lid(solid, mesh), LID_ALPHA, WALL_ALPHA))
    outline = front[faces[:, 0]] != front[faces[:, 1]]
    sharp = bends(normals, faces) < np.cos(np.radians(SHARP_DEG))
    visible = front[faces].any(axis=1)
    thick = 2 if view.size[1] > MANY_ROWS else 1
    groups = [(sharp & ~visible, 0.35, 1), (sharp & visible, 0.95, thick), (outline, 1.0, thick + 1)]
    return walls, [Lines(edges[some], colour, alpha, width) for some, alpha, width in groups]


def _lid(solid: TriangleMesh, mesh: TriangleMesh) -> BoolArray:
    """Faces of a solid that span a hollow of the mesh: the middle of an edge is far from every vertex."""
    from scipy.spatial import KDTree

    corners = solid.triangles
    middles = (corners + np.roll(corners, 1, axis=1)) / 2
    away = KDTree(mesh.vertices).query(middles.reshape(-1, 3))[0].reshape(-1, 3).max(axis=1)
    spans: BoolArray = away > LID * np.linalg.norm(np.ptp(solid.vertices, axis=0))
    return spans


def unit_colour(colour: Rgba) -> Colour:
    """Returns a colour as fractions from 0 to 1, without alpha."""
    red, green, blue, _ = colour
    return red / 255, green / 255, blue / 255


@cache
def background(size: tuple[int, int]) -> FloatArray:
    """Dark, lighter in the middle."""
    y, x = np.mgrid[0 : size[1], 0 : size[0]]
    away = np.hypot(x / size[0] - 0.4, (y / size[1] - 0.42) * size[1] / size[0]) / 0.8
    return DARK + np.clip(1.0 - away, 0.0, 1.0)[..., None] * (LIGHTER - DARK)


Point = tuple[float, float]


def _arrow(sight: Sight, view: View, factor: float) -> tuple[str, Point]:
    """The gap as the path of an arrow with two heads, of a small one or a contact nothing; and its middle."""
    ends = view.pixels(np.stack([sight.point] * 2) if sight.gap is None else sight.gap)[:, :2] / factor
    (x, y), along = ends.mean(axis=0).tolist(), ends[1] - ends[0]
    length = float(np.hypot(*along))
    if length < SHORTEST_ARROW:
        return "", (x, y)
    step = along / length
    aside = np.array([-step[1], step[0]])
    strokes = [f"M{_at(ends[0])}L{_at(ends[1])}"]
    for tip, inward in ((ends[0], step), (ends[1], -step)):
        strokes.append(f"M{_at(tip + 6 * inward + 4 * aside)}L{_at(tip)}L{_at(tip + 6 * inward - 4 * aside)}")
    return "".join(strokes), (x, y)


def _at(point: FloatArray) -> str:
    return f"{point[0]:.1f} {point[1]:.1f}"


@dataclass(frozen=True)
class Named:
    """A name beside the picture, what is said of it below, its colour, what it names, and its height."""

    name: str
    what: str
    kind: str
    target: Point
    y: float


def _words(sight: Sight, label: str, view: View, white: BoolArray, middle: Point) -> list[Named]:
    """Names beside the picture, from top to bottom without overlap, each with a line to what it names.

    ``white`` (rows, columns): where the white body is seen; ``middle`` of the arrow.
    """
    factor, labels = SHARPER[FIRST], list[tuple[Point, str, str, str]]()
    verb = "touches nothing" if sight.gap is not None else "touches"
    rows, columns = np.nonzero(white)
    if len(rows):
        row = rows[len(rows) // 4]
        point = float(columns[rows == row].max()) / factor, float(row) / factor
        labels.append((point, sight.white.name, verb, ""))
    points = view.pixels(sight.glass.outline)[:, :2] / factor
    points = points[(points.min(axis=1) > 0) & (points[:, 1] < FIRST[1]) & (points[:, 0] < FIRST[0] - WORDS)]
    named = (sight.glass.name, verb, "blue")
    if sight.glass.solid:
        named = ("solid collider", f"{label}: contact", "yellow")
    if len(points):
        x, y = points[np.argmax(points[:, 0] - 0.3 * np.abs(points[:, 1] - FIRST[1] * 0.42))].tolist()
        labels.append(((x, y), *named))
    if sight.gap is not None:
        between = f"from {sight.white.name} to {sight.glass.name}"
        labels.append((middle, sight.length, between if len(between) <= MOST_CHARACTERS else "apart", ""))
    else:
        key = fault_key(sight.kind)
        outcome = {"missed": "reports none", "late": "misses a part", "false": "alone reports it"}[key]
        labels.append((middle, "contact", f"{label} {outcome}", COLOUR_NAMES[key]))
    labels.sort(key=lambda name: name[0][1])
    made, free = list[Named](), LINES
    for number, (target, name, what, kind) in enumerate(labels):
        y = min(max(target[1], free), FIRST[1] - LINES * (len(labels) - number - 0.5))
        free = y + LINES
        made.append(Named(_cut(name), _cut(what), kind, target, y))
    return made


def _cut(text: str) -> str:
    return text if len(text) <= MOST_CHARACTERS else f"{text[: MOST_CHARACTERS - 1]}…"
