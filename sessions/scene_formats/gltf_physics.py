"""glTF with physics: KHR_physics_rigid_bodies with KHR_implicit_shapes, or OMI_physics_body with OMI_physics_shape.

A node with a motion is a body; the colliders of it and of the nodes below it, down to the next body, are its compound
shape. A collider below no body stands still, as a body of its own node.

Source: the specifications of these extensions, Khronos glTF repository (KHR, draft) and omigroup/gltf-extensions (OMI).
"""

import base64
import json
import re
import struct
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any, Final
from urllib.parse import unquote

import numpy as np

from sessions.errors import MeshFileError, SceneError, SceneSourceError
from sessions.geometry.shapes import make_shape
from sessions.mesh_data import MeshData, concatenated_meshes
from sessions.meshes.glb_tree import read_glb, read_glb_mesh, rigid_of
from sessions.meshes.hull import convex_hull
from sessions.scene_formats.body_names import distinct_names, repeated_names
from sessions.scene_formats.round_shapes import ROUND_FACES, tapered_shape
from sessions.scene_formats.safe_files import MOST_FILE_BYTES, SceneFiles
from sessions.scene_formats.scene_source import (
    Matrix,
    SceneSource,
    SourceBody,
    Surface,
    check_size,
    surface_meshes,
)

KHR, KHR_SHAPES = "KHR_physics_rigid_bodies", "KHR_implicit_shapes"
OMI, OMI_SHAPES, OMI_JOINT = "OMI_physics_body", "OMI_physics_shape", "OMI_physics_joint"
STATIC: Final = "static"
DATA_URI: Final = "data:"
HULLS: Final = frozenset(("convex", "hull"))

Row = dict[str, Any]


def read_gltf(path: Path, files: SceneFiles) -> SceneSource:
    """The scene of a GLB, or of a glTF with its buffers beside it.

    Raises ``SceneSourceError``: it is damaged, has no physics, or names a file outside the folder.
    """
    data = files.read(path, str(path))
    try:
        if data[:4] != b"glTF":
            data = _pack_as_glb(json.loads(data.decode("utf-8-sig")), path, files)
        length = struct.unpack_from("<I", data, 12)[0]
        return _Reader(json.loads(data[20 : 20 + length]), data).scene(path)
    except SceneSourceError:
        raise
    except MeshFileError as error:
        raise SceneSourceError(f"{path}: {error}") from None
    except Exception as error:  # as in mesh files: any error means damaged
        raise SceneSourceError(f"{path} is no readable glTF ({error}); export it again") from error


def _pack_as_glb(document: Row, path: Path, files: SceneFiles) -> bytes:
    """A glTF as GLB: the files of its buffers are read, and put into it."""
    total = 0
    for buffer in document.get("buffers", ()):
        uri = str(buffer.get("uri", ""))
        if not uri or uri.startswith(DATA_URI):
            continue
        if re.match(r"[A-Za-z][A-Za-z0-9+.-]*:", uri):
            raise SceneSourceError(f"{path} names a buffer by an address, {uri[:60]!r}; put the file beside it")
        content = files.read(path.parent / unquote(uri), f"the buffer {uri!r}")
        # Buffers may name one file again and again.
        total += len(content)
        if total > MOST_FILE_BYTES:
            most = f"{MOST_FILE_BYTES / 1e6:,.0f} MB"
            raise SceneSourceError(f"the buffers of {path} have more than {most} together; reduce the scene")
        buffer["uri"] = "data:application/octet-stream;base64," + base64.b64encode(content).decode()
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    return struct.pack("<4sIIII", b"glTF", 2, 20 + len(text), len(text), 0x4E4F534A) + text


