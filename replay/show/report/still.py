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
from replay.show.camera import towards_user, viewing_direction
from replay.show.drawn_mesh import bend_cosines, edges_of, face_normals, spans_hollow
from replay.show.palette import COLOUR_NAMES, FALSE_CONTACT, Rgba, fault_colour, fault_key
from replay.show.report.markup import render_template
from replay.show.report.rasteriser import Colour, Lines, Shape, View, draw_picture
from replay.words import length as length_words

FIRST_SIZE: Final = (470, 352)
CARD_SIZE: Final = (300, 170)
"""Width and height of a picture, in its own units."""

PIXELS_PER_UNIT: Final = {FIRST_SIZE: 1.8, CARD_SIZE: 1.4}
"""Pixels a unit."""

LABELS_WIDTH: Final = 150
"""Units on the right of the first picture that its words take."""

MOST_LABEL_CHARACTERS: Final = 19
"""That fit into it."""

NAME_SPACING: Final = 44.0
"""Units from one name to the next."""

WHITE: Final[Colour] = (0.95, 0.96, 0.97)
GLASS: Final[Colour] = (0.45, 0.70, 0.95)
GLASS_ALPHA: Final = 0.13
GLASS_IN_SOLID_ALPHA: Final = 0.26
REAL_EDGE: Final[Colour] = (0.61, 0.79, 0.96)
"""Of the outline of a body inside a solid that stands for it."""
DARK_RGB: Final = np.array([18, 26, 37]) / 255
LIGHT_RGB: Final = np.array([40, 55, 74]) / 255

LEAST_VOLUME_RATIO: Final = 1.1
"""A solid of so many times the volume of its mesh differs from it enough to be drawn."""

LARGEST_MARK_M: Final = 0.03
"""Metres; a face that is larger is not painted where bodies meet."""

SHORTEST_ARROW: Final = 14.0
"""Units; a shorter gap is a ring."""

SHARP_EDGE_DEG: Final = 30.0
"""Faces that meet in a larger angle have an edge between them."""

MANY_ROWS: Final = 400
"""In a picture of fewer rows lines are thinner."""

WALL_ALPHA, LID_ALPHA, WALL_UNDER_LID_ALPHA = 0.24, 0.55, 0.05
"""Of the faces of a solid, of those that close a hollow, and of the others beside such a lid: there is the glass."""


@dataclass(frozen=True)
class PlacedBody:
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
    def extra_volume(self) -> float:
        """Cubic metres that what stands for the body has more than its mesh."""
        return 0.0 if self.solid is None else _volume(self.solid) - _volume(self.mesh)


@dataclass(frozen=True)
class Sight:
    """Contents of a picture: the white body, the glass body, and their nearest or common points."""

    white: PlacedBody
    glass: PlacedBody
    point: FloatArray
    gap: FloatArray | None  # nearest points (2, 3) of the surfaces; ``None`` where they meet
    away: FloatArray  # direction to look from
    kind: FaultKind

    @property
    def length(self) -> str:
        """The gap in words, ``""`` where the bodies meet."""
        return "" if self.gap is None else length_words(float(np.linalg.norm(self.gap[1] - self.gap[0])))


def fault_still(result: RunResult, label: str, fault: Fault, size: tuple[int, int] = CARD_SIZE) -> tuple[str, str]:
    """A fault as SVG around a raster picture, and its colours in words; in the first of a page each part is named."""
    sight, factor, has_labels = _sight_of_fault(result, label, fault), PIXELS_PER_UNIT[size], size == FIRST_SIZE
    pixels = round(size[0] * factor), round(size[1] * factor)
    view = View.of(_points_in_picture(sight), sight.away, pixels, round(LABELS_WIDTH * factor) if has_labels else 0)
    picture, shape = draw_picture(view, *_shapes_and_lines(sight, view), background(pixels))
    arrow_path, arrow_middle = _arrow(sight, view, factor)
    contact_clause = (
        f"are {sight.length} apart, and {label} reports contact" if sight.gap is not None else "meet, unreported"
    )
    svg = render_template(
        "show/report/still.html",
        size=size,
        description=f"{sight.white.name} and {sight.glass.name} {contact_clause}",
        picture=webp(picture),
        strokes=arrow_path,
        middle=arrow_middle,
        ring=f"ring {fault_key(fault.kind)}" if sight.gap is None else "ring",
        words=_picture_labels(sight, label, view, shape == 0, arrow_middle) if has_labels else (),
        x=FIRST_SIZE[0] - LABELS_WIDTH + 8,
    )
    colours = [f"{sight.white.name} white", f"{sight.glass.name} blue"]
    if sight.white.solid or sight.glass.solid:
        colours.append("collider yellow")
    if fault.kind.is_miss:
        colours.append(f"where they meet {COLOUR_NAMES[fault_key(fault.kind)]}")
    return svg, ", ".join(colours)


