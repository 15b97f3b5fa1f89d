"""A GLB of any program: its nodes, and the meshes where its nodes or the joints of a skin put them.

Source: Khronos glTF 2.0 specification, sections 3.5 (scenes and nodes), 3.7 (meshes, skins, morph targets).
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sessions.errors import EmptyMeshError, MeshFileError
from sessions.geometry.rotations import rotated_vectors
from sessions.mesh_data import MeshData, concatenated_meshes
from sessions.meshes.glb_file import DRACO, INSTANCING, MOST_FACES, REFUSED, VISIBILITY, GlbFile, Row, at

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
ROTATION_TOLERANCE: Final = 1e-3
"""A quaternion of a node that is longer or shorter by more is none: nobody knows what its program meant."""
COLLIDER_NAME: Final = re.compile(r"(UBX|USP|UCP|UCX|UTM)_(.+?)(?:_[0-9]+)?")
"""A box, sphere, capsule or convex collider of a body, as Unreal's importer takes them: ``UCX_Beaker_03``; a mesh."""
LEVEL_NAME: Final = re.compile(r"(.*?)[ _.-]?LOD[ _]?([0-9]+)", re.IGNORECASE)
"""One of several surfaces of different detail, as engines name them: Beaker_LOD1."""
EXACT: Final = "vrlab_positions_float64"
"""In the ``extras`` of a primitive: the buffer view that holds its positions in float64."""

_TRIANGLES, _STRIP, _FAN = 4, 5, 6


@dataclass(frozen=True, eq=False)
class Surface:
    """A primitive of a mesh under one node.

    Parameters
    ----------
    node : number of the node; ``order``: of the mesh in the file, by which surfaces are ordered.
    mesh : in the node's frame, with the morph targets by their weights; of a skin as it was modelled.
    joint : (f,) number of the node that moves each face most; ``None``: no skin.
    to_joint : joint -> 4x4 from the mesh's frame to the joint's, at rest.
    posed : of a skin where its joints put it, in the world.
    """

    node: int
    order: tuple[int, int]
    mesh: MeshData
    joint: NDArray[np.int64] | None = None
    to_joint: Mapping[int, Array] | None = None
    posed: MeshData | None = None


@dataclass(frozen=True, eq=False)
class GlbTree:
    """The nodes of the default scene: ``names``, ``parents`` (-1: none), ``poses`` 4x4 to the world; ``surfaces``.

    Names, parents and poses have a row for every node of the file; ``reached`` are those that hang in the scene,
    ``hidden`` those of them that are not drawn.
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    poses: tuple[Array, ...]
    surfaces: tuple[Surface, ...]
    reached: frozenset[int]
    hidden: frozenset[int]

    def whole(self) -> MeshData:
        """All surfaces where their nodes put them; a skin where its joints do, whatever its own node says."""
        self._refuse_levels(surface.node for surface in self.surfaces)
        mesh = _joined_meshes(self.in_frame(np.eye(4), surface) for surface in self._in_file_order())
        if mesh is None:
            raise EmptyMeshError("its scene holds no triangle; export the surface as triangles, in the scene")
        return mesh

    def below(self, name: str) -> MeshData | None:
        """All that hangs on the node of this name, in its frame and in metres; ``None``: nothing does.

        A face of a skin hangs on the joint that moves it most, as it lies at rest: nothing is deformed. Colliders of
        Unreal's names below the node are no part of its surface.
        """
        if name not in self.names:
            return None
        home = self.names.index(name)
        from_world = np.linalg.inv(rigid_of(self.poses[home]))
        surfaces = self._in_file_order()
        own = (surface for surface in surfaces if surface.node == home or not self.is_collider(surface))
        cut = [piece for surface in own for piece in _cut(surface) if home in self.above(piece[0])]
        self._refuse_levels(node for node, _ in cut)
        return _joined_meshes(mesh.transformed(from_world @ self.poses[node]) for node, mesh in cut)

    def _refuse_levels(self, nodes: Iterable[int]) -> None:
        """Refuse to join levels of detail: engines draw one of them at a time."""
        levels: dict[str, dict[int, str]] = {}
        for node in nodes:
            named = next(
                filter(None, map(LEVEL_NAME.fullmatch, (self.names[number] for number in self.above(node)))), None
            )
            if named:
                levels.setdefault(named[1], {}).setdefault(int(named[2]), named[0])
        for names in levels.values():
            if len(names) > 1:
                first, second, *_ = (names[level] for level in sorted(names))
                raise MeshFileError(f"{first!r} and {second!r} are one surface in different detail; export one of them")

    def is_collider(self, surface: Surface) -> bool:
        """Whether the node of a surface has the name of a collider, as Unreal's importer takes them."""
        return COLLIDER_NAME.fullmatch(self.names[surface.node]) is not None

    def in_frame(self, frame: Array, surface: Surface) -> MeshData:
        """Return a surface in a frame, given by its pose 4x4 in the world."""
        if surface.posed is not None:
            return surface.posed.transformed(np.linalg.inv(frame))
        return surface.mesh.transformed(np.linalg.inv(frame) @ self.poses[surface.node])

    def above(self, node: int) -> list[int]:
        """This node, its parent, the parent's parent and so on."""
        chain = [node]
        while self.parents[chain[-1]] >= 0:
            chain.append(self.parents[chain[-1]])
        return chain

    def _in_file_order(self) -> list[Surface]:
        return sorted(self.surfaces, key=lambda surface: (surface.order, surface.node))

    @property
    def owners(self) -> tuple[str, ...]:
        """Names of nodes that hold a mesh or move a surface of a skin, in order."""
        nodes = {node for surface in self.surfaces for node, _ in _cut(surface)}
        return tuple(self.names[node] for node in sorted(nodes))


