"""One ``foxglove.SceneUpdate`` that draws the bodies in Foxglove; it never grows beyond a fixed size.

Shapes are triangle lists and not embedded GLB models: a triangle list lies in the frame of its entity as it is, while
viewers turn GLB models by an up-axis setting of their own.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from foxglove_schemas_protobuf.TriangleListPrimitive_pb2 import TriangleListPrimitive

from sessions.mcap.frame_codec import column_view, varint
from sessions.mcap.schemas import WORLD
from sessions.mesh_data import MeshData
from sessions.model.scene import Scene, SceneBody

# The attachments hold the exact meshes; the drawing may cost this many bytes (before compression) and no more. The
# bodies with the fewest faces are drawn; what is left of a larger recording is not.
DRAWING_BYTES = 8 << 20
_POINT = bytes([0x12, 27]) + b"".join(bytes([number << 3 | 1]) + bytes(8) for number in (1, 2, 3))
_GLASS, _SOLID, _PROXY = (0.75, 0.88, 0.95, 0.35), (0.62, 0.64, 0.67, 1.0), (0.62, 0.64, 0.67, 0.5)


def scene_update(meshes: Mapping[str, MeshData], scene: Scene, time_ns: int) -> bytes:
    """The payload of ``/scene``: one entity per body with a mesh, locked to the body's frame."""
    update, spent = SceneUpdate(), 0
    for name, mesh in sorted(meshes.items(), key=lambda item: len(item[1].faces)):
        spent += len(mesh.vertices) * len(_POINT) + mesh.faces.size * 4
        if spent > DRAWING_BYTES:
            break
        body = scene.body(name) or SceneBody(name)
        fixed = body.fixed
        entity = update.entities.add(id=name, frame_id=name if fixed is None else body.parent or WORLD)
        entity.timestamp.FromNanoseconds(time_ns)
        entity.frame_locked = True
        drawn = entity.triangles.add()
        drawn.MergeFrom(_triangle_list(mesh))
        position = body.offset if fixed is None else fixed
        for vector, axes, numbers in (
            (drawn.pose.position, "xyz", position.position),
            (drawn.pose.orientation, "xyzw", position.quaternion_xyzw),
            (drawn.color, "rgba", _PROXY if body.proxy else _GLASS if "glass" in body.tags else _SOLID),
        ):
            for axis, number in zip(axes, numbers, strict=True):
                setattr(vector, axis, number)
    return bytes(update.SerializeToString(deterministic=True))


def _triangle_list(mesh: MeshData) -> Any:
    """Points (field 2) and indices (field 5) written as a table of bytes; 50,000 message objects would take 0.1 s."""
    points = np.empty((len(mesh.vertices), len(_POINT)), dtype=np.uint8)
    points[:] = np.frombuffer(_POINT, dtype=np.uint8)
    for axis in range(3):
        column_view(points, 3 + 9 * axis)[:] = mesh.vertices[:, axis]
    indices = mesh.faces.astype("<u4").tobytes()
    return TriangleListPrimitive.FromString(points.tobytes() + b"\x2a" + varint(len(indices)) + indices)