def paired_stills(
    result: RunResult, labels: Sequence[str], fault: Fault, size: tuple[int, int] = CARD_SIZE
) -> list[str]:
    """The moment of a false contact of the first detector as an SVG a detector, with its colliders, by one camera."""
    first_sight, factor = _sight_of_fault(result, labels[0], fault), PIXELS_PER_UNIT[size]
    pixels = round(size[0] * factor), round(size[1] * factor)
    view = View.of(_points_in_picture(first_sight), first_sight.away, pixels)
    stills = []
    for label in labels:
        sight = _with_colliders(first_sight, result, label)
        picture, _ = draw_picture(view, *_shapes_and_lines(sight, view), background(pixels))
        arrow_path, arrow_middle = _arrow(sight, view, factor)
        body_names = f"{sight.white.name} and {sight.glass.name}"
        stills.append(
            render_template(
                "show/report/still.html",
                size=size,
                description=f"{body_names} {sight.length} apart, with the colliders of {label}",
                picture=webp(picture),
                strokes=arrow_path,
                middle=arrow_middle,
                ring="ring",
                words=(),
                x=0,
            )
        )
    return stills


def _with_colliders(sight: Sight, result: RunResult, label: str) -> Sight:
    """The same moment with the colliders of another detector."""
    body_names = result.assembly.names
    white_solid, glass_solid = _solids(
        result, label, [body_names.index(sight.white.name), body_names.index(sight.glass.name)]
    )
    return replace(sight, white=replace(sight.white, solid=white_solid), glass=replace(sight.glass, solid=glass_solid))


def webp(picture: FloatArray) -> str:
    """A raster picture as it lies in an address."""
    import PIL.Image
    import PIL.WebPImagePlugin  # without it the first picture loads the plugins of all forty formats

    buffer = io.BytesIO()
    PIL.Image.fromarray(np.round(picture * 255).astype(np.uint8)).save(buffer, "WEBP", quality=82, method=2)
    return b64encode(buffer.getvalue()).decode()


def _sight_of_fault(result: RunResult, label: str, fault: Fault) -> Sight:
    """The two bodies of a fault where there is most to see of it."""
    assembly, row = result.assembly, 0
    pair_bodies = assembly.pairs[fault.pair].tolist()
    no_faces = np.zeros(0, dtype=np.int64)
    faces, solids = [no_faces, no_faces], list[TriangleMesh | None]([None, None])
    user_direction = towards_user(assembly, result.session.scene, fault.frame, fault.point)
    touch = fault.evidence.touch
    if fault.kind.is_miss:
        row = fault.frame
        if touch is not None:
            assembly, row = at_touch(assembly, fault.pair, touch), 0
        reference = result.detections[result.oracle]
        met_faces = fault.evidence.faces if reference.face_sets is None else reference.faces(fault.frame, fault.pair)
        if met_faces is not None:
            faces = [np.unique(met_faces[:, 0]), np.unique(met_faces[:, 1])]
    else:
        row = fault.frame
        solids = _solids(result, label, pair_bodies)
    motion = assembly.motion
    two_bodies = [
        PlacedBody(
            assembly.bodies[body].name,
            assembly.bodies[body].mesh,
            (motion.rotations[row, body], motion.translations[row, body]),
            solid,
            touching_faces,
        )
        for body, solid, touching_faces in zip(pair_bodies, solids, faces, strict=True)
    ]
    hollow = fault.evidence.hollow
    two_bodies.sort(
        key=lambda placed: (placed.name == hollow, placed.extra_volume, np.ptp(placed.mesh.vertices, axis=0).max())
    )
    gap = None if fault.evidence.nearest is None else np.array(fault.evidence.nearest)
    gap_direction = fault.evidence.normal if fault.kind.is_miss else np.zeros(3) if gap is None else gap[1] - gap[0]
    return Sight(
        two_bodies[0],
        two_bodies[1],
        np.asarray(fault.point),
        gap,
        viewing_direction(np.asarray(gap_direction), user_direction),
        fault.kind,
    )