def _cut(surface: Surface) -> list[tuple[int, MeshData]]:
    """The surface, or what each joint moves most of it, in that node's frame."""
    if surface.joint is None or surface.to_joint is None:
        return [(surface.node, surface.mesh)]
    return [
        (
            node,
            MeshData(*_used_vertices(surface.mesh.vertices, surface.mesh.faces[surface.joint == node])).transformed(
                matrix
            ),
        )
        for node, matrix in surface.to_joint.items()
        if (surface.joint == node).any()
    ]


def _used_vertices(vertices: Array, faces: NDArray[np.int64]) -> tuple[Array, NDArray[np.int64]]:
    kept, numbers = np.unique(faces, return_inverse=True)
    return vertices[kept], numbers.reshape(-1, 3)


def _joined_meshes(meshes: Iterable[MeshData]) -> MeshData | None:
    surfaces = [*meshes]
    return concatenated_meshes(surfaces) if surfaces else None


def rigid_of(pose: Array) -> Array:
    """The pose without its scale: what a tracker reports of the node; `MeshFileError`: the scale is 0."""
    lengths = np.linalg.norm(pose[:3, :3], axis=0)
    if not lengths.all():
        raise MeshFileError("a node has a scale of 0; export it again")
    columns = pose[:3, :3] / lengths
    columns[:, 0] *= np.sign(np.linalg.det(columns))
    u, _, v = np.linalg.svd(columns)
    rigid = np.eye(4)
    rigid[:3, :3], rigid[:3, 3] = u @ v, pose[:3, 3]
    return rigid


def read_glb(data: bytes, root: int | None = None, *, unit_rotations: bool = False) -> GlbTree:
    """The tree of a GLB: of its default scene, or of the node ``root`` and all below it, in a scene or not.

    ``unit_rotations``: rotations are scaled to unit length, as rigid bodies need them; else they are taken as written,
    so that vertices keep the bits that they have in recordings.

    Raises MeshFileError where it cannot be read as it is meant; any error where it is damaged.
    """
    return _Reader(GlbFile(data), unit_rotations=unit_rotations).tree(root)


def read_glb_mesh(data: bytes, number: int) -> MeshData | None:
    """A mesh by its number, whether a node holds it or not, with its own morph weights; ``None``: it has no triangle.

    Raises as `read_glb`.
    """
    return _Reader(GlbFile(data)).mesh(number)


