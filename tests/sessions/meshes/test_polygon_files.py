"""Prisms over planted polygons in every format of polygons: area, volume and order are those in closed form."""

from itertools import pairwise

import numpy as np
import pytest

from sessions.errors import MeshFileError
from sessions.mesh_data import has_consistent_winding
from sessions.meshes.mesh_files import mesh_from_bytes

HEIGHT = 0.5


def ring(count):
    """Corners of a regular polygon."""
    return [[np.cos(angle), np.sin(angle)] for angle in np.arange(count) * 2 * np.pi / count]


def star(points):
    """Radius 1 at its points and 0.3 between them."""
    radii = np.where(np.arange(2 * points) % 2, 0.3, 1.0)
    return [[radius * x, radius * y] for radius, (x, y) in zip(radii, ring(2 * points), strict=True)]


def comb(teeth):
    """The outline of a comb: a bar with teeth 2 wide and 3 high."""
    return [[4 * teeth - 2, -1], *([x, y] for t in range(teeth)[::-1] for x, y in tooth(4 * t)), [0, -1]]


def tooth(x):
    """Corners of a tooth of a comb."""
    return [[x + 2, 0], [x + 2, 3], [x, 3], [x, 0]]


def spiral(corners):
    """The outline of a band that winds one and a half times."""
    angles = np.linspace(0, 3 * np.pi, corners // 2)
    arms = [[[(r + angle) * np.cos(angle), (r + angle) * np.sin(angle)] for angle in angles] for r in (2, 1)]
    return arms[0] + arms[1][::-1]


HOLE = [[1, 1], [1, 2], [2, 2], [2, 1]]
TWO_HOLES = [
    [0, 0],
    *HOLE,
    [1, 1],
    [0, 0],
    [4, 0],
    [5, 1],
    [5, 2],
    [6, 2],
    [6, 1],
    [5, 1],
    [4, 0],
    [7, 0],
    [7, 3],
    [0, 3],
]
POLYGONS = {
    "triangle": ([[0, 0], [3, 0], [0, 2]], 3.0),
    "dart": ([[0, 0], [2, 3], [0, 1], [-2, 3]], 2.0),
    "square with corners on its edges": ([[0, 0], [1, 0], [2, 0], [2, 1], [2, 2], [1, 2], [0, 2], [0, 1]], 4.0),
    "L that winds to the right": ([[0, 2], [1, 2], [1, 1], [2, 1], [2, 0], [0, 0]], -3.0),
    "U": ([[0, 0], [4, 0], [4, 3], [3, 3], [3, 1], [1, 1], [1, 3], [0, 3]], 8.0),
    "regular 40": (ring(count=40), 20 * np.sin(2 * np.pi / 40)),
    "star of 24": (star(points=12), 12 * 0.3 * np.sin(np.pi / 12)),
    "comb of 38": (comb(teeth=9), 9 * 6.0 + 34.0),
    "spiral of 40": (spiral(corners=40), None),
    "square with a hole": ([[0, 0], *HOLE, [1, 1], [0, 0], [3, 0], [3, 3], [0, 3]], 8.0),
    "plate with two holes": (TWO_HOLES, 19.0),
    "T with corners in a row": (
        [[0, 0], [1, 0], [1, 1], [1, 2], [2, 2], [2, 3], [1, 3], [0, 3], [-1, 3], [-1, 2], [0, 2]],
        5.0,
    ),
}
"""Name -> corners of the outline, and its signed area where it is known beside the shoelace sum."""


def shoelace(outline):
    """The area of an outline, negative if it goes clockwise."""
    x, y = np.array(outline, dtype=np.float64).T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


AWAY = np.array([3.0, -5.0, 7.0])
"""No corner is near the origin, where sums and differences of corners are the same."""


def prism(outline, rotation):
    """Vertices, and polygons: floor, roof, and a wall an edge; outwards where the outline winds to the left."""
    count = len(outline)
    corners = np.array([[x, y, z] for z in (0.0, HEIGHT) for x, y in outline]) @ rotation.T + AWAY
    walls = [[k, (k + 1) % count, count + (k + 1) % count, count + k] for k in range(count)]
    return corners, [[*range(count)][::-1], [*range(count, 2 * count)], *walls]


def written_obj(vertices, polygons):
    """The bytes of an OBJ file with these polygons."""
    rows = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
    rows += ["f " + " ".join(f"{corner + 1}//{corner + 1}" for corner in polygon) for polygon in polygons]
    return "\n".join(["o Prüfung", *rows]).encode("latin-1")


def written_off(vertices, polygons):
    """The bytes of an OFF file with these polygons, each with a colour."""
    rows = [f"{x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
    rows += [" ".join(map(str, [len(polygon), *polygon])) + " 0.5 0.5 0.5" for polygon in polygons]
    return "\n".join(["OFF", f"{len(vertices)} {len(polygons)} 0", *rows]).encode()


def ply_header(layout, vertices, polygons):
    """The header of a PLY file, with properties that nobody needs."""
    lines = [
        "ply", f"format {layout} 1.0", f"element vertex {len(vertices)}",
        *(f"property double {axis}" for axis in "xyz"), "property uchar red", f"element face {len(polygons)}",
        "property uchar material", "property list uchar int vertex_indices", "property float quality", "end_header", "",
    ]  # fmt: skip
    return "\n".join(lines).encode()


def written_ply_text(vertices, polygons):
    """The bytes of a PLY file in text."""
    rows = [f"{x!r} {y!r} {z!r} 255" for x, y, z in vertices.tolist()]
    rows += [" ".join(map(str, [7, len(polygon), *polygon, 0.25])) for polygon in polygons]
    return ply_header("ascii", vertices, polygons) + "\n".join(rows).encode()


def written_ply_binary(order):
    """A writer of binary PLY files in an order of bytes."""

    def written(vertices, polygons):
        rows = [np.array([*v], order + "f8").tobytes() + b"\xff" for v in vertices.tolist()]
        for polygon in polygons:
            corners = np.array(polygon, order + "i4").tobytes()
            rows.append(bytes([7, len(polygon)]) + corners + np.array(0.25, order + "f4").tobytes())
        layout = {"<": "binary_little_endian", ">": "binary_big_endian"}[order]
        return ply_header(layout, vertices, polygons) + b"".join(rows)

    return written


FORMATS = {
    "obj": ("obj", written_obj),
    "off": ("off", written_off),
    "ply text": ("ply", written_ply_text),
    "ply little-endian": ("ply", written_ply_binary("<")),
    "ply big-endian": ("ply", written_ply_binary(">")),
}
VISIBLE_FROM = {
    "upright": np.eye(3),
    "tilted": np.linalg.qr(np.random.default_rng(1).standard_normal((3, 3)))[0],
}


VIEWS = [*VISIBLE_FROM]


@pytest.mark.sampled(3)
@pytest.mark.parametrize(
    ("name", "form", "view"),
    [(name, form, VIEWS[(k + m) % 2]) for k, name in enumerate(POLYGONS) for m, form in enumerate(FORMATS)],
)
def test_prism_area_volume_and_order_match_closed_form(name, form, view):
    """A prism of 0.5 m stands on an outline of POLYGONS, whose area is known; it is written as polygons in a format.

    The mesh has its volume, with the other sign in a view that is mirrored. The triangles of each polygon, in the order
    of the file, have its area: that of the outline, or of an edge times the height. None is without area.
    """
    outline, planted = POLYGONS[name]
    area = shoelace(outline)
    assert planted is None or area == pytest.approx(planted, rel=1e-12, abs=0)
    kind, written = FORMATS[form]
    rotation = VISIBLE_FROM[view]
    vertices, polygons = prism(outline, rotation)
    mesh = mesh_from_bytes(written(vertices, polygons), kind)
    assert np.array_equal(mesh.vertices, vertices + 0.0)
    handed = np.sign(np.linalg.det(rotation))
    assert mesh.volume * handed == pytest.approx(area * HEIGHT, rel=1e-12, abs=0)
    edges = np.linalg.norm(np.diff([*outline, outline[0]], axis=0), axis=1)
    cross = np.cross(mesh.triangles[:, 1] - mesh.triangles[:, 0], mesh.triangles[:, 2] - mesh.triangles[:, 0])
    areas = 0.5 * np.linalg.norm(cross, axis=1)
    expected = [abs(area), abs(area), *(HEIGHT * edges)]
    starts = np.cumsum([0, *(len(polygon) - 2 for polygon in polygons)])
    assert len(mesh.faces) == starts[-1] and areas.min() > 1e-9
    for polygon, start, end, planted_area in zip(polygons, starts, starts[1:], expected, strict=False):
        assert {*mesh.faces[start:end].ravel().tolist()} == {*polygon}
        assert areas[start:end].sum() == pytest.approx(planted_area, rel=1e-12, abs=0)
    assert has_consistent_winding(mesh)


@pytest.mark.parametrize("form", FORMATS)
def test_polygons_of_every_size_keep_their_order_among_each_other(form):
    """A file has all outlines of POLYGONS as flat polygons, at heights 0, 1, 2 ... in the order of the file.

    An outline of n corners gives n - 2 triangles, all at its height, and before those of the next.
    """
    random = np.random.default_rng(3)
    outlines = [np.array(POLYGONS[name][0], dtype=float) for name in random.permutation([*POLYGONS])]
    vertices = np.concatenate([np.c_[outline, np.full(len(outline), k)] for k, outline in enumerate(outlines)])
    starts = np.cumsum([0, *map(len, outlines)])
    polygons = [[*range(a, b)] for a, b in pairwise(starts)]
    kind, written = FORMATS[form]
    mesh = mesh_from_bytes(written(vertices, polygons), kind)
    heights_of_corners = mesh.vertices[mesh.faces, 2]
    heights = heights_of_corners[:, 0]
    assert (heights_of_corners == heights[:, None]).all()
    assert (np.diff(heights) >= 0).all()
    assert np.bincount(heights.astype(int)).tolist() == [len(outline) - 2 for outline in outlines]


@pytest.mark.parametrize("form", FORMATS)
def test_a_file_cut_anywhere_is_refused_or_is_obj(form):
    """An OBJ declares no counts: its lines before the cut are a mesh of fewer faces.

    A prism is written and cut after every seventh byte. A text is not cut in its last line: a number that lost digits
    there is a number still.
    """
    kind, written = FORMATS[form]
    u_shape, _ = POLYGONS["U"]
    data = written(*prism(u_shape, rotation=np.eye(3)))
    whole = len(mesh_from_bytes(data, kind).faces)
    is_binary = form.endswith("-endian")
    last_cut = len(data) - 3 if is_binary else data.rindex(b"\n")
    for end in range(3, last_cut, 7):
        try:
            mesh = mesh_from_bytes(data[:end], kind)
        except MeshFileError:
            continue
        assert kind == "obj", end
        assert len(mesh.faces) <= whole, end
