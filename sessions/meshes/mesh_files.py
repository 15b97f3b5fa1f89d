"""Meshes in and out of files, and their unions: a mesh written as GLB and read again is the same mesh bit for bit.

Only this module of `sessions` imports trimesh and manifold3d, and only when a function needs them.
"""

import io
from collections.abc import Callable, Sequence
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sessions.errors import EmptyMeshError, MeshFileError
from sessions.file_kinds import file_kind
from sessions.input_files import read_bytes
from sessions.mesh_data import MeshData, concatenated_meshes, has_consistent_winding, least_area
from sessions.meshes.glb_tree import GlbTree, read_glb
from sessions.meshes.obj_file import read_obj
from sessions.meshes.off_file import read_off
from sessions.meshes.ply_file import read_ply
from sessions.meshes.polygons import NO_TRIANGLE
from sessions.meshes.stl_text import plain_stl

POLYGON_READERS: Final = {"obj": read_obj, "ply": read_ply, "off": read_off}
"""Formats of polygons are read here, face i staying face i; trimesh regroups and merges, and cuts polygons as fans."""

FILE_TYPES = ("glb", "obj", "stl", "ply", "off")

# Booleans of float32 coordinates leave crumbs at seams: edges of a few ulps. One micrometre removes them; it is a
# thousandth of the thinnest glass wall here and half of the distance below which an audit calls a contact undecided
# (2 um).
SEAM_TOLERANCE = 1e-6
SEAM_ATTEMPTS = 8  # up to a quarter of a millimetre, a tenth of the thinnest rod
LEAST_AREA = 1e-13  # m2; an edge of 1 um times one of 0.2 um: anything less is a crumb of a seam


def load_mesh(path: str | Path, scale: float = 1.0, node: str = "") -> MeshData:
    """Read a mesh file (GLB, OBJ, STL, PLY or OFF) as one mesh; faces keep the order of the file.

    Parts of a GLB scene are placed by their nodes and joined, in file order. A polygon of n corners becomes n - 2
    triangles between them, where it stands in the order. Nothing is merged, repaired or dropped, with one exception:
    corners of an STL, a format without shared vertices, are shared where they are bit-identical.

    Parameters
    ----------
    path : the file; its ending says its type.
    scale : metres per unit of the file (0.01 for a file in centimetres).
    node : of a GLB only what hangs on the node or joint of this name, in its frame; ``""``: everything.

    Raises ``MeshFileError``: when the file is missing, empty, damaged, of an unknown type, or holds no triangle.
    """
    file = Path(path)
    file_type = file.suffix.lower().removeprefix(".")
    if file_type not in FILE_TYPES:
        raise MeshFileError(
            f"mesh file {file} is of no known type; use one of: {', '.join('.' + t for t in FILE_TYPES)}"
        )
    data = read_bytes(file, "mesh file", MeshFileError)
    try:
        return mesh_from_bytes(data, file_type, scale, node)
    except MeshFileError as error:
        raise type(error)(f"mesh file {file}: {error}") from None


def mesh_from_bytes(data: bytes, file_type: str, scale: float = 1.0, node: str = "") -> MeshData:
    """Read one mesh from the bytes of a file; errors as in `load_mesh`."""
    kind = file_type.lower().removeprefix(".")
    if not np.isfinite(scale) or scale <= 0:
        raise MeshFileError(f"scale is {scale}; give the metres per unit of the file, a positive number")
    if not data:
        raise EmptyMeshError("the mesh file is empty; export it again")
    try:
        with np.errstate(all="ignore"):  # what is not finite is refused, and no warning about it helps
            vertices, faces = _read(data, kind, node)
    except MeshFileError:
        _refuse_other_kind(data, kind)
        raise
    except Exception as error:  # parsers of foreign files raise errors of any kind; each means: damaged
        _refuse_other_kind(data, kind)
        reason = f"it lacks {error}" if isinstance(error, KeyError) else str(error) or type(error).__name__
        raise MeshFileError(f"this is no readable {kind.upper()} ({reason}); export it again") from error
    if kind == "stl":
        vertices, faces = _weld_equal_vertices(vertices, faces)
    return MeshData(vertices * scale, faces)


def _refuse_other_kind(data: bytes, kind: str) -> None:
    """Refuse the bytes of another kind of file by name; ``kind`` is what the file's name says."""
    other = file_kind(data)
    if other is not None and not (kind == "glb" and data.startswith(b"glTF")):
        raise MeshFileError(f"it is {other.noun}, no {kind.upper()}; {other.cure}")


def _read(data: bytes, kind: str, node: str) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    if node and kind != "glb":
        raise MeshFileError(f"a {kind.upper()} has no nodes; name a GLB, or leave the node out")
    if kind == "glb":
        return _read_glb(data, node)
    if kind in POLYGON_READERS:
        return POLYGON_READERS[kind](data).triangulated()
    return _read_with_trimesh(plain_stl(data) if kind == "stl" else data, kind)


def united_mesh(meshes: Sequence[MeshData]) -> MeshData:
    """Return the closed surface of the union of closed meshes; raises `MeshFileError` when one is not closed."""
    return _boolean(meshes, lambda a, b: a + b)


