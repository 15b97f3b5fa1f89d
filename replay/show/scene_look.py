"""Pictures of a recording as it was imported: bodies with their names, a grid of 10 cm, and the axes of the room."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from cdcore.numerics import FloatArray
from cdcore.poses import place_points
from replay import words
from replay.errors import OutputError
from replay.prepare.assembly import Assembly
from replay.show.camera import aside_and_above, points_in_world, towards_user
from replay.show.palette import BACKGROUND, SERIES_COLOURS, TICKS, Rgba
from replay.show.report.rasteriser import Colour, Lines, Shape, View, draw_picture
from sessions.model.scene import Scene
from sessions.whole_files import whole_file

PICTURE_SIZE: Final = (960, 640)
GRID_M: Final = 0.1
MOST_LINES: Final = 41
"""Grid lines each way; a larger scene has a coarser grid, of 1, 10, ... metres."""

AXIS_COLOURS: Final[tuple[Rgba, Rgba, Rgba]] = ((235, 110, 110, 255), (110, 210, 120, 255), (110, 150, 255, 255))
AXIS_NAMES: Final = ("x right", "y up", "z back")
ELEVATION_DEG: Final = 24.0
AZIMUTH_DEG: Final = 28.0
MOST_FACES: Final = 20_000
"""Faces of a body that are drawn; of more, evenly chosen ones."""


@dataclass(frozen=True)
class Moment:
    """A frame to draw, and its name."""

    name: str
    frame: int
    bodies: tuple[int, ...] = ()
    """Bodies that the picture is about; none: all."""


@dataclass(frozen=True, eq=False)
class Guides:
    """The grid under the bodies and the axes at its corner.

    Parameters
    ----------
    grid : segments (k, 2, 3), world metres; ``spacing`` metres apart.
    axes : three segments (3, 2, 3) along +x, +y and +z.
    """

    grid: FloatArray
    axes: FloatArray
    spacing: float


def moments_to_show(assembly: Assembly, closest_frame: int, closest_pair: int) -> list[Moment]:
    """Returns the first, the middle and the closest moment; ``closest_*`` by number in the assembly."""
    posed_frames = np.flatnonzero(assembly.motion.valid.any(axis=1))
    candidate_frames = posed_frames if len(posed_frames) else np.zeros(1, dtype=np.int64)
    pair = tuple(assembly.pairs[closest_pair].tolist()) if len(assembly.pairs) else ()
    return [
        Moment("first", int(candidate_frames[0])),
        Moment("middle", int(candidate_frames[len(candidate_frames) // 2])),
        Moment("closest", closest_frame, pair),
    ]


def guides_of(points: FloatArray, corner_direction: FloatArray) -> Guides:
    """Returns a grid of 10 cm below points (n, 3), and axes at its corner that lies farthest in a direction (3,)."""
    lower, upper = points.min(axis=0), points.max(axis=0)
    spacing = GRID_M
    while (upper - lower)[[0, 2]].max() / spacing > MOST_LINES - 2:
        spacing *= 10.0
    edges = [
        np.arange(np.floor(lower[axis] / spacing), np.ceil(upper[axis] / spacing) + 1) * spacing for axis in (0, 2)
    ]
    along_x = [[[edges[0][0], lower[1], z], [edges[0][-1], lower[1], z]] for z in edges[1]]
    along_z = [[[x, lower[1], edges[1][0]], [x, lower[1], edges[1][-1]]] for x in edges[0]]
    corner_coordinates = [
        edge[-1] if side > 0 else edge[0] for edge, side in zip(edges, corner_direction[[0, 2]].tolist(), strict=True)
    ]
    grid_corner = np.array([corner_coordinates[0], lower[1], corner_coordinates[1]])
    axes = np.stack([np.stack([grid_corner, grid_corner + spacing * np.eye(3)[axis]]) for axis in range(3)])
    return Guides(np.array(along_x + along_z), axes, spacing)


def write_scene_pictures(assembly: Assembly, scene: Scene, moments: Sequence[Moment], folder: Path) -> list[Path]:
    """Writes one PNG a moment into a folder and returns their paths.

    Raises ``OutputError``: a file cannot be written.
    """
    paths = []
    for moment in moments:
        path = folder / f"{moment.name}.png"
        with whole_file(path, OutputError, parents=True) as file:
            file.write(scene_picture(assembly, scene, moment))
        paths.append(path)
    return paths


def scene_picture(assembly: Assembly, scene: Scene, moment: Moment) -> bytes:
    """Returns a moment as PNG."""
    displayed_bodies = [body for body in range(len(assembly.bodies)) if assembly.motion.valid[moment.frame, body]]
    focused_bodies = [
        body for body in displayed_bodies if not moment.bodies or body in moment.bodies
    ] or displayed_bodies
    corners = {body: _corners(assembly, moment.frame, body) for body in displayed_bodies}
    if not corners:
        return _png(np.broadcast_to(_colour(BACKGROUND), (PICTURE_SIZE[1], PICTURE_SIZE[0], 3)), [])
    focused_points = np.concatenate([corners[body].reshape(-1, 3) for body in focused_bodies])
    user_direction = towards_user(assembly, scene, moment.frame, focused_points.mean(axis=0).tolist())
    direction = aside_and_above(user_direction, AZIMUTH_DEG, ELEVATION_DEG)
    guides = guides_of(focused_points, direction)
    all_points = np.concatenate([focused_points, guides.axes.reshape(-1, 3)])
    view = View.of(all_points, direction, PICTURE_SIZE)
    shapes = [Shape(corners[body], _body_colour(body)) for body in displayed_bodies]
    lines = [Lines(guides.grid, _colour(TICKS), 0.35)]
    for axis, colour in zip(guides.axes, AXIS_COLOURS, strict=True):
        lines.append(Lines(axis[None], _colour(colour), 1.0, 3))
    background = np.broadcast_to(_colour(BACKGROUND), (PICTURE_SIZE[1], PICTURE_SIZE[0], 3)).astype(np.float64)
    picture, _ = draw_picture(view, shapes, [], lines, background)
    return _png(picture, [*_labels(assembly, view, guides, corners, moment)])


def _corners(assembly: Assembly, frame: int, body: int) -> FloatArray:
    """Triangles (n, 3, 3) of a body where it stands in a frame."""
    mesh = assembly.bodies[body].mesh
    face_step = max(1, len(mesh.faces) // MOST_FACES)
    corners: FloatArray = points_in_world(assembly.motion, frame, body, mesh.vertices)[mesh.faces[::face_step]]
    return corners


def _body_colour(body: int) -> Colour:
    return _colour(SERIES_COLOURS[body % len(SERIES_COLOURS)])


def _colour(colour: Rgba) -> Colour:
    return colour[0] / 255, colour[1] / 255, colour[2] / 255


@dataclass(frozen=True)
class Label:
    """Words at a pixel."""

    text: str
    x: float
    y: float
    colour: Rgba


def _labels(
    assembly: Assembly, view: View, guides: Guides, corners: dict[int, FloatArray], moment: Moment
) -> Iterator[Label]:
    """Names of bodies at their middles, of axes at their ends, and what the grid is."""
    for body, triangles in corners.items():
        x, y, _ = view.pixels(triangles.reshape(-1, 3).mean(axis=0)[None])[0]
        yield Label(assembly.bodies[body].name, x, y, (255, 255, 255, 255))
    for axis, name, colour in zip(guides.axes, AXIS_NAMES, AXIS_COLOURS, strict=True):
        x, y, _ = view.pixels(axis[1:])[0]
        yield Label(name, x + 4, y - 6, colour)
    seconds = float(assembly.motion.times[moment.frame])
    spacing_text = f"{guides.spacing:g} m" if guides.spacing >= 1.0 else f"{100 * guides.spacing:g} cm"
    yield Label(f"{moment.name} moment, {words.moment(seconds)}; grid {spacing_text}", 12, 14, TICKS)


def _png(picture: FloatArray, labels: Sequence[Label]) -> bytes:
    import io

    from PIL import Image, ImageDraw, ImageFont

    image = Image.fromarray(np.round(np.asarray(picture) * 255).astype(np.uint8))
    pen, font = ImageDraw.Draw(image), ImageFont.load_default(15)
    for label in labels:
        position = (label.x, label.y)
        pen.text(position, label.text, fill=label.colour[:3], font=font, stroke_width=2, stroke_fill=BACKGROUND[:3])
    out = io.BytesIO()
    image.save(out, "PNG")
    return out.getvalue()


def grid_and_axes(assembly: Assembly, frame: int) -> Guides:
    """Returns the guides below all bodies of a frame."""
    posed_bodies = np.flatnonzero(assembly.motion.valid[frame])
    points = [
        place_points(
            assembly.bodies[body].mesh.vertices,
            assembly.motion.rotations[frame, body],
            assembly.motion.translations[frame, body],
        )
        for body in posed_bodies.tolist()
    ]
    return guides_of(np.concatenate(points) if points else np.zeros((1, 3)), np.array([0.0, 0.0, 1.0]))
