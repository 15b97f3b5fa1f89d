"""Surfaces of USD's geometry and the solids that physics makes of it, in the frame of the prim, in units of the stage.

Source: the schemas UsdGeom and UsdPhysics of OpenUSD. A round shape whose scale differs along its axes is drawn as an
ellipsoid and collides as the round shape of its largest radius, as UsdPhysics reads it.
"""

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from sessions.errors import MeshFileError, SceneError
from sessions.geometry.shapes import make_shape
from sessions.mesh_data import MeshData
from sessions.meshes.hull import convex_hull
from sessions.meshes.polygons import PolygonMesh
from sessions.scene_formats.round_shapes import ROUND_FACES, tapered_shape

Array = NDArray[np.float64]

ROUND: Final = ("Sphere", "Capsule", "Capsule_1", "Cylinder", "Cylinder_1", "Cone")
TAKEN: Final = ("Mesh", "Cube", *ROUND)
"""Types of prims that have a surface here."""
NOT_TAKEN: Final = {"Plane": "an endless plane"}
FROM_Y: Final = {
    "X": np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
    "Y": np.eye(3),
    "Z": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]),
}
"""Lays a shape along +Y along the axis of a prim."""
ENGINES_OWN: Final = {
    "convexDecomposition": "the convex pieces of {}, which an engine cuts itself: its mesh collides",
    "meshSimplification": "the simplified mesh of {}, which an engine makes itself: its mesh collides",
    "boundingCube": "the fitted box of {}, which an engine may rotate: a box along its own axes collides",
    "boundingSphere": "the fitted sphere of {}, which an engine may shrink: a sphere around its box's middle collides",
}
"""Approximations that a file names and engines compute, each in its own way."""


def drawn_mesh(usd: Any, prim: Any, time: Any) -> MeshData:
    """The surface of a prim; a round one is inscribed in the true shape.

    Raises ``SceneError`` or ``MeshFileError``: it has none that can be taken.
    """
    if prim.GetTypeName() == "Mesh":
        return _mesh(usd.UsdGeom.Mesh(prim), time)
    return _shape(prim, time, np.ones(3))


def solid_mesh(usd: Any, prim: Any, time: Any, scale: Array, left_out: list[str]) -> MeshData:
    """The solid that collides for a prim, scaled along its own axes.

    ``left_out`` gets a sentence on what an engine would compute. Raises as `drawn_mesh`.
    """
    if prim.GetTypeName() != "Mesh":
        return _shape(prim, time, np.abs(scale))
    mesh = _mesh(usd.UsdGeom.Mesh(prim), time)
    faces = mesh.faces if np.prod(scale) > 0.0 else mesh.faces[:, ::-1]
    mesh = MeshData(mesh.vertices * scale, faces)
    approximation = _approximation(usd, prim, time)
    if approximation in ENGINES_OWN:
        left_out.append(ENGINES_OWN[approximation].format(repr(str(prim.GetPath()))))
    if approximation in ("none", "convexDecomposition", "meshSimplification"):
        return mesh
    if approximation == "convexHull":
        return convex_hull(mesh)
    lower, upper = mesh.bounds
    if approximation == "boundingCube":
        box = make_shape("box", dict(zip("xyz", (upper - lower).tolist(), strict=True)))
        return MeshData(box.vertices + (lower + upper) / 2.0, box.faces)
    if approximation == "boundingSphere":
        middle = (lower + upper) / 2.0
        radius = float(np.linalg.norm(mesh.vertices - middle, axis=1).max())
        ball = make_shape("sphere", {"radius": radius}, ROUND_FACES)
        return MeshData(ball.vertices + middle, ball.faces)
    raise SceneError(f"its mesh collides as {approximation!r}")


