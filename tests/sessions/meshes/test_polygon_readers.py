"""OBJ, PLY and OFF files of other programs besides the plain case, and what none of them may say."""

import re
import struct
import tracemalloc
from itertools import pairwise

import numpy as np
import pytest

from sessions.errors import MeshFileError
from sessions.meshes import obj_file
from sessions.meshes.mesh_files import mesh_from_bytes

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
PLY = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
PLY_ROWS = "0 0 0\n1 0 0\n0 1 0\n"
FACES = "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
OFF = "OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n"

READ = {
    "a byte order mark": ("obj", b"\xef\xbb\xbf" + SQUARE.encode() + b"f 1 2 3", [[0, 1, 2]]),
    "lines of an old Mac": ("obj", (SQUARE + "f 1 2 3").replace("\n", "\r").encode(), [[0, 1, 2]]),
    "a name in Latin-1 that holds a break of Unicode": (
        "obj",
        SQUARE.encode() + b"o \xc3\x85\x85f 1\nf 1 2 3",
        [[0, 1, 2]],
    ),
    "texture and normal": (
        "obj",
        SQUARE + "vt 0 0\nvn 0 0 1\nf 1/1 2/1 3/1\nf 1//1 2//1 3//1\nf 1/1/1 3/1/1 4/1/1",
        [[0, 1, 2], [0, 1, 2], [0, 2, 3]],
    ),
    "corners from the end, of the vertices before": (
        "obj",
        SQUARE + "f -4 -3 -2\nv 9 9 9\nf -5 -4 -3",
        [[0, 1, 2]] * 2,
    ),
    "objects, groups and materials": (
        "obj",
        "o a\ng b\n" + SQUARE + "usemtl x\ns 1\nf 1 2 3\no c\nf 1 3 4",
        [[0, 1, 2], [0, 2, 3]],
    ),
    "colours and weights": ("obj", "v 0 0 0 1 0 0\nv 1 0 0 1.0\nv 1 1 0\nf 1 2 3", [[0, 1, 2]]),
    "a face that goes on": ("obj", SQUARE + "f 1 \\\n 2 \\  \r\n 3 # end", [[0, 1, 2]]),
    "a path that ends in a backslash": ("obj", "# C:\\models\\\n" + SQUARE + "mtllib C:\\a\\\nf 1 2 3", [[0, 1, 2]]),
    "points and lines": ("obj", SQUARE + "p 1\nl 1 2\nf 1 2\nf 1 2 3", [[0, 1, 2]]),
    "a triangle as a quad": (
        "obj",
        SQUARE + "f 1 2 3 3\nf 1 1 2 3\nf 1 2 2 3",
        [[0, 1, 2], [0, 2, 2], [0, 0, 1], [0, 1, 2], [0, 1, 1], [0, 1, 2]],
    ),
    "a face with a spike back along its edge": (
        "obj",
        SQUARE + "v 0.5 0.5 0\nf 1 2 4 5",
        [[4, 0, 1], [1, 3, 4]],
    ),
    "counts beside the keyword": ("off", "OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2", [[0, 1, 2]]),
    "no keyword": ("off", "3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2", [[0, 1, 2]]),
    "colours, normals and remarks": (
        "off",
        "# by hand\nCNOFF # c\n3 1 # n\n\n0 0 0 1 0 0 0 0 1 1\n1 0 0 1 0 0 0 0 1 1\n"
        "0 1 0 1 0 0 0 0 1 1\n3 0 1 2 255 0 0",
        [[0, 1, 2]],
    ),
    "faces of one and two corners": (
        "off",
        OFF.replace("4 1", "4 3") + "1 0\n2 0 1\n4 0 1 2 3",
        [[0, 1, 2], [0, 2, 3]],
    ),
    "the other name of the list": ("ply", PLY + FACES.replace("indices", "index") + PLY_ROWS + "3 0 1 2", [[0, 1, 2]]),
    "remarks and Windows lines": (
        "ply",
        (PLY.replace("1.0\n", "1.0\ncomment ä end_header\nobj_info x\n") + FACES + PLY_ROWS + "3 0 1 2")
        .replace("\n", "\r\n")
        .encode("latin-1"),
        [[0, 1, 2]],
    ),
    "faces before vertices": (
        "ply",
        "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\n"
        + PLY[PLY.index("element") :]
        + "end_header\n3 0 1 2\n"
        + PLY_ROWS,
        [[0, 1, 2]],
    ),
    "an element of something else": (
        "ply",
        PLY
        + "element edge 2\nproperty int a\nproperty list int float w\n"
        + FACES
        + PLY_ROWS
        + "5 1 0.5\n6 0\n3 0 1 2",
        [[0, 1, 2]],
    ),
    "an element without rows before fractions": (
        "ply",
        "ply\nformat ascii 1.0\nelement edge 0\nproperty list int float w\n"
        + PLY[PLY.index("element") :]
        + FACES
        + PLY_ROWS.replace("0 0 0", "0.5 0 0")
        + "3 0 1 2",
        [[0, 1, 2]],
    ),
    "strips": (
        "ply",
        PLY.replace("vertex 3", "vertex 6") + "element tristrips 2\nproperty list int int vertex_indices\n"
        "end_header\n" + PLY_ROWS + "1 1 0\n0 2 0\n1 2 0\n4 0 1 2 3\n8 0 1 2 -1 2 3 4 5",
        [[0, 1, 2], [2, 1, 3], [0, 1, 2], [2, 3, 4], [4, 3, 5]],
    ),
    "a strip that goes back over a corner": (
        "ply",
        PLY + "element tristrips 1\nproperty list int int vertex_indices\nend_header\n" + PLY_ROWS + "5 0 1 1 2 0",
        [[1, 2, 0]],
    ),
}