def _solids(result: RunResult, label: str, bodies: Sequence[int]) -> list[TriangleMesh | None]:
    """Colliders of a detector that differ visibly from their mesh; if none does, those that differ at all."""
    colliders: Sequence[Any] = getattr(result.detectors.get(label), "colliders", ())
    if not colliders:
        return [None for _ in bodies]
    two_bodies = [(result.assembly.bodies[body].mesh, colliders[body].mesh) for body in bodies]
    is_visibly_larger = [_volume(solid) > LEAST_VOLUME_RATIO * _volume(mesh) for mesh, solid in two_bodies]
    is_chosen = is_visibly_larger if any(is_visibly_larger) else [solid is not mesh for mesh, solid in two_bodies]
    return [solid if other else None for (_, solid), other in zip(two_bodies, is_chosen, strict=True)]


def _volume(mesh: TriangleMesh) -> float:
    a, b, c = np.moveaxis(mesh.triangles - mesh.vertices.mean(axis=0), 1, 0)
    return abs(float((a * np.cross(b, c)).sum())) / 6


def _points_in_picture(sight: Sight) -> FloatArray:
    """Points that the picture must hold: both bodies, no farther from the fault than the smaller is large."""
    body_outlines = [sight.white.outline, sight.glass.outline]
    smaller_size = min(float(np.linalg.norm(np.ptp(points, axis=0))) for points in body_outlines)
    all_points = np.concatenate(body_outlines)
    is_close = np.linalg.norm(all_points - sight.point, axis=1) < smaller_size * (0.5 if sight.gap is None else 1.0)
    return np.concatenate([sight.point[None], all_points[is_close]])


def _shapes_and_lines(sight: Sight, view: View) -> tuple[list[Shape], list[Shape], list[Lines]]:
    """Opaque shapes, the white body first, those of glass, and the lines of the cages."""
    opaque, glass, lines = list[Shape](), list[Shape](), list[Lines]()
    for placed_body in (sight.white, sight.glass):
        corners = place_points(placed_body.mesh.vertices, *placed_body.pose)[placed_body.mesh.faces]
        # Two triangles of a bench top would paint it whole.
        painted_faces = placed_body.faces[np.ptp(corners[placed_body.faces], axis=1).max(axis=1) < LARGEST_MARK_M]
        other_triangles = np.delete(corners, painted_faces, axis=0)
        if placed_body is sight.white:
            opaque.append(Shape(other_triangles, WHITE))
        else:
            glass.append(Shape(other_triangles, GLASS, GLASS_IN_SOLID_ALPHA if placed_body.solid else GLASS_ALPHA))
        opaque.append(Shape(corners[painted_faces], unit_colour(fault_colour(sight.kind))))
        if placed_body.solid is not None:
            walls, edges = _cage(
                placed_body.solid, placed_body.mesh, placed_body.pose, view, unit_colour(FALSE_CONTACT)
            )
            glass.append(walls)
            # The real surface stands out from the walls around it by its own outline, inside that of the walls.
            lines += [*_cage(placed_body.mesh, placed_body.mesh, placed_body.pose, view, REAL_EDGE)[1], *edges]
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
    is_front = (normals * (view.position - corners.mean(axis=1))).sum(axis=1) > 0
    lid = spans_hollow(solid, mesh)
    wall_shape = Shape(corners, colour, np.where(lid, LID_ALPHA, WALL_UNDER_LID_ALPHA if lid.any() else WALL_ALPHA))
    is_outline_edge = is_front[faces[:, 0]] != is_front[faces[:, 1]]
    is_sharp = bend_cosines(normals, faces) < np.cos(np.radians(SHARP_EDGE_DEG))
    is_visible = is_front[faces].any(axis=1)
    line_width = 2 if view.size[1] > MANY_ROWS else 1
    groups = [
        (is_sharp & ~is_visible, 0.35, 1),
        (is_sharp & is_visible, 0.95, line_width),
        (is_outline_edge, 1.0, line_width + 1),
    ]
    return wall_shape, [Lines(edges[edge_mask], colour, alpha, width) for edge_mask, alpha, width in groups]


def unit_colour(colour: Rgba) -> Colour:
    """Returns a colour as fractions from 0 to 1, without alpha."""
    red, green, blue, _ = colour
    return red / 255, green / 255, blue / 255


@cache
def background(size: tuple[int, int]) -> FloatArray:
    """Dark, lighter in the middle."""
    y, x = np.mgrid[0 : size[1], 0 : size[0]]
    distance_from_middle = np.hypot(x / size[0] - 0.4, (y / size[1] - 0.42) * size[1] / size[0]) / 0.8
    return DARK_RGB + np.clip(1.0 - distance_from_middle, 0.0, 1.0)[..., None] * (LIGHT_RGB - DARK_RGB)