def _approximation(usd: Any, prim: Any, time: Any) -> str:
    if "PhysxSDFMeshCollisionAPI" in prim.GetPrimTypeInfo().GetAppliedAPISchemas():
        return "sdf"
    if not prim.HasAPI(usd.UsdPhysics.MeshCollisionAPI):
        return "none"
    return str(usd.UsdPhysics.MeshCollisionAPI(prim).GetApproximationAttr().Get(time) or "none")


def _mesh(mesh: Any, time: Any) -> MeshData:
    """The faces of a mesh as triangles, without its holes, wound outwards."""
    points, counts, indices = (
        np.array([] if value is None else value)
        for value in (
            mesh.GetPointsAttr().Get(time),
            mesh.GetFaceVertexCountsAttr().Get(time),
            mesh.GetFaceVertexIndicesAttr().Get(time),
        )
    )
    if not len(points) or not (counts >= 3).any():
        raise MeshFileError("its mesh has no face")
    if counts.min() < 0 or int(counts.sum(dtype=np.int64)) != len(indices):
        raise MeshFileError(f"its mesh has {len(indices):,} indices, and its faces count {int(counts.sum()):,}")
    outside = np.flatnonzero((indices < 0) | (indices >= len(points)))
    if len(outside):
        face = int(np.searchsorted(np.cumsum(counts, dtype=np.int64), outside[0], side="right"))
        raise MeshFileError(f"face {face} names vertex {indices[outside[0]]} of a mesh with {len(points):,} vertices")
    is_face = np.ones(len(counts), dtype=np.bool_)
    holes = np.array(mesh.GetHoleIndicesAttr().Get(time) or (), dtype=np.int64)
    is_face[holes[(holes >= 0) & (holes < len(counts))]] = False
    if not (counts[is_face] >= 3).any():
        raise MeshFileError("its mesh is nothing but holes")
    corners = indices[np.repeat(is_face, counts)]
    polygons = PolygonMesh(points.astype(np.float64), corners.astype(np.int64), counts[is_face].astype(np.int64))
    vertices, faces = polygons.triangulated()
    if mesh.GetOrientationAttr().Get(time) == "leftHanded":
        faces = faces[:, ::-1]
    return MeshData(vertices, faces)


def _shape(prim: Any, time: Any, scale: Array) -> MeshData:
    """A plain shape, its sizes multiplied by a scale (3,) along its own axes."""
    kind = prim.GetTypeName()
    if kind in NOT_TAKEN:
        raise SceneError(NOT_TAKEN[kind])
    if kind not in TAKEN:
        raise SceneError(f"a shape {kind!r}")
    if kind == "Cube":
        size = (_number(prim, "size", time) * scale).tolist()
        return make_shape("box", dict(zip("xyz", size, strict=True)))
    if kind == "Sphere":
        return make_shape("sphere", {"radius": _number(prim, "radius", time) * float(scale.max())}, ROUND_FACES)
    axis = str(prim.GetAttribute("axis").Get(time))
    if axis not in FROM_Y:
        raise SceneError(f"an axis {axis!r}")
    along = "XYZ".index(axis)
    height = _number(prim, "height", time) * float(scale[along])
    lower, upper = (radius * float(np.delete(scale, along).max()) for radius in _radii(prim, kind, time))
    solid = tapered_shape("capsule" if kind.startswith("Capsule") else "cylinder", height, lower, upper)
    if solid is None:
        raise SceneError(f"a {kind} without a height or a radius")
    return MeshData(solid.vertices @ FROM_Y[axis].T, solid.faces)


def _radii(prim: Any, kind: str, time: Any) -> tuple[float, float]:
    """The radii of the lower and the upper end of a round shape."""
    if kind.endswith("_1"):
        return _number(prim, "radiusBottom", time), _number(prim, "radiusTop", time)
    radius = _number(prim, "radius", time)
    return radius, 0.0 if kind == "Cone" else radius


def _number(prim: Any, name: str, time: Any) -> float:
    return float(prim.GetAttribute(name).Get(time))
