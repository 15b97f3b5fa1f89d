"""An STL file as trimesh reads it for certain: whole, and in text without the names of its solids.

trimesh (5.2) looks for ``solid``, ``vertex`` and ``normal`` anywhere, so also in a name, passes over a solid that does
not end, and needs a package that is not installed here for text that is not UTF-8.

Source: M. Burns, *Automated Fabrication* (1993), section 6.5.
"""

import struct
from typing import Final

from sessions.errors import MeshFileError
from sessions.meshes.mesh_text import ascii_text, numbers

HEADER_BYTES: Final = 84
TRIANGLE_BYTES: Final = 50
CORNER_LINES: Final = {b"facet": 1, b"endfacet": 1, b"vertex": 3}
"""Keyword -> how often it stands in a triangle."""


def plain_stl(data: bytes) -> bytes:
    """Return the bytes of a binary STL as they are, of one in text with plain names; ``MeshFileError``: it is cut."""
    count = struct.unpack_from("<I", data, HEADER_BYTES - 4)[0] if len(data) >= HEADER_BYTES else 0
    size = HEADER_BYTES + TRIANGLE_BYTES * count
    if len(data) >= HEADER_BYTES and len(data) == size:
        return data
    text = ascii_text(data)
    if text.lstrip()[:5].lower() != b"solid" or b"\0" in text:
        if len(data) < HEADER_BYTES:
            raise MeshFileError("it does not begin as an STL; export it again")
        holds = f"it declares {count:,} triangles, which take {size:,} bytes, and holds {len(data):,}"
        raise MeshFileError(f"{holds}{': cut short' if len(data) < size else ''}; export it again")
    return _with_plain_names(text)


def _with_plain_names(text: bytes) -> bytes:
    lines: list[bytes] = []
    corners: list[bytes] = []
    counts = dict.fromkeys((b"solid", b"endsolid", *CORNER_LINES), 0)
    for line in text.splitlines():
        tokens = line.split()
        keyword = tokens[0].lower() if tokens else b""
        if keyword in counts:
            counts[keyword] += 1
        if keyword in (b"solid", b"endsolid"):
            lines.append(keyword)
        elif keyword == b"vertex":
            if len(tokens) != 4:
                raise MeshFileError(f"a vertex has {len(tokens) - 1} coordinates instead of three; export it again")
            lines.append(b" ".join(tokens))
            corners += tokens[1:]
    numbers(b" ".join(corners), "a vertex")
    facets = counts[b"facet"]
    if any(counts[keyword] != times * facets for keyword, times in CORNER_LINES.items()):
        counted = f"{facets:,} facets begin, {counts[b'endfacet']:,} end, with {counts[b'vertex']:,} corners"
        raise MeshFileError(f"it is cut short or damaged: {counted}; export it again")
    if counts[b"solid"] != counts[b"endsolid"]:
        raise MeshFileError("it is cut short: its last solid does not end; export it again")
    return b"\n".join([*lines, b""])