def test_faces_are_read_from_mesh_files_of_several_programs():
    """A row of READ has a type of file, its text as a program exports it, and the triangles that it describes."""
    for name, (kind, text, faces) in READ.items():
        mesh = mesh_from_bytes(text if isinstance(text, bytes) else text.encode("latin-1"), kind)
        assert mesh.faces.tolist() == faces, name


def test_corners_from_the_end_count_vertices_of_all_blocks(monkeypatch):
    """An OBJ is read in blocks, here of 6 words, so that vertices of several blocks stand before a face.

    Its corners -4, -3, -2 count back from the vertices before it, of which more come behind.
    """
    monkeypatch.setattr(obj_file, "BLOCK", 6)
    mesh = mesh_from_bytes(f"{SQUARE}f -4 -3 -2\nv 9 9 9\nf -5 -4 -3".encode(), "obj")
    assert mesh.faces.tolist() == [[0, 1, 2], [0, 1, 2]]


def binary_ply(order, rows):
    """A binary PLY of five vertices and these polygons, with properties that no reader needs between them.

    Vertex k has x = 0.1 k, y = -0.1 k and z = k.
    """
    layout = {"<": "little", ">": "big"}[order]
    header = (
        f"ply\nformat binary_{layout}_endian 1.0\nelement vertex 5\nproperty short z\nproperty list ushort uchar tags\n"
        f"property float x\nproperty double y\nelement face {len(rows)}\nproperty uchar flag\n"
        "property list uchar uint vertex_indices\nproperty list char float texcoord\nproperty short last\nend_header\n"
    )
    body = b"".join(
        struct.pack(f"{order}hH{k}Bfd", k, k, *[9] * k, 0.1 * k, -0.1 * k) for k in range(5)
    )  # a list of another length in each row
    for row in rows:
        texture = [0.5] * (2 * len(row) if len(row) > 3 else 0)
        body += struct.pack(f"{order}BB{len(row)}Ib{len(texture)}fh", 1, len(row), *row, len(texture), *texture, -1)
    return header.encode() + body


@pytest.mark.parametrize("order", ["<", ">"])
def test_binary_rows_of_different_lengths_are_read_in_order(order):
    """Each row of vertices and of polygons has another length; x is a float and y a double.

    A polygon of n corners becomes n - 2 triangles, which have its corners.
    """
    polygons = [[0, 1, 2], [1, 2, 3, 4], [2, 3, 4], [4, 3, 2], [0, 1, 2, 3]]
    mesh = mesh_from_bytes(binary_ply(order, polygons), "ply")
    assert mesh.vertices[:, 0].tolist() == [float(np.float32(0.1 * k)) for k in range(5)]
    assert mesh.vertices[:, 1:].tolist() == [[-0.1 * k + 0.0, k] for k in range(5)]
    corners = [{*face} for face in mesh.faces.tolist()]
    first_triangles = np.cumsum([0, *(len(polygon) - 2 for polygon in polygons)])
    corners_of_polygons = [set.union(*corners[start:end]) for start, end in pairwise(first_triangles)]
    assert corners_of_polygons == [{*polygon} for polygon in polygons]


@pytest.mark.parametrize("order", ["<", ">"])
def test_a_binary_body_of_another_length_is_refused(order):
    """The file is cut after every byte of its body, and then is two bytes longer."""
    data = binary_ply(order, [[0, 1, 2], [1, 2, 3, 4]])
    start = data.index(b"end_header\n") + 11
    for end in range(start, len(data)):
        with pytest.raises(MeshFileError, match="cut short"):
            mesh_from_bytes(data[:end], "ply")
    with pytest.raises(MeshFileError, match="holds 2 bytes more than its header declares"):
        mesh_from_bytes(data + b"\0\0", "ply")