class _Reader:
    def __init__(self, document: Row, data: bytes) -> None:
        self._data, self._tree, self._nodes = data, read_glb(data, unit_rotations=True), document.get("nodes", [])
        extensions = document.get("extensions", {})
        self._shapes = {
            KHR: extensions.get(KHR_SHAPES, {}).get("shapes", []),
            OMI: extensions.get(OMI_SHAPES, {}).get("shapes", []),
        }
        self._filters = extensions.get(KHR, {}).get("collisionFilters", [])
        self._used = [name for name in document.get("extensionsUsed", ()) if "physics" in name or "collider" in name]
        self.left_out: list[str] = []
        self._faces = 0

    def scene(self, path: Path) -> SceneSource:
        physics = {number: row for number in sorted(self._tree.reached) if (row := self._physics_of(number))}
        if not physics:
            used = f"; its extension {self._used[0]} is another" if self._used else ""
            raise SceneSourceError(f"{path} has no physics of {KHR} or {OMI}{used}; export it with its colliders")
        check_size(len(physics))
        owner = {number: self._body_of(number, physics) for number in physics}
        bodies, filters = dict[int, SourceBody](), dict[int, list[Row | None]]()
        numbers = sorted(set(owner.values()))
        names = dict(zip(numbers, distinct_names([self._steps(number) for number in numbers]), strict=True))
        for number in numbers:
            own_nodes = [node for node, body in owner.items() if body == number]
            body = self._body(number, own_nodes, physics)
            if body is None:
                continue
            bodies[number] = replace(body, name=names[number])
            filters[number] = [*self._filters_of(own_nodes, physics)]
        excluded = dict.fromkeys(self._unfiltered_pairs(names, filters))
        excluded |= dict.fromkeys(pair for pair in self._jointed_pairs(physics) if bodies.keys() >= {*pair})
        named = tuple((bodies[first].name, bodies[second].name) for first, second in excluded)
        return SceneSource(
            format="glTF",
            bodies={body.name: body for body in bodies.values()},
            excluded=named,
            left_out=tuple(self.left_out),
            notes=repeated_names([self._tree.names[number] for number in bodies], [names[number] for number in bodies]),
        )

    def _steps(self, number: int) -> list[str]:
        """Names of the nodes from the root of the scene to a node."""
        return [self._tree.names[node] for node in reversed(self._tree.above(number))]

    def _filters_of(self, own_nodes: Iterable[int], physics: Mapping[int, tuple[str, Row]]) -> Iterator[Row | None]:
        """The filter of each collider of a body; ``None``: it collides with everything."""
        for node in own_nodes:
            if "collider" in physics[node][1]:
                row = physics[node][1]["collider"].get("collisionFilter")
                yield None if row is None else self._filters[row]

    def _unfiltered_pairs(
        self, names: Mapping[int, str], filters: Mapping[int, Sequence[Row | None]]
    ) -> Iterator[tuple[int, int]]:
        """Pairs of bodies of which no two colliders meet; where some do and others do not, that is named."""
        for first, second in combinations(filters, 2):
            answers = {_meet(a, b) for a in filters[first] for b in filters[second]}
            if answers == {False}:
                yield first, second
            elif len(answers) == 2:
                pair = f"{names[first]!r} and {names[second]!r}"
                self.left_out.append(f"filters that let some colliders of {pair} meet and others not: all meet")

    def _jointed_pairs(self, physics: Mapping[int, tuple[str, Row]]) -> Iterator[tuple[int, int]]:
        """Pairs of bodies that a joint holds together; they collide only where it says so."""
        for number in sorted(self._tree.reached):
            extensions: Mapping[str, Row] = self._nodes[number].get("extensions", {})
            joint = extensions.get(KHR, {}).get("joint", extensions.get(OMI_JOINT))
            if joint is None:
                continue
            self.left_out.append(f"the joint of node {self._tree.names[number]!r}")
            connected = joint.get("connectedNode", -1)
            if connected in self._tree.reached and not joint.get("enableCollision"):
                ends = sorted({self._nearest(number, physics), self._nearest(connected, physics)})
                if len(ends) == 2:
                    yield ends[0], ends[1]

    def _physics_of(self, number: int) -> tuple[str, Row] | None:
        extensions: Mapping[str, Row] = self._nodes[number].get("extensions", {})
        return next(((name, extensions[name]) for name in (KHR, OMI) if name in extensions), None)

    def _body_of(self, number: int, physics: Mapping[int, tuple[str, Row]]) -> int:
        """The body that a node is a part of: the nearest above with a motion, else the node itself."""
        moving = (node for node in self._tree.above(number) if node in physics and "motion" in physics[node][1])
        return next(moving, number)

    def _body(self, number: int, own_nodes: list[int], physics: Mapping[int, tuple[str, Row]]) -> SourceBody | None:
        name, frame = self._tree.names[number], rigid_of(self._tree.poses[number])
        # An empty motion is one with all its defaults: that of a body that moves.
        motion = physics[number][1].get("motion", {"type": STATIC})
        to_body = np.linalg.inv(frame)
        solids = (self._collider(node, *physics[node], to_body @ self._tree.poses[node]) for node in own_nodes)
        colliding = [solid for solid in solids if solid is not None]
        for node in own_nodes:
            if "trigger" in physics[node][1]:
                self.left_out.append(f"the trigger of node {self._tree.names[node]!r}")
        drawn = [
            self._tree.in_frame(frame, surface)
            for surface in self._tree.surfaces
            if self._nearest(surface.node, physics) == number
        ]
        if not drawn and not colliding:
            return None
        surfaces = surface_meshes(drawn, colliding, Surface.AUTO)
        moves = motion.get("type") != STATIC
        return SourceBody(name, concatenated_meshes(surfaces), tuple(colliding), frame, moves, mass=motion.get("mass"))

    def _nearest(self, number: int, physics: Mapping[int, tuple[str, Row]]) -> int:
        """The nearest body at a node or above it, or -1."""
        return next((self._body_of(node, physics) for node in self._tree.above(number) if node in physics), -1)

    def _collider(self, node: int, kind: str, physics: Row, to_body: Matrix) -> MeshData | None:
        """The solid of a node in the frame of its body; ``None``: it has none that can be taken."""
        collider = physics.get("collider")
        if collider is None:
            return None
        geometry = collider.get("geometry", collider)
        name = self._tree.names[node]
        if "shape" in geometry:
            row = self._shapes[kind][geometry["shape"]]
            word = str(row.get("type", ""))
            inner = row.get(word, row)
            if word in (*HULLS, "trimesh"):
                solid = self._mesh(int(inner.get("mesh", -1)))
                is_hull, missing = word in HULLS, "its mesh holds no triangle"
            else:
                solid, is_hull, missing = _shape(kind, word, inner), False, f"a shape {word!r}"
        else:
            # Of the drafts one names a mesh, the other a node that holds it.
            solid = (
                self._mesh(int(geometry["mesh"])) if "mesh" in geometry else self._meshes_below(geometry.get("node"))
            )
            is_hull, missing = bool(geometry.get("convexHull")), "it names no shape with a triangle"
        if solid is None:
            self.left_out.append(f"the collider of node {name!r}: {missing}")
            return None
        self._faces += len(solid.faces)
        check_size(0, self._faces)
        placed = solid.transformed(to_body)
        return convex_hull(placed) if is_hull else placed

    def _mesh(self, number: int) -> MeshData | None:
        return read_glb_mesh(self._data, number) if number >= 0 else None

    def _meshes_below(self, node: int | None) -> MeshData | None:
        """All meshes of a node and below it, in its own frame; the node need not hang in the scene."""
        if node is None:
            return None
        tree = self._tree if node in self._tree.reached else read_glb(self._data, root=node, unit_rotations=True)
        surfaces = [surface for surface in tree.surfaces if node in tree.above(surface.node)]
        meshes = [tree.in_frame(tree.poses[node], surface) for surface in surfaces]
        return concatenated_meshes(meshes) if meshes else None


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


def _round_shape(kind: str, word: str, row: Row) -> MeshData | None:
    """A capsule or a cylinder; of two radii the hull of its ends, one of which may be a point; ``None``: neither."""
    radius, capsule_height, cylinder_height = DEFAULTS[kind]
    is_capsule = word == "capsule"
    height = float(row.get("height", capsule_height if is_capsule else cylinder_height))
    if "radius" in row:
        # A file of an older draft: its height is that of the whole.
        return make_shape(word, {"radius": float(row["radius"]), "length": height}, ROUND_FACES)
    return tapered_shape(word, height, float(row.get("radiusBottom", radius)), float(row.get("radiusTop", radius)))


def _meet(first: Row | None, second: Row | None) -> bool:
    """Whether two colliders may collide by their filters; one without a filter collides with all."""
    return first is None or second is None or (_lets(first, second) and _lets(second, first))


def _lets(own: Row, other: Row) -> bool:
    systems = set(other.get("collisionSystems", ()))
    if "collideWithSystems" in own:
        return bool(systems & set(own["collideWithSystems"]))
    return not systems & set(own.get("notCollideWithSystems", ()))
