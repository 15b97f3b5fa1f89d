"""Reads the surface of a PLY file, text or binary: its vertices and its faces, in the order of the file.

Whatever else a file holds is passed over by the sizes that its header declares. Triangle strips become triangles.

Source: G. Turk, *The PLY Polygon File Format* (1994).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from sessions.errors import MeshFileError
from sessions.meshes.mesh_text import ascii_text, quoted_word
from sessions.meshes.ply_body import BinaryBody, Body, Element, Indices, Property, TextBody
from sessions.meshes.polygons import PolygonMesh

KINDS: Final = {
    "char": "i1",
    "uchar": "u1",
    "short": "i2",
    "ushort": "u2",
    "int": "i4",
    "uint": "u4",
    "float": "f4",
    "double": "f8",
    "int8": "i1",
    "uint8": "u1",
    "int16": "i2",
    "uint16": "u2",
    "int32": "i4",
    "uint32": "u4",
    "float32": "f4",
    "float64": "f8",
    "int64": "i8",
    "uint64": "u8",
}
"""Name of a type, old and new -> the NumPy type without byte order."""

FORMATS: Final = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
INDICES: Final = ("vertex_indices", "vertex_index")
"""Names of the list of corners: the specification uses both."""

MOST_PROPERTIES: Final = 1_000
RESTART: Final = -1
"""Ends a triangle strip within a list."""


Surface = tuple[Indices, Indices]
"""Corners of each polygon, and the corners of all."""


@dataclass
class Header:
    """The declarations of a header; ``order``: byte order, ``""`` for text; ``size``: bytes of the header."""

    order: str = ""
    elements: list[Element] = field(default_factory=list)
    size: int = 0


def read_ply(data: bytes) -> PolygonMesh:
    """Return the polygons of a PLY file.

    Raises ``MeshFileError``: a header that cannot be followed, fewer or more numbers than it declares, a list of
    negative length, corners that are no whole numbers, text of two bytes a letter.
    """
    data = ascii_text(data)
    header = read_header(data)
    body: Body = BinaryBody(data, header.size, header.order) if header.order else TextBody(data[header.size :])
    vertices = np.zeros((0, 3))
    surfaces: list[Surface] = []
    for element in header.elements:
        columns = body.read(element)
        if element.name == "vertex":
            if not {"x", "y", "z"} <= columns.scalars.keys():
                raise MeshFileError("its vertices have no x, y and z; export it again")
            vertices = np.stack([columns.scalars[axis].astype(np.float64) for axis in "xyz"], axis=1)
        elif element.name in SURFACES:
            name = next((name for name in INDICES if name in columns.lists), None)
            if name is None and element.count:
                raise MeshFileError(f"its element {element.name} has no list {INDICES[0]}; export it again")
            if name is not None:
                sizes, corners = columns.lists[name]
                if corners.dtype.kind != "i":
                    raise MeshFileError(f"its {name} are no whole numbers; export it again")
                surfaces.append(SURFACES[element.name](sizes, corners))
    body.check_end()
    none = np.zeros(0, dtype=np.int64)
    all_sizes = np.concatenate([none, *(sizes for sizes, _ in surfaces)])
    all_corners = np.concatenate([none, *(corners for _, corners in surfaces)])
    return PolygonMesh(vertices, all_corners, all_sizes)


def read_header(data: bytes) -> Header:
    """Return what the header of a PLY declares; ``MeshFileError`` for what no PLY says."""
    header = Header()
    has_format = False
    for tokens, end in _header_lines(data):
        match tokens:
            case [] | ["comment", *_] | ["obj_info", *_]:
                pass
            case ["end_header"]:
                header.size = end
            case ["format", name, *_] if name in FORMATS and not has_format:
                header.order, has_format = FORMATS[name], True
            case ["element", name, count] if count.isdecimal() and len(count) < 19:
                header.elements.append(Element(name, int(count)))
            case ["property", *kinds, name] if header.elements and KINDS.keys() >= {*kinds} - {"list"}:
                header.elements[-1].properties.append(_property(kinds, name))
            case _:
                raise _unknown(tokens)
    names = [element.name for element in header.elements]
    if not has_format or len(names) != len(set(names)):
        raise MeshFileError("its header names no format, or an element twice; export it again")
    if sum(len(element.properties) for element in header.elements) > MOST_PROPERTIES:
        raise MeshFileError(f"its header declares more than {MOST_PROPERTIES:,} properties; export it again")
    return header


def _header_lines(data: bytes) -> Iterator[tuple[list[str], int]]:
    """Words of each line of the header, and where the next one starts; lines end as the first does."""
    newline = next((end for end in (b"\r\n", b"\n", b"\r") if data.startswith(b"ply" + end)), b"\n")
    tokens, start = data[: data.find(newline)][:80].decode("latin-1").split(), 0
    if tokens != ["ply"]:
        raise MeshFileError("it does not begin as a PLY; export it again")
    while tokens != ["end_header"]:
        start = data.find(newline, start) + len(newline)
        end = data.find(newline, start)
        tokens = data[start : end if end >= 0 else len(data)].decode("latin-1").split()
        if end < 0 and tokens != ["end_header"]:
            raise MeshFileError("its header does not end: cut short; export it again")
        yield tokens, end + len(newline) if end >= 0 else len(data)


def _property(kinds: Sequence[str], name: str) -> Property:
    match kinds:
        case ["list", count, item] if not KINDS[count].startswith("f"):
            return Property(name, KINDS[item], KINDS[count])
        case [kind] if kind != "list":
            return Property(name, KINDS[kind])
        case _:
            raise _unknown(["property", *kinds, name])


def _unknown(tokens: Sequence[str]) -> MeshFileError:
    return MeshFileError(f"its header says {quoted_word(' '.join(tokens).encode('latin-1'))}; export it again")


def _polygons(sizes: Indices, corners: Indices) -> Surface:
    return sizes, corners


def _strips(sizes: Indices, corners: Indices) -> Surface:
    """Triangles of strips: corner k and the two behind it, every other one turned round; -1 begins a new strip.

    Where a strip goes back over a corner, to join two of them without a break, there is no surface and no triangle.
    """
    if not len(corners):
        return sizes[:0], corners
    begins = np.zeros(len(corners) + 1, dtype=bool)
    begins[np.cumsum(sizes) - sizes] = True
    begins[1:] |= corners == RESTART
    positions = np.arange(len(corners))
    starts = np.maximum.accumulate(np.where(begins[:-1], positions + (corners == RESTART), 0))
    third = positions[positions - starts >= 2]
    third = third[corners[third] != RESTART]
    is_odd = (third - starts[third]) % 2 == 1
    first, second = third - 2 + is_odd, third - 1 - is_odd
    triangles = corners[np.stack([first, second, third], axis=1)]
    triangles = triangles[(triangles != np.roll(triangles, 1, axis=1)).all(axis=1)]
    return np.full(len(triangles), 3, dtype=np.int64), triangles.reshape(-1)


SURFACES: Final = {"face": _polygons, "tristrips": _strips}
"""Element -> the polygons of its lists of corners."""
