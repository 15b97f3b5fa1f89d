"""A GLB of any program: its nodes, the meshes where they put them, and skins cut by their dominant joint.

Source: Khronos glTF 2.0 specification, sections 3.5 (scenes and nodes), 3.6 (accessors), 3.7.3 (skins), 4.4 (GLB).
"""

import json
import struct
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sessions.errors import MeshFileError
from sessions.geometry.rotations import rotated
from sessions.mesh_data import MeshData, concatenated

Array = NDArray[np.float64]
EXACT: Final = "vrlab_positions_float64"
"""In the ``extras`` of a primitive: the buffer view that holds its positions in float64."""

_TYPES: Final = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS: Final = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_TRIANGLES, _STRIP, _FAN = 4, 5, 6
MOST_FACES: Final = 20_000_000  # Of all instances: nodes may repeat a mesh, so a small file can ask for any number


@dataclass(frozen=True, eq=False)
class Part:
    """One primitive under one node.

    Parameters
    ----------
    node : number of the node; ``place``: of the mesh in the file, by which parts are ordered.
    mesh : in the node's frame.
    joint : (f,) number of the node that moves each face most; ``None``: no skin.
    to_joint : joint -> 4x4 from the mesh's frame to the joint's, at rest.
    """

    node: int
    place: tuple[int, int]
    mesh: MeshData
    joint: NDArray[np.int64] | None = None
    to_joint: Mapping[int, Array] | None = None


@dataclass(frozen=True, eq=False)
class GlbTree:
    """The nodes of the default scene: ``names``, ``parents`` (-1: none), ``poses`` 4x4 to the world; and all parts."""

    names: tuple[str, ...]
    parents: tuple[int, ...]
    poses: tuple[Array, ...]
    parts: tuple[Part, ...]

    def whole(self) -> MeshData:
        """All parts where their nodes put them; a skin lies as it was modelled."""
        mesh = _joined(part.mesh.transformed(self.poses[part.node]) for part in self._in_file_order())
        if mesh is None:
            raise MeshFileError("the file holds no triangle; export the surface as triangles")
        return mesh

    def below(self, name: str) -> MeshData | None:
        """All that hangs on the node of this name, in its frame and in metres; ``None``: nothing does.

        A face of a skin hangs on the joint that moves it most, as it lies at rest: nothing is deformed.
        """
        if name not in self.names:
            return None
        home = self.names.index(name)
        from_world = np.linalg.inv(rigid_of(self.poses[home]))
        cut = (piece for part in self._in_file_order() for piece in _cut(part))
        return _joined(
            mesh.transformed(from_world @ self.poses[node]) for node, mesh in cut if home in self.above(node)
        )

    def above(self, node: int) -> list[int]:
        """This node, its parent, the parent's parent and so on."""
        chain = [node]
        while self.parents[chain[-1]] >= 0:
            chain.append(self.parents[chain[-1]])
        return chain

    def _in_file_order(self) -> list[Part]:
        return sorted(self.parts, key=lambda part: (part.place, part.node))

    @property
    def owners(self) -> tuple[str, ...]:
        """Names of nodes that hold a mesh or move a part of a skin, in order."""
        nodes = {node for part in self.parts for node, _ in _cut(part)}
        return tuple(self.names[node] for node in sorted(nodes))


def _cut(part: Part) -> list[tuple[int, MeshData]]:
    """The part, or what each joint moves most of it, in that node's frame."""
    if part.joint is None or part.to_joint is None:
        return [(part.node, part.mesh)]
    return [
        (node, MeshData(*_used(part.mesh.vertices, part.mesh.faces[part.joint == node])).transformed(matrix))
        for node, matrix in part.to_joint.items() if (part.joint == node).any()
    ]  # fmt: skip


def _used(vertices: Array, faces: NDArray[np.int64]) -> tuple[Array, NDArray[np.int64]]:
    kept, numbers = np.unique(faces, return_inverse=True)
    return vertices[kept], numbers.reshape(-1, 3)


