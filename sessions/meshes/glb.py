"""The GLB that a session file carries: any viewer draws it, and read again it is the same mesh bit for bit."""

import json
import struct
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sessions.mesh_data import MeshData
from sessions.meshes.glb_tree import EXACT

_GLB_MAGIC, _GLB_JSON, _GLB_BINARY = 0x46546C67, 0x4E4F534A, 0x004E4942
_FLOAT32, _UINT32, _ARRAY_BUFFER, _ELEMENT_ARRAY_BUFFER, _TRIANGLES = 5126, 5125, 34962, 34963, 4
_GENERATOR = "vrlab-replay"
_Block = tuple[NDArray[Any], int | None]


def mesh_to_glb(mesh: MeshData, name: str) -> bytes:
    """Return the mesh as a binary glTF 2.0 file with one node ``name``; equal meshes and names give equal bytes.

    Positions are float32, as glTF demands. Where that loses bits, a second buffer view holds them in float64, and the
    primitive's ``extras`` name it: viewers ignore it, `read_glb` reads it, so no mesh changes on its way through
    a file. There are no normals: a viewer then shades each face flat, as the format says.

    Source: Khronos glTF 2.0 specification, sections 3.7 (meshes) and 4.4 (GLB container).
    """
    return meshes_to_glb({name: mesh})


def meshes_to_glb(meshes: Mapping[str, MeshData]) -> bytes:
    """Return several meshes as one binary glTF 2.0 file, a node of its name each; see `mesh_to_glb`."""
    blocks: list[_Block] = []
    accessors: list[dict[str, Any]] = []
    drawn: list[dict[str, Any]] = []
    for name, mesh in meshes.items():
        positions = mesh.vertices.astype("<f4")
        indices = mesh.faces.astype("<u4")
        primitive: dict[str, Any] = {
            "attributes": {"POSITION": len(accessors)},
            "indices": len(accessors) + 1,
            "mode": _TRIANGLES,
        }
        accessors += [
            {
                "bufferView": len(blocks),
                "componentType": _FLOAT32,
                "count": len(positions),
                "type": "VEC3",
                "min": positions.min(axis=0).tolist(),
                "max": positions.max(axis=0).tolist(),
            },
            {"bufferView": len(blocks) + 1, "componentType": _UINT32, "count": indices.size, "type": "SCALAR"},
        ]
        blocks += [(positions, _ARRAY_BUFFER), (indices, _ELEMENT_ARRAY_BUFFER)]
        if not np.array_equal(positions.astype(np.float64), mesh.vertices):
            primitive["extras"] = {EXACT: len(blocks)}
            blocks.append((mesh.vertices.astype("<f8"), None))
        drawn.append({"name": name, "primitives": [primitive]})
    tree = {
        "asset": {"version": "2.0", "generator": _GENERATOR},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(drawn)))}],
        "nodes": [{"name": name, "mesh": number} for number, name in enumerate(meshes)],
        "meshes": drawn,
        "accessors": accessors,
        "bufferViews": _buffer_views(blocks),
        "buffers": [{"byteLength": sum(array.nbytes for array, _ in blocks)}],
    }
    binary = b"".join(array.tobytes() for array, _ in blocks)
    text = json.dumps(tree, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), _GLB_JSON) + text + struct.pack("<II", len(binary), _GLB_BINARY) + binary
    return struct.pack("<III", _GLB_MAGIC, 2, 12 + len(chunks)) + chunks


def _buffer_views(blocks: list[_Block]) -> list[dict[str, int]]:
    views, start = [], 0
    for array, target in blocks:
        view = {"buffer": 0, "byteOffset": start, "byteLength": array.nbytes}
        views.append(view | ({"target": target} if target is not None else {}))
        start += array.nbytes
    return views
