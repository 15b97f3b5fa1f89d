"""glTF with physics: KHR_physics_rigid_bodies with KHR_implicit_shapes, or OMI_physics_body with OMI_physics_shape.

A node with a motion is a body; the colliders of it and of the nodes below it, down to the next body, are its compound
shape. A collider below no body stands still, as a body of its own node.

Source: the specifications of these extensions, Khronos glTF repository (KHR, draft) and omigroup/gltf-extensions (OMI).
"""

import base64
import json
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final
from urllib.parse import unquote

import numpy as np

from sessions.errors import MeshFileError, SceneError, SceneSourceError
from sessions.geometry.shapes import make_shape
from sessions.mesh_data import MeshData, concatenated
from sessions.meshes.glb_tree import GlbTree, read_glb, rigid_of
from sessions.scene_formats.safe_files import SceneFiles
from sessions.scene_formats.scene_source import (
    Matrix,
    SceneSource,
    SourceBody,
    Surface,
    convex_hull,
    surface_and_colliders,
)

KHR, KHR_SHAPES = "KHR_physics_rigid_bodies", "KHR_implicit_shapes"
OMI, OMI_SHAPES = "OMI_physics_body", "OMI_physics_shape"
STATIC: Final = "static"
DATA_URI: Final = "data:"
ROUND_FACES: Final = 4000
HULLS: Final = frozenset(("convex", "hull"))

Row = dict[str, Any]


def read_gltf(path: Path, files: SceneFiles) -> SceneSource:
    """The scene of a GLB, or of a glTF with its buffers beside it.

    Raises ``SceneSourceError``: it is damaged, has no physics, or names a file outside the folder.
    """
    data = files.read(path, str(path))
    try:
        if data[:4] != b"glTF":
            data = _packed(json.loads(data.decode("utf-8-sig")), path, files)
        tree = read_glb(data)
        length = struct.unpack_from("<I", data, 12)[0]
        return _Reader(json.loads(data[20 : 20 + length]), tree).scene(path)
    except SceneSourceError:
        raise
    except MeshFileError as error:
        raise SceneSourceError(f"{path}: {error}") from None
    except Exception as error:  # as in mesh files: any error means damaged
        raise SceneSourceError(f"{path} is no readable glTF ({error}); export it again") from error


def _packed(document: Row, path: Path, files: SceneFiles) -> bytes:
    """A glTF as GLB: the files of its buffers are read, and put into it."""
    for buffer in document.get("buffers", ()):
        uri = str(buffer.get("uri", ""))
        if uri and not uri.startswith(DATA_URI):
            if "://" in uri:
                raise SceneSourceError(f"{path} names a buffer of a server, {uri[:60]!r}; put the file beside it")
            content = files.read(path.parent / unquote(uri), f"the buffer {uri!r}")
            buffer["uri"] = "data:application/octet-stream;base64," + base64.b64encode(content).decode()
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    return struct.pack("<4sIIII", b"glTF", 2, 20 + len(text), len(text), 0x4E4F534A) + text