def _joined(meshes: Iterable[MeshData]) -> MeshData | None:
    parts = [*meshes]
    return concatenated(parts) if parts else None


def rigid_of(pose: Array) -> Array:
    """The pose without its scale: what a tracker reports of the node."""
    columns = pose[:3, :3] / np.linalg.norm(pose[:3, :3], axis=0)
    columns[:, 0] *= np.sign(np.linalg.det(columns))
    u, _, v = np.linalg.svd(columns)
    rigid = np.eye(4)
    rigid[:3, :3], rigid[:3, 3] = u @ v, pose[:3, 3]
    return rigid


def read_glb(data: bytes) -> GlbTree:
    """The tree of a GLB. Raises MeshFileError where it is compressed; any error where it is damaged."""
    return _Reader(data).tree()


class _Reader:
    def __init__(self, data: bytes) -> None:
        if data[:4] != b"glTF":
            raise MeshFileError("it does not begin as a GLB; export it as binary glTF")
        length = struct.unpack_from("<I", data, 12)[0]
        self.json = json.loads(data[20 : 20 + length])
        self.binary = memoryview(data)[28 + length :]
        used = {*self.json.get("extensionsRequired", ())}
        for word, what in (("KHR_draco_mesh_compression", "Draco"), ("EXT_meshopt_compression", "meshopt")):
            if word in used:
                raise MeshFileError(f"its meshes are compressed by {what}; export it without compression")

    def rows(self, key: str) -> list[dict[str, Any]]:
        return self.json.get(key, [])

    def tree(self) -> GlbTree:
        nodes, scenes = self.rows("nodes"), self.rows("scenes")
        inner = {child for node in nodes for child in node.get("children", ())}
        roots = [number for number in range(len(nodes)) if number not in inner]
        if scenes:
            roots = scenes[self.json.get("scene", 0)].get("nodes", [])
        parents, poses = [-1] * len(nodes), [np.eye(4) for _ in nodes]
        waiting, reached = [(root, -1, np.eye(4)) for root in roots], set[int]()
        while waiting:
            number, parents[number], pose = waiting.pop()
            if number in reached:
                raise MeshFileError("a node hangs on two others; export it again")
            reached.add(number)
            poses[number] = pose @ _local(nodes[number])
            waiting += [(child, number, poses[number]) for child in nodes[number].get("children", ())]
        if sum(self._corners(nodes[number]) for number in reached) > 3 * MOST_FACES:
            raise MeshFileError(f"its nodes hold more than {MOST_FACES:,} faces; export a coarser one")
        parts = [part for number in sorted(reached) for part in self._parts(number, nodes[number])]
        names = tuple(str(node.get("name") or f"node {number}") for number, node in enumerate(nodes))
        return GlbTree(names, tuple(parents), tuple(poses), tuple(parts))

    def _corners(self, node: dict[str, Any]) -> int:
        """How many corners of faces a node asks for."""
        primitives = self.rows("meshes")[node["mesh"]]["primitives"] if "mesh" in node else ()
        used = [one.get("indices", one["attributes"].get("POSITION")) for one in primitives]
        return sum(self._count(self.rows("accessors")[number]) for number in used if number is not None)

    def _parts(self, number: int, node: dict[str, Any]) -> list[Part]:
        if "mesh" not in node:
            return []
        primitives = self.rows("meshes")[node["mesh"]]["primitives"]
        skin = self.rows("skins")[node["skin"]] if "skin" in node else None
        parts = []
        for row, primitive in enumerate(primitives):
            faces = self._faces(primitive)
            if not len(faces):
                continue
            mesh = MeshData(self._positions(primitive), faces)
            held = (None, None) if skin is None else self._moved(primitive, skin, faces)
            parts.append(Part(number, (node["mesh"], row), mesh, *held))
        return parts

    def _faces(self, primitive: dict[str, Any]) -> NDArray[np.int64]:
        mode, attributes = primitive.get("mode", _TRIANGLES), primitive["attributes"]
        if mode in (_STRIP, _FAN):
            raise MeshFileError("it holds a strip or a fan; export the surface as triangles")
        if mode != _TRIANGLES or "POSITION" not in attributes:
            return np.zeros((0, 3), dtype=np.int64)
        if "indices" in primitive:
            corners = self.array(primitive["indices"])[:, 0].astype(np.int64)
        else:
            corners = np.arange(self._count(self.rows("accessors")[attributes["POSITION"]]))
        return corners[: len(corners) // 3 * 3].reshape(-1, 3)

    def _positions(self, primitive: dict[str, Any]) -> Array:
        exact = primitive.get("extras", {}).get(EXACT) if isinstance(primitive.get("extras"), dict) else None
        if exact is None:
            return self.array(primitive["attributes"]["POSITION"])
        view = self.rows("bufferViews")[exact]
        return np.frombuffer(self._buffer(view), "<f8", view["byteLength"] // 8, view["byteOffset"]).reshape(-1, 3)

    def _moved(
        self, primitive: dict[str, Any], skin: dict[str, Any], faces: NDArray[np.int64]
    ) -> tuple[NDArray[np.int64], dict[int, Array]]:
        """The node that moves each face most, and from the mesh's frame to those of the joints."""
        nodes = np.array(skin["joints"], dtype=np.int64)
        joints = self.array(primitive["attributes"]["JOINTS_0"]).astype(np.int64)
        weights = self.array(primitive["attributes"]["WEIGHTS_0"])
        total = np.zeros((len(faces), len(nodes)))
        corners = np.repeat(np.arange(len(faces)), faces.shape[1] * joints.shape[1])
        np.add.at(total, (corners, joints[faces].ravel()), weights[faces].ravel())
        inverse = [np.eye(4)] * len(nodes)
        if "inverseBindMatrices" in skin:
            inverse = [*self.array(skin["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1)]
        return nodes[total.argmax(axis=1)], dict(zip(nodes.tolist(), inverse, strict=True))

    def _buffer(self, view: dict[str, Any]) -> memoryview:
        if "uri" in self.rows("buffers")[view["buffer"]]:
            raise MeshFileError("it keeps its data in another file; export it as one GLB")
        return self.binary

    def _count(self, accessor: dict[str, Any]) -> int:
        count = int(accessor["count"])
        if not 0 <= count <= 3 * MOST_FACES:
            raise MeshFileError(f"an accessor claims {count:,} values; export it again")
        return count

    def array(self, number: int) -> Array:
        """An accessor, (count, width) float64."""
        accessor = self.rows("accessors")[number]
        if "sparse" in accessor:
            raise MeshFileError("it holds a sparse accessor; export it without")
        kind, shape = np.dtype(_TYPES[accessor["componentType"]]), (self._count(accessor), _WIDTHS[accessor["type"]])
        if "bufferView" not in accessor:
            return np.zeros(shape)
        view = self.rows("bufferViews")[accessor["bufferView"]]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        strides = view.get("byteStride", kind.itemsize * shape[1]), kind.itemsize
        values = np.ndarray(shape, kind, self._buffer(view), start, strides).astype(np.float64)
        return np.maximum(values / np.iinfo(kind).max, -1.0) if accessor.get("normalized") else values


def _local(node: dict[str, Any]) -> Array:
    """From the node's frame to its parent's."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    pose = np.eye(4)
    pose[:3, :3] = rotated(node.get("rotation", (0.0, 0.0, 0.0, 1.0)), np.eye(3)).T
    pose[:3, :3] *= node.get("scale", (1.0, 1.0, 1.0))
    pose[:3, 3] = node.get("translation", (0.0, 0.0, 0.0))
    return pose
