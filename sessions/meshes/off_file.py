"""Reads the surface of an OFF file: its vertices and its faces, in the order of the file.

Colours, normals and texture coordinates stand behind the numbers that are read, and are passed over.

Source: Geomview manual, *OFF Files*. Differs: each vertex and each face begins a line, as every program writes them.
"""

import re
from typing import Final

from sessions.errors import EmptyMeshError, MeshFileError
from sessions.meshes.mesh_text import ascii_text, numbers, quoted_word, whole_numbers
from sessions.meshes.polygons import PolygonMesh

KEYWORD: Final = re.compile(rb"(ST)?(C)?(N)?(4)?(n)?OFF")
"""Colours, normals and texture coordinates of vertices; ``4`` and ``n``: points that are not in space."""


def read_off(data: bytes) -> PolygonMesh:
    """Return the polygons of an OFF file.

    Raises ``MeshFileError``: more or fewer lines than the file declares, a word that is no number, points of four or n
    dimensions, the binary form.
    """
    lines = [tokens for line in ascii_text(data).splitlines() if (tokens := line.partition(b"#")[0].split())]
    counts = _counts(lines)
    vertex_count, face_count = counts
    declared = f"it declares {vertex_count:,} vertices and {face_count:,} faces"
    if len(lines) < vertex_count + face_count:
        raise MeshFileError(f"{declared} and holds {len(lines):,} lines of them: cut short; export it again")
    if len(lines) > vertex_count + face_count:
        raise MeshFileError(f"{declared} and holds {len(lines):,} lines; export it again")
    vertices, faces = lines[:vertex_count], lines[vertex_count:]
    if any(len(tokens) < 3 for tokens in vertices):
        raise MeshFileError("a vertex has fewer than three coordinates; export it again")
    sizes = whole_numbers(b" ".join([tokens[0] for tokens in faces]), "the start of a face")
    for tokens, size in zip(faces, sizes.tolist(), strict=True):
        if not 0 <= size < len(tokens):
            raise MeshFileError(f"a face of {size} corners has a line of {len(tokens)} numbers; export it again")
    corners = [word for tokens, size in zip(faces, sizes.tolist(), strict=True) for word in tokens[1 : size + 1]]
    points = numbers(b" ".join([word for tokens in vertices for word in tokens[:3]]), "a vertex")
    return PolygonMesh(points.reshape(-1, 3), whole_numbers(b" ".join(corners), "a face"), sizes)


def _counts(lines: list[list[bytes]]) -> tuple[int, int]:
    """How many vertices and faces are declared; takes the lines that say so off the start."""
    if not lines:
        raise EmptyMeshError("the file holds no triangle; export the surface as triangles")
    first = lines.pop(0)
    keyword = KEYWORD.match(first[0])
    if keyword is not None:
        if keyword[4] or keyword[5]:
            raise MeshFileError("its points are not in space (4OFF or nOFF); export it as OFF")
        rest = [word for word in (first[0][keyword.end() :], *first[1:]) if word]
        if rest[:1] == [b"BINARY"]:
            raise MeshFileError("it is a binary OFF; export it as text")
        first = rest or (lines.pop(0) if lines else [])
    if len(first) < 2:
        raise MeshFileError("it does not say how many vertices and faces it holds; export it again")
    if len(first) > 3 or not all(word.isdigit() for word in first):
        raise MeshFileError(f"it does not begin as an OFF but with {quoted_word(b' '.join(first))}; export it again")
    vertices, faces = whole_numbers(b" ".join(first[:2]), "the count of vertices and faces").tolist()
    return vertices, faces