class _Reader:
    def __init__(self, file: GlbFile, *, unit_rotations: bool = False) -> None:
        self._file = file
        self._unit_rotations = unit_rotations

    def tree(self, root: int | None) -> GlbTree:
        nodes = self._file.rows("nodes")
        roots = self._file.scene if root is None else [root]
        if roots is None:
            inner = {child for node in nodes for child in node.get("children", ())}
            roots = [number for number in range(len(nodes)) if number not in inner]
        parents, poses, hidden = [-1] * len(nodes), [np.eye(4) for _ in nodes], set[int]()
        waiting, reached = [(root, -1, np.eye(4)) for root in roots], set[int]()
        while waiting:
            number, parent, pose = waiting.pop()
            node = at(nodes, number)
            if number in reached:
                raise MeshFileError("a node hangs on two others; export it again")
            reached.add(number)
            if parent in hidden or not node.get("extensions", {}).get(VISIBILITY, {}).get("visible", True):
                hidden.add(number)
            parents[number], poses[number] = parent, pose @ _local(node, unit_rotations=self._unit_rotations)
            waiting += [(child, number, poses[number]) for child in node.get("children", ())]
        if sum(self._corners(nodes[number]) for number in reached) > 3 * MOST_FACES:
            raise MeshFileError(f"its nodes hold more than {MOST_FACES:,} faces; export a coarser one")
        joint_poses = {number: poses[number] for number in reached}
        surfaces = [surface for number in sorted(reached) for surface in self._surfaces(number, joint_poses)]
        names = tuple(str(node.get("name") or f"node {number}") for number, node in enumerate(nodes))
        return GlbTree(names, tuple(parents), tuple(poses), tuple(surfaces), frozenset(reached), frozenset(hidden))

    def mesh(self, number: int) -> MeshData | None:
        row = at(self._file.rows("meshes"), number)
        if self._corners({"mesh": number}) > 3 * MOST_FACES:
            raise MeshFileError(f"a mesh of it holds more than {MOST_FACES:,} faces; export a coarser one")
        primitives = ((self._faces(primitive), primitive) for primitive in row["primitives"])
        weights = row.get("weights") or ()
        return _joined_meshes(
            MeshData(self._positions(primitive, weights), faces) for faces, primitive in primitives if len(faces)
        )

    def _primitives(self, node: Row) -> Sequence[Row]:
        return at(self._file.rows("meshes"), node["mesh"])["primitives"] if "mesh" in node else ()

    def _corners(self, node: Row) -> int:
        """How many corners of faces and vertices a node asks for, the larger of the two."""
        total = 0
        for primitive in self._primitives(node):
            arrays = [primitive.get("indices"), primitive["attributes"].get("POSITION")]
            total += max((self._file.count(number) for number in arrays if number is not None), default=0)
        return total

    def _surfaces(self, number: int, poses: Mapping[int, Array]) -> list[Surface]:
        node = self._file.rows("nodes")[number]
        primitives = self._primitives(node)
        if INSTANCING in node.get("extensions", {}):
            raise MeshFileError(REFUSED[INSTANCING])
        if not primitives:
            return []
        weights = node.get("weights") or at(self._file.rows("meshes"), node["mesh"]).get("weights") or ()
        skin = _Skin(self._file, node["skin"], poses) if "skin" in node else None
        surfaces = []
        for row, primitive in enumerate(primitives):
            faces = self._faces(primitive)
            if not len(faces):
                continue
            mesh = MeshData(self._positions(primitive, weights), faces)
            order = node["mesh"], row
            surfaces.append(
                Surface(number, order, mesh) if skin is None else skin.surface(number, order, mesh, primitive)
            )
        return surfaces

    def _faces(self, primitive: Row) -> Indices:
        mode, attributes = primitive.get("mode", _TRIANGLES), primitive["attributes"]
        if mode in (_STRIP, _FAN):
            raise MeshFileError("it holds a strip or a fan; export the surface as triangles")
        if mode != _TRIANGLES or "POSITION" not in attributes:
            return np.zeros((0, 3), dtype=np.int64)
        arrays = [attributes["POSITION"], *([primitive["indices"]] if "indices" in primitive else ())]
        if DRACO in primitive.get("extensions", {}) and not all(self._file.has_data(number) for number in arrays):
            raise MeshFileError(REFUSED[DRACO])
        if "indices" in primitive:
            corners = self._file.array(primitive["indices"])[:, 0].astype(np.int64)
        else:
            corners = np.arange(self._file.count(attributes["POSITION"]))
        return corners[: len(corners) // 3 * 3].reshape(-1, 3)

    def _positions(self, primitive: Row, weights: Sequence[float]) -> Array:
        """The vertices, and what the morph targets add to them by their weights."""
        exact = primitive.get("extras", {}).get(EXACT) if isinstance(primitive.get("extras"), dict) else None
        if exact is None:
            positions = self._file.array(primitive["attributes"]["POSITION"])
        else:
            positions = np.frombuffer(self._file.view(exact)[0], "<f8").reshape(-1, 3)
        targets = primitive.get("targets", ())
        if weights and len(weights) != len(targets):
            raise MeshFileError(f"it has {len(weights)} weights of {len(targets)} morph targets; export it again")
        for target, weight in zip(targets, weights, strict=False):
            if "POSITION" in target:
                positions = positions + float(weight) * self._file.array(target["POSITION"])
        return positions


class _Skin:
    """Joints that carry vertices: each goes where the weighted mean of its joints takes it.

    Parameters
    ----------
    number : of the skin in the file.
    poses : node -> its pose 4x4 in the world, of the nodes of the scene.
    """

    def __init__(self, file: GlbFile, number: int, poses: Mapping[int, Array]) -> None:
        self._file = file
        skin = at(file.rows("skins"), number)
        self._joints = np.array(skin["joints"], dtype=np.int64)
        missing = [joint for joint in self._joints.tolist() if joint not in poses]
        if missing:
            raise MeshFileError(f"joint {missing[0]} of a skin is no node of its scene; export it again")
        self._inverse = np.tile(np.eye(4), (len(self._joints), 1, 1))
        if "inverseBindMatrices" in skin:
            matrices = file.array(skin["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1)
            if len(matrices) < len(self._joints):
                raise MeshFileError(f"a skin binds {len(matrices)} of {len(self._joints)} joints; export it again")
            self._inverse = matrices[: len(self._joints)]
        self._to_world = np.array([poses[joint] for joint in self._joints.tolist()]) @ self._inverse

    def surface(self, node: int, order: tuple[int, int], mesh: MeshData, primitive: Row) -> Surface:
        """The surface of a mesh that hangs on this skin."""
        joints, weights = self._influences(primitive["attributes"], len(mesh.vertices))
        each_face = len(mesh.faces), 3 * joints.shape[1]
        dominant = _heaviest(joints[mesh.faces].reshape(each_face), weights[mesh.faces].reshape(each_face))
        to_joint = dict(zip(self._joints.tolist(), self._inverse, strict=True))
        return Surface(node, order, mesh, self._joints[dominant], to_joint, self._posed_skin(mesh, joints, weights))

    def _influences(self, attributes: Row, count: int) -> tuple[Indices, Array]:
        """Joints and weights of each vertex, (v, k); weights add up to one, all that are zero mean the first joint."""
        sets = [k for k in range(len(attributes)) if f"JOINTS_{k}" in attributes]
        if not sets:
            raise MeshFileError("a mesh with a skin names no joints; export it again")
        joints = np.concatenate([self._file.array(attributes[f"JOINTS_{k}"]) for k in sets], axis=1).astype(np.int64)
        weights = np.concatenate([self._file.array(attributes[f"WEIGHTS_{k}"]) for k in sets], axis=1)
        if joints.shape != weights.shape or len(joints) != count or joints.max() >= len(self._joints):
            raise MeshFileError("joints and weights of a skin do not fit its vertices; export it again")
        sums = weights.sum(axis=1, keepdims=True)
        weights[sums[:, 0] == 0, 0] = 1.0
        return joints, weights / np.where(sums == 0, 1.0, sums)

    def _posed_skin(self, mesh: MeshData, joints: Indices, weights: Array) -> MeshData:
        points = np.zeros_like(mesh.vertices)
        mirrored = 0.0
        for column in range(joints.shape[1]):
            matrices = self._to_world[joints[:, column]]
            moved = np.einsum("vij,vj->vi", matrices[:, :3, :3], mesh.vertices) + matrices[:, :3, 3]
            points += weights[:, column, None] * moved
            mirrored -= float((weights[:, column] * np.sign(np.linalg.det(matrices[:, :3, :3]))).sum())
        return MeshData(points, mesh.faces[:, ::-1] if mirrored > 0 else mesh.faces)


def _heaviest(numbers: Indices, weights: Array) -> Indices:
    """The number in each row (r, k) whose weights in it add up to most, the lowest of several; (r,)."""
    count = int(numbers.max()) + 1
    rows = np.repeat(np.arange(len(numbers)), numbers.shape[1])
    keys, inverse = np.unique(rows * count + numbers.ravel(), return_inverse=True)
    sums = np.bincount(inverse.ravel(), weights=weights.ravel())
    order = np.lexsort((-keys, sums, keys // count))  # by row, then by sum, of equal sums the lowest number last
    last = np.flatnonzero(np.diff(keys[order] // count, append=len(numbers)))
    return keys[order[last]] % count


def _local(node: Row, *, unit_rotations: bool) -> Array:
    """From the node's frame to its parent's."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    pose = np.eye(4)
    # A unit quaternion in float32 stretches by 1e-7 in float64.
    quaternion = np.array(node.get("rotation", (0.0, 0.0, 0.0, 1.0)), dtype=np.float64)
    length = np.linalg.norm(quaternion)
    if not length > 0.0:
        raise MeshFileError("a node has a rotation without length; export it again")
    if not abs(length - 1.0) <= ROTATION_TOLERANCE:
        raise MeshFileError(f"a node has a rotation of length {length:.4g} in place of 1; export it again")
    pose[:3, :3] = rotated_vectors(quaternion / length if unit_rotations else quaternion, np.eye(3)).T
    pose[:3, :3] *= node.get("scale", (1.0, 1.0, 1.0))
    pose[:3, 3] = node.get("translation", (0.0, 0.0, 0.0))
    return pose
