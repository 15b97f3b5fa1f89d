"""Reads the surface of a Wavefront OBJ: its vertices and its faces, in the order of the file.

Objects, groups, materials, textures and normals change nothing about where a surface is; they are passed over. Names
may be in any encoding, since all that is read is ASCII.

Source: Wavefront Technologies, *Object Files (.obj)*, appendix B1 of the Advanced Visualizer manual.
Differs: a backslash at the end of a line joins the next one only where numbers go on; behind a name or a comment it
is a letter of a path, as exporters on Windows write it.
"""

from array import array
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sessions.errors import MeshFileError
from sessions.meshes.mesh_text import ascii_text, numbers, whole_numbers
from sessions.meshes.polygons import PolygonMesh

Indices = NDArray[np.int64]

FACE_KEYWORDS: Final = frozenset({b"f", b"fo"})
"""``fo`` is how the second version of the format calls a face."""

OF_NUMBERS: Final = FACE_KEYWORDS | {b"v", b"vt", b"vn", b"vp", b"l", b"p"}
"""Statements of numbers alone."""

ELSEWHERE: Final = {
    b"surf": "it holds free-form surfaces (surf)",
    b"call": "it takes in another file (call)",
    b"csh": "it runs a command of a shell (csh)",
}
"""Statements of surface that a reader of polygons would lose -> what they are."""

BLOCK: Final = 1 << 18
"""Words that are kept before they become numbers: 15 MB."""


def read_obj(data: bytes) -> PolygonMesh:
    """Return the polygons of an OBJ file.

    Raises ``MeshFileError``: text of two bytes a letter, a word that is no number, a vertex of fewer than three
    coordinates, a corner 0 (they count from 1, or from -1 backwards), surfaces that are no polygons.
    """
    vertices = _Numbers(numbers, "a vertex")
    corners = _Numbers(whole_numbers, "a face")
    sizes, vertices_before = array("q"), array("q")
    lines = ascii_text(data).splitlines()
    for number, line in _joined_lines(lines) if b"\\" in data else enumerate(lines, start=1):
        tokens = (line.partition(b"#")[0] if b"#" in line else line).split()
        if not tokens:
            continue
        keyword = tokens[0]
        if keyword == b"v":
            if len(tokens) < 4:
                raise MeshFileError(f"line {number}: a vertex has three coordinates; export it again")
            vertices.add(tokens[1:4])
        elif keyword in FACE_KEYWORDS:
            corners.add([word.partition(b"/")[0] for word in tokens[1:]] if b"/" in line else tokens[1:])
            sizes.append(len(tokens) - 1)
            vertices_before.append(vertices.count // 3)
        elif keyword in ELSEWHERE:
            raise MeshFileError(f"{ELSEWHERE[keyword]}; export the surface as triangles")
    polygons = np.array(sizes, dtype=np.int64)
    indices = _from_zero(corners.array(), np.repeat(np.array(vertices_before, dtype=np.int64), polygons))
    return PolygonMesh(vertices.array().reshape(-1, 3), indices, polygons)


def _from_zero(corners: Indices, vertices_before: Indices) -> Indices:
    """Corners counted from 1, or from -1 backwards at the vertex before the face, counted from 0."""
    if (corners == 0).any():
        raise MeshFileError("a face names vertex 0; an OBJ counts from 1: export it again")
    backwards = corners < 0
    indices = np.where(backwards, vertices_before + corners, corners - 1)
    if (indices < 0).any():
        corner = int(corners[indices < 0][0])
        raise MeshFileError(f"a face names vertex {corner}, which is before the first; export it again")
    return indices


def _joined_lines(lines: Iterable[bytes]) -> Iterator[tuple[int, bytes]]:
    """The number of each line and the line, with those that it goes on in where it holds numbers alone."""
    numbered = enumerate(lines, start=1)
    for number, line in numbered:
        whole = line
        while whole.rstrip().endswith(b"\\") and whole.split(maxsplit=1)[0] in OF_NUMBERS:
            whole = whole.rstrip()[:-1] + b" " + next(numbered, (0, b""))[1]
        yield number, whole


class _Numbers:
    """Words of a file that become numbers a block at a time, so that a large file is never a list of words."""

    def __init__(self, parse: Callable[[bytes, str], NDArray[Any]], where: str) -> None:
        self._parse = parse
        self._where = where
        self._tokens: list[bytes] = []
        self._blocks: list[NDArray[Any]] = [parse(b"", where)]
        self._in_blocks = 0

    @property
    def count(self) -> int:
        """How many numbers there are."""
        return self._in_blocks + len(self._tokens)

    def add(self, tokens: Sequence[bytes]) -> None:
        """Take the numbers of a line."""
        self._tokens += tokens
        if len(self._tokens) > BLOCK:
            self._convert()

    def array(self) -> NDArray[Any]:
        """All numbers, (n,)."""
        self._convert()
        return np.concatenate(self._blocks)

    def _convert(self) -> None:
        if b"" in self._tokens:
            raise MeshFileError(f"{self._where} names a corner without a vertex; export it again")
        self._in_blocks += len(self._tokens)
        self._blocks.append(self._parse(b" ".join(self._tokens), self._where))
        self._tokens.clear()