REFUSED = {
    "UTF-16": ("obj", (SQUARE + "f 1 2 3").encode("utf-16"), "it is text in UTF-16, no OBJ; save it as UTF-8"),
    "UTF-16 without a mark": ("off", (OFF + "3 0 1 2").encode("utf-16-be"), "its text is in UTF-16"),
    "UTF-32": ("ply", (PLY + FACES).encode("utf-32"), "it is text in UTF-32, no PLY"),
    "UTF-16 in an STL": ("stl", "solid a\nfacet".encode("utf-16"), "it is text in UTF-16, no STL"),
    "a decimal comma": ("obj", "v 0,5 0 0\n" * 3 + "f 1 2 3", "a vertex holds '0,5', which is no number"),
    "digits in groups": ("obj", "v 1_0 0 0\n" * 3 + "f 1 2 3", "a vertex holds '1_0', which is no number"),
    "two numbers without a blank": (
        "obj",
        "v 1.5.5 0 0\n" * 3 + "f 1 2 3",
        "a vertex holds '1.5.5', which is no number",
    ),
    "a sign between digits": ("off", OFF + "3 0 1-2 2", "a face holds '1-2', which is no whole number"),
    "a sign alone": ("off", OFF + "3 - 1 2", "a face holds '-', which is no whole number"),
    "a sign before a blank": ("ply", PLY + FACES + PLY_ROWS.replace("1 0 0", "- 1 0 0") + "3 0 1 2", "body holds '-'"),
    "half a corner in text": (
        "ply",
        PLY + FACES.replace("face 1", "face 2") + PLY_ROWS + "3 0 1 1.5\n4 0 1 2 0",
        "no whole",
    ),
    "a corner that is not named": ("obj", SQUARE + "f 1/1 /2 3/1", "a face names a corner without a vertex"),
    "text in an STL": (
        "stl",
        "solid a\nfacet\nvertex 0 0 zero\nvertex 1 0 0\nvertex 0 1 0\nendfacet\nendsolid",
        "a vertex holds 'zero', which is no number",
    ),
    "a flat STL": (
        "stl",
        "solid a\nfacet\nvertex 0 0\nvertex 1 0\nvertex 0 1\nendfacet\nendsolid",
        "2 coordinates instead",
    ),
    "a GLB of one word": ("glb", b"glTF\2\0", "cut short"),
    "two coordinates": ("obj", SQUARE + "v 1 2\nf 1 2 3", "line 5: a vertex has three coordinates"),
    "corner 0": ("obj", SQUARE + "f 0 1 2", "names vertex 0; an OBJ counts from 1"),
    "a corner before the first": ("obj", SQUARE + "f -5 1 2", "names vertex -5, which is before the first"),
    "a corner that comes never": ("obj", SQUARE + "f 1 2 3\nf 1 2 9", "face 1 of the file.* names vertex 8"),
    "half a corner": ("obj", SQUARE + "f 1 2 2.5", "a face holds '2.5', which is no whole number"),
    "no number beyond the limits": ("obj", SQUARE + "f 1 2 99999999999999999999", "of a mesh with 4 vertices"),
    "a free-form surface": ("obj", SQUARE + "f 1 2 3\nsurf 0 1 0 1 1 2 3 4", "free-form surfaces"),
    "no vertex": ("obj", "f 1 2 3", "faces and no vertex"),
    "infinity": ("obj", SQUARE.replace("1 1 0", "inf 1 0") + "f 1 2 3", "must be finite"),
    "fewer faces": (
        "off",
        OFF.replace("4 1", "4 12") + "3 0 1 2",
        "declares 4 vertices and 12 faces and holds 5 lines",
    ),
    "more faces": ("off", OFF + "3 0 1 2\n3 0 1 2", "declares 4 vertices and 1 faces and holds 6 lines"),
    "a face of fewer corners": ("off", OFF + "4 0 1 2", "a face of 4 corners has a line of 4 numbers"),
    "a negative face": ("off", OFF + "-1 0 1 2", "a face of -1 corners"),
    "points of four dimensions": ("off", OFF.replace("OFF", "4OFF"), "not in space"),
    "the binary form": ("off", "OFF BINARY\n\0\0\0\4", "binary OFF"),
    "another text": ("off", "solid cup\n", "does not begin as an OFF but with 'solid cup'"),
    "endless vertices": ("off", "OFF\n999999999999 1 0\n0 0 0", "cut short"),
    "no PLY": ("ply", "plywood\n", "does not begin as a PLY"),
    "a header without end": ("ply", PLY, "its header does not end"),
    "an unknown type": ("ply", PLY + "property half w\n" + FACES + PLY_ROWS, "its header says 'property half w'"),
    "a list counted in fractions": ("ply", PLY + "property list float int w\n" + FACES, "property list float int w"),
    "no format": ("ply", PLY.replace("format ascii 1.0\n", "") + FACES, "names no format"),
    "an element twice": ("ply", PLY + FACES.replace("face", "vertex"), "an element twice"),
    "no places": ("ply", PLY.replace("property float z\n", "") + FACES + "0 0\n0 1\n1 0\n3 0 1 2", "no x, y and z"),
    "no corners": (
        "ply",
        PLY + FACES.replace("vertex_indices", "corners") + PLY_ROWS + "3 0 1 2",
        "no list vertex_indices",
    ),
    "fewer numbers": (
        "ply",
        PLY + FACES.replace("face 1", "face 2") + PLY_ROWS + "3 0 1 2",
        "declares 2 of face and ends",
    ),
    "more numbers": ("ply", PLY + FACES + PLY_ROWS + "3 0 1 2 3", "holds 1 numbers more than its header declares"),
    "a negative list": ("ply", PLY + FACES.replace("uchar", "char") + PLY_ROWS + "-3 0 1 2", "a list of -3 numbers"),
    "endless faces": (
        "ply",
        PLY + FACES.replace("face 1", "face 999999999999999999") + PLY_ROWS + "3 0 1 2",
        "cut short",
    ),
    "a list of all memory": (
        "ply",
        (PLY.replace("ascii", "binary_little_endian") + FACES.replace("uchar", "uint")).encode()
        + bytes(36)
        + b"\xff\xff\xff\xff"
        + bytes(12),
        "declares 1 of face and ends after 0: cut short",
    ),
    "an element of no properties": (
        "ply",
        PLY + "element ghost 999999999999999999\n" + FACES + PLY_ROWS + "3 0 1 9",
        "names vertex 9",
    ),
    "a binary STL that is cut": (
        "stl",
        b"solid by a program" + bytes(62) + struct.pack("<I", 2) + bytes(50),
        "declares 2 triangles, which take 184 bytes, and holds 134: cut short",
    ),
    "a text STL that is cut": (
        "stl",
        "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n",
        "cut short",
    ),
    "a second solid that is cut": (
        "stl",
        ("solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n") * 2,
        "cut short: its last solid does not end",
    ),
}