def subtracted_mesh(mesh: MeshData, others: Sequence[MeshData]) -> MeshData:
    """Return the closed ``mesh`` without the insides of ``others``; raises `MeshFileError` when one is not closed."""
    return _boolean([mesh, *others], lambda a, b: a - b)


def outward(mesh: MeshData) -> MeshData:
    """Return the mesh with faces that wind alike, and outwards where a part is closed; their order stays."""
    trimesh = _trimesh()

    solid = trimesh.Trimesh(mesh.vertices.copy(), mesh.faces.copy(), process=False)
    trimesh.repair.fix_normals(solid, multibody=True)
    return MeshData(mesh.vertices, solid.faces)


def refined_mesh(mesh: MeshData, length: float) -> MeshData:
    """Return the closed mesh with edges split to about ``length`` metres; the surface stays where it is.

    The thinnest triangles of a seam, split and rounded to float32, can lose their area: then the seam is simplified
    first, by the smallest tolerance that helps.
    """
    solid, tolerance = _to_manifold(mesh), SEAM_TOLERANCE
    fine = _from_manifold(solid.refine_to_length(length))
    for _ in range(SEAM_ATTEMPTS):
        if least_area(fine) > LEAST_AREA:
            break
        tolerance *= 2.0
        fine = _from_manifold(solid.simplify(tolerance).refine_to_length(length))
    return fine


def simplified_mesh(mesh: MeshData, tolerance: float) -> MeshData:
    """Return the closed mesh with fewer faces, its surface moved by less than ``tolerance`` metres."""
    return _from_manifold(_to_manifold(mesh).simplify(tolerance))


def volume_beyond_plane(mesh: MeshData) -> Callable[[ArrayLike, float], float]:
    """Return the function of a normal and an offset that gives the volume of a closed mesh beyond that plane.

    Beyond lie the points p with ``p . normal`` above ``offset``.
    """
    solid = _to_manifold(mesh)
    return lambda normal, offset: float(
        solid.trim_by_plane(tuple(np.asarray(normal, dtype=np.float64)), offset).volume()
    )


def _boolean(meshes: Sequence[MeshData], join: Callable[[Any, Any], Any]) -> MeshData:
    result = _to_manifold(meshes[0])
    for mesh in meshes[1:]:
        result = join(result, _to_manifold(mesh))
    return _from_manifold(result.simplify(SEAM_TOLERANCE))


def _to_manifold(mesh: MeshData) -> Any:
    from manifold3d import Manifold, Mesh

    if not has_consistent_winding(mesh):
        raise MeshFileError("a union needs closed meshes with consistent winding; close the mesh first")
    return Manifold(Mesh(vert_properties=mesh.vertices.astype(np.float32), tri_verts=mesh.faces.astype(np.uint32)))


def _from_manifold(solid: Any) -> MeshData:
    mesh = solid.to_mesh()
    return MeshData(mesh.vert_properties[:, :3], mesh.tri_verts.astype(np.int64))


@cache
def _trimesh() -> Any:
    """The library, which takes longer to load than most files take to read."""
    import logging

    import trimesh

    # Of a damaged part that nothing here uses, such as the normals of an STL, trimesh logs a traceback; where nobody
    # set up logging, Python would print it on stderr.
    logging.getLogger("trimesh").addHandler(logging.NullHandler())
    return trimesh


def _read_with_trimesh(data: bytes, kind: str) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    trimesh = _trimesh()

    scene = trimesh.load_scene(io.BytesIO(data), file_type=kind, process=False)
    meshes = [
        MeshData(item.vertices, item.faces) for item in scene.geometry.values() if len(getattr(item, "faces", ()))
    ]
    if not meshes:
        raise EmptyMeshError(NO_TRIANGLE)
    whole = concatenated_meshes(meshes)
    return whole.vertices, whole.faces


def _read_glb(data: bytes, node: str) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    tree = read_glb(data)
    if not node:
        _refuse_other_surfaces(tree)
    mesh = tree.below(node) if node else tree.whole()
    if mesh is None:
        near = get_close_matches(node, tree.owners, n=1) or tree.owners[:8]
        raise MeshFileError(f"no mesh hangs on a node {node!r}; there are: {', '.join(near)}")
    return mesh.vertices, mesh.faces


def _refuse_other_surfaces(tree: GlbTree) -> None:
    """Refuse a file in which hidden nodes or colliders of Unreal's names are beside the surface of a body."""
    colliders = [tree.names[surface.node] for surface in tree.surfaces if tree.is_collider(surface)]
    if 0 < len(colliders) < len(tree.surfaces):
        raise MeshFileError(
            f"it holds the collider {colliders[0]!r} beside the surface; take it by --colliders, and the surface by "
            "--meshes, which looks for a node of the body's name"
        )
    hidden = [tree.names[surface.node] for surface in tree.surfaces if surface.node in tree.hidden]
    if 0 < len(hidden) < len(tree.surfaces):
        raise MeshFileError(f"its node {hidden[0]!r} is hidden; show it, or export without it")


def _weld_equal_vertices(
    vertices: NDArray[np.float64], faces: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    _, first, inverse = np.unique(vertices, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    new_index = np.empty_like(order)
    new_index[order] = np.arange(len(order))
    return vertices[first[order]], new_index[inverse.reshape(-1)[faces]]
