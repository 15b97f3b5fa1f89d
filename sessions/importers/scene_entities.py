"""Entities of foxglove's SceneUpdate: each is a body; its shape becomes the body's mesh.

Source: Foxglove schemas (SceneEntity and its primitives), https://docs.foxglove.dev/docs/sdk/schemas.
"""

import base64
from typing import Any, Final

import numpy as np

from sessions.errors import ImportFileError, SessionError
from sessions.geometry.shapes import make_shape
from sessions.importers.frame_tree import FrameTree
from sessions.importers.mcap_messages import listed, number, numbers_of, part, stamp_of, text
from sessions.mesh_data import MeshData
from sessions.meshes.mesh_files import mesh_from_bytes

PRIMITIVES: Final = ("cubes", "spheres", "cylinders", "models", "triangles")

MODEL_TYPES: Final = {"model/gltf-binary": "glb", "model/stl": "stl", "model/obj": "obj"}


class SceneEntities:
    """Poses and meshes of entities, as they come in."""

    def __init__(self, source: str) -> None:
        self._source = source
        self._rows: dict[str, list[tuple[str, int, list[float]]]] = {}
        self._shapes: dict[str, MeshData] = {}
        self.notes: dict[str, str] = {}

    def add(self, message: Any, log_ns: int) -> None:
        """One SceneUpdate; of an entity of several parts, the first is its pose and its mesh."""
        for entity in listed(part(message, "entities")):
            name, frame = text(part(entity, "id")), text(part(entity, "frame_id"))
            parts = [(kind, one) for kind in PRIMITIVES for one in listed(part(entity, kind))]
            if not name or not parts:
                continue
            if len(parts) > 1:
                self.notes[name] = f"entity {name!r}: the first of its {len(parts)} parts taken"
            kind, first = parts[0]
            if name not in self._rows:
                self._shape(name, kind, first)
            pose = numbers_of(part(first, "pose.position"), "xyz") + numbers_of(part(first, "pose.orientation"), "xyzw")
            stamp = stamp_of(part(entity, "timestamp")) or log_ns
            self._rows.setdefault(name, []).append((frame, stamp, pose))

    def hang(self, tree: FrameTree) -> dict[str, MeshData]:
        """Hang every entity into its frame, and return the meshes; an entity named as a frame is that frame's mesh."""
        for name, rows in self._rows.items():
            if name not in tree:
                for frame, stamp, pose in rows:
                    tree.add(frame, name, stamp, pose)
            elif name in self._shapes and rows[0][2][:3] + rows[0][2][3:6] != [0.0] * 6:
                raise ImportFileError(
                    f"{self._source}: entity {name!r} is named as a frame but does not lie in its origin; rename one"
                )
        return self._shapes

    def _shape(self, name: str, kind: str, shape: Any) -> None:
        try:
            mesh = _mesh(kind, shape)
        except (SessionError, ValueError) as error:
            raise ImportFileError(f"{self._source}: entity {name!r}: {error}") from None
        if mesh is None:
            self.notes[name] = f"entity {name!r}: its model lies elsewhere; give it with --mesh"
        else:
            self._shapes[name] = mesh


def _mesh(kind: str, shape: Any) -> MeshData | None:
    """The mesh about the part's own pose, in axes of the source."""
    if kind == "models":
        return _model(shape)
    if kind == "triangles":
        points = np.array([numbers_of(point, "xyz") for point in listed(part(shape, "points"))]).reshape(-1, 3)
        corners = [int(number(one)) for one in listed(part(shape, "indices"))] or list(range(len(points)))
        return MeshData(points, np.array(corners).reshape(-1, 3))
    x, y, z = numbers_of(part(shape, "size"), "xyz")
    if kind == "cubes":
        return make_shape("box", {"x": x, "y": y, "z": z})
    # Of height and diameter 1: the lying cylinder is turned so that its length is along Z.
    unit = make_shape("sphere", {"radius": 0.5}) if kind == "spheres" else make_shape("cylinder", _UNIT)
    upright = unit if kind == "spheres" else unit.transformed(_Y_TO_Z)
    return upright.transformed(np.diag([x, y, z, 1.0]))


_UNIT: Final = {"radius": 0.5, "length": 1.0}
_Y_TO_Z: Final = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])


def _model(shape: Any) -> MeshData | None:
    data = part(shape, "data")
    raw = base64.b64decode(data, validate=True) if isinstance(data, str) else data if isinstance(data, bytes) else b""
    if not raw:
        return None
    media = text(part(shape, "media_type"))
    mesh = mesh_from_bytes(raw, MODEL_TYPES.get(media, media))
    return mesh.transformed(np.diag([*numbers_of(part(shape, "scale"), "xyz"), 1.0]))
