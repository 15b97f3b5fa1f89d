"""Pictures of colliders: the mesh, its pieces in colours, and how far they reach beyond it as a scale of colours."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from cdcore import TriangleMesh
from cdcore.containment.ray_parity import INSIDE, build_inside_grid, states_of_points
from cdcore.numerics import FloatArray, IntArray
from replay.cutting.surface_distance import SampledSurface, refined_triangles
from replay.show.drawn_mesh import bend_cosines, edges_of, face_normals
from replay.show.palette import SERIES_COLOURS, hex_of
from replay.show.report.markup import render_template
from replay.show.report.rasteriser import Colour, Lines, Shape, View, draw_picture
from replay.show.report.still import SHARP_EDGE_DEG, background, unit_colour, webp

PICTURE_SIZE: Final = (300, 210)
"""Width and height of a picture, in its own units."""

PICTURE_PIXELS: Final = (390, 273)

VIEW_DIRECTION: Final = np.array([0.45, 0.85, 0.8])
"""Direction to look from, in the axes of the body: from above, into what is hollow."""

SHADE_COUNT: Final = 24
"""Colours of the scale that are drawn apart."""

COLOUR_STOPS: Final[tuple[Colour, ...]] = ((0.27, 0.40, 0.62), (0.62, 0.66, 0.66), (1.0, 0.84, 0.25))
"""Colours of the scale from none to the farthest: they differ in lightness, and none of them is the red of misses."""

EDGES_PER_SIZE: Final = 20
"""Edges of triangles of the scale are at most this part of the size of a body."""

EDGE_COLOUR: Final[Colour] = (0.06, 0.08, 0.11)
MESH_COLOUR: Final[Colour] = (0.85, 0.88, 0.92)


def scale_gradient() -> str:
    """Returns the colours of the scale as a gradient of a style sheet."""
    colour_stops = ", ".join(hex_of(_bytes(colour)) for colour in COLOUR_STOPS)
    return f"linear-gradient(90deg, {colour_stops})"


def mesh_picture(mesh: TriangleMesh, alternative_text: str) -> str:
    """Returns a mesh as SVG; ``alternative_text`` is for those who cannot see it."""
    return _picture([Shape(mesh.triangles, MESH_COLOUR)], [mesh], alternative_text)


def pieces_picture(pieces: Sequence[TriangleMesh], alternative_text: str) -> str:
    """Returns pieces as SVG, such that no two that touch have the same colour as far as the palette goes."""
    colours = [unit_colour(SERIES_COLOURS[number]) for number in colour_numbers(pieces, len(SERIES_COLOURS))]
    shapes = [Shape(piece.triangles, colour) for piece, colour in zip(pieces, colours, strict=True)]
    return _picture(shapes, pieces, alternative_text)


def reach_picture(
    mesh: TriangleMesh, pieces: Sequence[TriangleMesh], largest_distance: float, alternative_text: str
) -> str:
    """Returns pieces as SVG, coloured by how far they stand beyond the mesh, from 0 to ``largest_distance`` metres."""
    triangles = refined_triangles(np.concatenate([piece.triangles for piece in pieces]), _size(mesh) / EDGES_PER_SIZE)
    distances_beyond = beyond_mesh(triangles.mean(axis=1), mesh)
    shade_of_triangle = (
        np.clip(distances_beyond / max(largest_distance, 1e-12) * (SHADE_COUNT - 1), 0, SHADE_COUNT - 1)
        .round()
        .astype(np.int64)
    )
    shapes = [
        Shape(triangles[shade_of_triangle == number], scale_colour(number / (SHADE_COUNT - 1)))
        for number in np.unique(shade_of_triangle).tolist()
    ]
    return _picture(shapes, [], alternative_text)


def beyond_mesh(points: FloatArray, mesh: TriangleMesh) -> FloatArray:
    """Metres by which points (n, 3) lie beyond the surface of a mesh, (n,); 0 inside it.

    A mesh with holes has no inside: there every distance from its surface counts.
    """
    distances = SampledSurface(mesh.triangles).distances(points)
    if not mesh.is_closed:
        return distances
    grid = build_inside_grid(mesh.triangles)
    containment_margin = 1e-12 * grid.size
    # A ray that meets an edge leaves it open whether a point is inside: it is drawn by its distance.
    return np.where(states_of_points(grid, points, containment_margin) == INSIDE, 0.0, distances)


def scale_colour(fraction: float) -> Colour:
    """The colour of the scale at a fraction of it, 0 to 1."""
    stop_positions = np.linspace(0.0, 1.0, len(COLOUR_STOPS))
    red, green, blue = (
        float(np.interp(fraction, stop_positions, [stop[channel] for stop in COLOUR_STOPS])) for channel in range(3)
    )
    return red, green, blue


def colour_numbers(pieces: Sequence[TriangleMesh], colours: int) -> list[int]:
    """A number of a colour for each piece: the one that fewest pieces near it have, of equals the least used."""
    lower = np.array([piece.vertices.min(axis=0) for piece in pieces])
    upper = np.array([piece.vertices.max(axis=0) for piece in pieces])
    touching_distance = 1e-3 * float(np.ptp(np.concatenate([lower, upper]), axis=0).max())
    colours_chosen: list[int] = []
    for number in range(len(pieces)):
        is_near = (
            (lower[:number] <= upper[number] + touching_distance)
            & (upper[:number] >= lower[number] - touching_distance)
        ).all(axis=1)
        colours_nearby: IntArray = np.bincount([colours_chosen[k] for k in np.flatnonzero(is_near)], minlength=colours)
        colours_used: IntArray = np.bincount(colours_chosen, minlength=colours)
        colours_chosen.append(
            min(range(colours), key=lambda colour: (colours_nearby[colour], colours_used[colour], colour))
        )
    return colours_chosen


def _picture(shapes: Sequence[Shape], outlined_meshes: Sequence[TriangleMesh], alternative_text: str) -> str:
    corners = np.concatenate([shape.corners for shape in shapes])
    view = View.of(corners.reshape(-1, 3), VIEW_DIRECTION, PICTURE_PIXELS)
    lines = [Lines(_sharp_edges(mesh), EDGE_COLOUR, 0.55) for mesh in outlined_meshes]
    picture, _ = draw_picture(view, shapes, [], lines, background(PICTURE_PIXELS))
    return render_template(
        "show/report/still.html",
        size=PICTURE_SIZE,
        description=alternative_text,
        picture=webp(picture),
        strokes="",
        middle=(0.0, 0.0),
        ring="",
        words=(),
        x=0,
    )


def _sharp_edges(mesh: TriangleMesh) -> FloatArray:
    """Edges (k, 2, 3) at which faces meet in a large angle."""
    edges, faces = edges_of(mesh)
    return edges[bend_cosines(face_normals(mesh.triangles)[1], faces) < np.cos(np.radians(SHARP_EDGE_DEG))]


def _size(mesh: TriangleMesh) -> float:
    return float(np.ptp(mesh.vertices, axis=0).max())


def _bytes(colour: Colour) -> tuple[int, int, int, int]:
    red, green, blue = (round(255 * channel) for channel in colour)
    return red, green, blue, 255