class _Reader:
    def __init__(self, document: Row, tree: GlbTree) -> None:
        self._tree, self._nodes = tree, document.get("nodes", [])
        extensions = document.get("extensions", {})
        self._shapes = {
            KHR: extensions.get(KHR_SHAPES, {}).get("shapes", []),
            OMI: extensions.get(OMI_SHAPES, {}).get("shapes", []),
        }
        self._filters = extensions.get(KHR, {}).get("collisionFilters", [])
        self.left_out: list[str] = []

    def scene(self, path: Path) -> SceneSource:
        physics = {number: found for number in range(len(self._nodes)) if (found := self._physics_of(number))}
        if not physics:
            raise SceneSourceError(f"{path} has no physics ({KHR} or {OMI}); export it with its colliders")
        owner = {number: self._body_of(number, physics) for number in physics}
        numbers = sorted(set(owner.values()))
        bodies, filters = dict[str, SourceBody](), dict[str, list[Row]]()
        for number in numbers:
            parts = [node for node, body in owner.items() if body == number]
            body = self._body(number, parts, physics)
            if body is not None and body.name in bodies:
                raise SceneSourceError(f"{path} has two bodies {body.name!r}; name their nodes apart")
            if body is not None:
                bodies[body.name] = body
                rows = [physics[node][1].get("collider", {}).get("collisionFilter") for node in parts]
                filters[body.name] = [self._filters[row] for row in rows if row is not None]
        names = [*bodies]
        excluded = tuple(
            (first, second)
            for index, first in enumerate(names)
            for second in names[index + 1 :]
            if not _filters_meet(filters[first], filters[second])
        )
        return SceneSource("glTF", bodies, excluded, tuple(self.left_out))

    def _physics_of(self, number: int) -> tuple[str, Row] | None:
        extensions: Mapping[str, Row] = self._nodes[number].get("extensions", {})
        return next(((name, extensions[name]) for name in (KHR, OMI) if name in extensions), None)

    def _body_of(self, number: int, physics: Mapping[int, tuple[str, Row]]) -> int:
        """The body that a node is a part of: the nearest above with a motion, else the node itself."""
        moving = (node for node in self._tree.above(number) if node in physics and "motion" in physics[node][1])
        return next(moving, number)

    def _body(self, number: int, parts: list[int], physics: Mapping[int, tuple[str, Row]]) -> SourceBody | None:
        name, frame = self._tree.names[number], rigid_of(self._tree.poses[number])
        motion = physics[number][1].get("motion", {})
        to_body = np.linalg.inv(frame)
        solids = (self._collider(node, *physics[node], to_body @ self._tree.poses[node]) for node in parts)
        colliding = [solid for solid in solids if solid is not None]
        for node in parts:
            for word in ("trigger", "joint"):
                if word in physics[node][1]:
                    self.left_out.append(f"the {word} of node {self._tree.names[node]!r}")
        drawn = [
            self._tree.in_frame(frame, surface)
            for surface in self._tree.surfaces
            if self._body_of(surface.node, physics) == number
            or (number in self._tree.above(surface.node) and self._nearest(surface.node, physics) == number)
        ]
        if not drawn and not colliding:
            return None
        surfaces, _ = surface_and_colliders(drawn, colliding, Surface.AUTO)
        moves = bool(motion) and motion.get("type") != STATIC
        return SourceBody(name, concatenated(surfaces), tuple(colliding), frame, moves, mass=motion.get("mass"))

    def _nearest(self, number: int, physics: Mapping[int, tuple[str, Row]]) -> int:
        """The nearest body at a node or above it, or -1."""
        return next((self._body_of(node, physics) for node in self._tree.above(number) if node in physics), -1)

    def _collider(self, node: int, kind: str, physics: Row, to_body: Matrix) -> MeshData | None:
        """The solid of a node in the frame of its body; ``None``: it has none that can be taken."""
        collider = physics.get("collider")
        if not collider:
            return None
        geometry = collider.get("geometry", collider)
        name = self._tree.names[node]
        if "shape" in geometry:
            row = self._shapes[kind][geometry["shape"]]
            word = str(row.get("type", ""))
            inner = row.get(word, row)
            if word in (*HULLS, "trimesh"):
                return self._mesh_collider(node, int(inner.get("mesh", -1)), word in HULLS, to_body)
            shape = _shape(kind, word, inner)
            if shape is None:
                self.left_out.append(f"the collider of node {name!r}: a shape {word!r}")
                return None
            return shape.transformed(to_body)
        # Of the drafts one names a mesh, the other a node that holds it.
        mesh = geometry.get("mesh")
        if mesh is None and "node" in geometry:
            mesh = self._nodes[geometry["node"]].get("mesh")
        if mesh is None:
            self.left_out.append(f"the collider of node {name!r}: it names no shape")
            return None
        return self._mesh_collider(node, int(mesh), bool(geometry.get("convexHull")), to_body)

    def _mesh_collider(self, node: int, mesh: int, is_hull: bool, to_body: Matrix) -> MeshData | None:
        holders = [surface for surface in self._tree.surfaces if self._nodes[surface.node].get("mesh") == mesh]
        first = [surface.mesh for surface in holders if surface.node == holders[0].node]
        if not first:
            self.left_out.append(f"the collider of node {self._tree.names[node]!r}: no node holds its mesh")
            return None
        solid = concatenated(first).transformed(to_body)
        return convex_hull(solid) if is_hull else solid


DEFAULTS: Final = {KHR: (0.25, 0.5, 0.5), OMI: (0.5, 1.0, 2.0)}
"""Radius of a capsule or cylinder, height of a capsule between the middles of its ends, height of a cylinder."""


def _shape(kind: str, word: str, row: Row) -> MeshData | None:
    """A plain shape along +Y; ``None``: it is not taken."""
    try:
        if word == "box":
            x, y, z = row.get("size", (1.0, 1.0, 1.0))
            return make_shape("box", {"x": x, "y": y, "z": z})
        if word == "sphere":
            return make_shape("sphere", {"radius": row.get("radius", 0.5)}, ROUND_FACES)
        if word in ("capsule", "cylinder"):
            return _round_shape(kind, word, row)
    except SceneError:
        pass
    return None


def _round_shape(kind: str, word: str, row: Row) -> MeshData:
    """A capsule or a cylinder; one of two radii is the hull of its ends."""
    radius, capsule_height, cylinder_height = DEFAULTS[kind]
    is_capsule = word == "capsule"
    height = float(row.get("height", capsule_height if is_capsule else cylinder_height))
    if "radius" in row:
        # A file of an older draft: its height is that of the whole.
        return make_shape(word, {"radius": float(row["radius"]), "length": height}, ROUND_FACES)
    lower, upper = float(row.get("radiusBottom", radius)), float(row.get("radiusTop", radius))
    if lower == upper:
        length = height + 2.0 * lower if is_capsule else height
        return make_shape(word, {"radius": lower, "length": length}, ROUND_FACES)
    ends = []
    for end, side in ((lower, -1.0), (upper, 1.0)):
        size = {"radius": end} if is_capsule else {"radius": end, "length": height}
        solid = make_shape("sphere" if is_capsule else "cylinder", size, ROUND_FACES)
        away = np.array([0.0, side * height / 2.0, 0.0])
        # Of a cylinder both discs of an end are laid in the end's plane.
        corners = solid.vertices if is_capsule else solid.vertices * [1.0, 0.0, 1.0]
        ends.append(MeshData(corners + away, solid.faces))
    return convex_hull(concatenated(ends))


def _filters_meet(first: list[Row], second: list[Row]) -> bool:
    """Whether colliders of two bodies may collide by their filters; one without a filter collides with all."""
    return not first or not second or any(_lets(a, b) and _lets(b, a) for a in first for b in second)


def _lets(own: Row, other: Row) -> bool:
    systems = set(other.get("collisionSystems", ()))
    if "collideWithSystems" in own:
        return bool(systems & set(own["collideWithSystems"]))
    return not systems & set(own.get("notCollideWithSystems", ()))