Point = tuple[float, float]


def _arrow(sight: Sight, view: View, factor: float) -> tuple[str, Point]:
    """The gap as the path of an arrow with two heads, of a small one or a contact nothing; and its middle."""
    end_pixels = view.pixels(np.stack([sight.point] * 2) if sight.gap is None else sight.gap)[:, :2] / factor
    (x, y), gap_direction = end_pixels.mean(axis=0).tolist(), end_pixels[1] - end_pixels[0]
    length = float(np.hypot(*gap_direction))
    if length < SHORTEST_ARROW:
        return "", (x, y)
    arrow_direction = gap_direction / length
    sideways = np.array([-arrow_direction[1], arrow_direction[0]])
    strokes = [f"M{_xy_text(end_pixels[0])}L{_xy_text(end_pixels[1])}"]
    for tip, inward in ((end_pixels[0], arrow_direction), (end_pixels[1], -arrow_direction)):
        strokes.append(
            f"M{_xy_text(tip + 6 * inward + 4 * sideways)}L{_xy_text(tip)}L{_xy_text(tip + 6 * inward - 4 * sideways)}"
        )
    return "".join(strokes), (x, y)


def _xy_text(point: FloatArray) -> str:
    return f"{point[0]:.1f} {point[1]:.1f}"


@dataclass(frozen=True)
class PictureLabel:
    """A name beside the picture, what is said of it below, its colour, what it names, and its height."""

    name: str
    what: str
    kind: str
    target: Point
    y: float


def _picture_labels(sight: Sight, label: str, view: View, white: BoolArray, middle: Point) -> list[PictureLabel]:
    """Names beside the picture, from top to bottom without overlap, each with a line to what it names.

    ``white`` (rows, columns): where the white body is seen; ``middle`` of the arrow.
    """
    factor, labels = PIXELS_PER_UNIT[FIRST_SIZE], list[tuple[Point, str, str, str]]()
    verb = "touches nothing" if sight.gap is not None else "touches"
    white_rows, white_columns = np.nonzero(white)
    if len(white_rows):
        row = white_rows[len(white_rows) // 4]
        point = float(white_columns[white_rows == row].max()) / factor, float(row) / factor
        labels.append((point, sight.white.name, verb, ""))
    points = view.pixels(sight.glass.outline)[:, :2] / factor
    points = points[
        (points.min(axis=1) > 0) & (points[:, 1] < FIRST_SIZE[1]) & (points[:, 0] < FIRST_SIZE[0] - LABELS_WIDTH)
    ]
    glass_label = (sight.glass.name, verb, "blue")
    if sight.glass.solid:
        glass_label = ("collider", f"{label}: contact", "yellow")
        surface = view.pixels(place_points(sight.glass.mesh.vertices, *sight.glass.pose))[:, :2] / factor
        x, y = surface[np.argmax(surface.sum(axis=1))].tolist()
        labels.append(((x, y), sight.glass.name, "the real surface", "blue"))
    if len(points):
        x, y = points[np.argmax(points[:, 0] - 0.3 * np.abs(points[:, 1] - FIRST_SIZE[1] * 0.42))].tolist()
        labels.append(((x, y), *glass_label))
    if sight.gap is not None:
        between_text = f"from {sight.white.name} to {sight.glass.name}"
        labels.append(
            (middle, sight.length, between_text if len(between_text) <= MOST_LABEL_CHARACTERS else "apart", "")
        )
    else:
        colour_key = fault_key(sight.kind)
        outcome = {"missed": "reports none", "late": "misses a part", "false": "alone reports it"}[colour_key]
        labels.append((middle, "contact", f"{label} {outcome}", COLOUR_NAMES[colour_key]))
    labels.sort(key=lambda name: name[0][1])
    picture_labels, next_y = list[PictureLabel](), NAME_SPACING
    for label_number, (target, name, caption, kind) in enumerate(labels):
        y = min(max(target[1], next_y), FIRST_SIZE[1] - NAME_SPACING * (len(labels) - label_number - 0.5))
        next_y = y + NAME_SPACING
        picture_labels.append(PictureLabel(_clip_text(name), _clip_text(caption), kind, target, y))
    return picture_labels


def _clip_text(caption: str) -> str:
    return caption if len(caption) <= MOST_LABEL_CHARACTERS else f"{caption[: MOST_LABEL_CHARACTERS - 1]}…"