def refusal(data, file_type):
    """The sentence with which a mesh file is refused, or nothing."""
    try:
        mesh_from_bytes(data, file_type)
    except MeshFileError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("file_type", sorted({kind for kind, _content, _reason in REFUSED.values()}))
def test_ambiguous_meshes_are_refused_in_a_sentence_with_little_memory(file_type):
    """A row of REFUSED has a type of file, its content and words of the error; all of a type take less than 30 MB."""
    rows = {name: row for name, row in REFUSED.items() if row[0] == file_type}
    tracemalloc.start()
    for name, (_type, text, reported) in rows.items():
        data = text if isinstance(text, bytes) else text.encode()
        message = refusal(data, file_type)
        assert re.search(reported, message), (name, message)
        assert message.isprintable(), name
    _now, peak_bytes = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak_bytes < 30e6


def test_polygons_with_too_many_corners_are_refused_at_once():
    """A star of 10,100 corners is one face, which is not convex; faces of more than 10,000 take long to cut."""
    corners = np.arange(10_100)
    angles = corners * 2 * np.pi / len(corners)
    radii = np.where(corners % 2, 0.5, 1.0)
    rows = [f"v {x!r} {y!r} 0" for x, y in np.c_[radii * np.cos(angles), radii * np.sin(angles)].tolist()]
    text = "\n".join([*rows, "f " + " ".join(map(str, (corners + 1).tolist()))])
    with pytest.raises(MeshFileError, match="concave faces of 10,100 corners; export the surface as triangles"):
        mesh_from_bytes(text.encode(), "obj")


def test_latin_1_or_keyword_name_changes_no_stl():
    """An STL has two solids of a triangle each, up to the heights 0 and 1, whose names are in Latin-1 or are keywords.

    Both triangles are read, whatever the name.
    """
    facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 {}\nendloop\nendfacet\n"
    for name in ("Gefäß", "facet of vertex 3 normal", "solid endsolid", ""):
        text = "".join(f"solid {name}\n{facet.format(z)}endsolid {name}\n" for z in (0, 1))
        mesh = mesh_from_bytes(b"\xef\xbb\xbf" + text.encode("latin-1"), "stl")
        assert mesh.triangles[:, 2, 2].tolist() == [0, 1], name
