"""URDF, read by yourdfpy: links with their visual and collision geometry, in the pose of all joints at zero.

``package://NAME/PATH`` is looked for in a folder NAME within the scene's folder, or in that folder if it is NAME.
"""

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np

from sessions.errors import MeshFileError, SceneError, SceneSourceError
from sessions.geometry.shapes import make_shape
from sessions.mesh_data import MeshData, concatenated
from sessions.meshes.mesh_files import load_mesh
from sessions.scene_formats.safe_files import SceneFiles
from sessions.scene_formats.scene_source import (
    Y_UP_OF_Z_UP,
    SceneSource,
    SourceBody,
    Surface,
    chosen_surface,
    surface_and_colliders,
)

PACKAGE, FILE = "package://", "file://"
ROUND_FACES: Final = 4000
FIXED: Final = "fixed"
Z_OF_Y: Final = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""Lays a shape along +Y along +Z, where URDF has it."""


def read_urdf(path: Path, files: SceneFiles, surface: Surface) -> SceneSource:
    """The scene of a URDF.

    Raises ``SceneSourceError``: yourdfpy is not installed or does not read it, or a mesh is outside the folder.
    """
    try:
        import yourdfpy
    except ImportError as error:
        raise SceneSourceError('URDF needs yourdfpy; install it: pip install "vrlab-replay[formats]"') from error
    try:
        model = yourdfpy.URDF.load(str(path), load_meshes=False, build_scene_graph=True)
        poses = {link.name: model.get_transform(link.name) for link in model.robot.links}
    except Exception as error:  # of another package: any error means that it cannot be read
        raise SceneSourceError(f"yourdfpy does not read {path}: {error}; correct it") from error
    left_out = list[str]()
    bodies: dict[str, SourceBody] = {}
    moving = _moving(model.robot.joints)
    for link in model.robot.links:
        drawn = [*_meshes(link.name, link.visuals, path, files, left_out)]
        colliding = [*_meshes(link.name, link.collisions, path, files, left_out)]
        if not drawn and not colliding:
            continue
        parts, solids = surface_and_colliders(drawn, colliding, surface)
        mass = None if link.inertial is None else link.inertial.mass
        pose = np.array(poses[link.name], dtype=np.float64)
        kind = chosen_surface(drawn, colliding, surface)
        bodies[link.name] = SourceBody(
            link.name, concatenated(parts), solids, pose, link.name in moving, mass=mass, surface=kind
        )
    joined = [(joint.parent, joint.child) for joint in model.robot.joints]
    excluded = tuple(pair for pair in joined if bodies.keys() >= {*pair})
    return SceneSource("URDF", bodies, excluded, tuple(left_out), Y_UP_OF_Z_UP)


def _moving(joints: Iterable[Any]) -> set[str]:
    """Links that a joint moves, itself or by a link above."""
    above = {joint.child: joint for joint in joints}
    moving = set[str]()
    for child in above:
        chain, link = list[str](), child
        while link in above and link not in chain:
            chain.append(link)
            if above[link].type != FIXED:
                moving.add(child)
            link = above[link].parent
    return moving


def _meshes(
    link: str, elements: Iterable[Any], path: Path, files: SceneFiles, left_out: list[str]
) -> Iterator[MeshData]:
    for element in elements:
        geometry = element.geometry
        try:
            mesh = _mesh(geometry, path, files)
        except (MeshFileError, SceneError) as error:
            left_out.append(f"a geometry of link {link!r}: {error}")
            continue
        origin = np.eye(4) if element.origin is None else np.array(element.origin, dtype=np.float64)
        yield mesh.transformed(origin)


def _mesh(geometry: Any, path: Path, files: SceneFiles) -> MeshData:
    if geometry.box is not None:
        x, y, z = (float(size) for size in geometry.box.size)
        return make_shape("box", {"x": x, "y": y, "z": z})
    if geometry.sphere is not None:
        return make_shape("sphere", {"radius": float(geometry.sphere.radius)}, ROUND_FACES)
    if geometry.cylinder is not None:
        size = {"radius": float(geometry.cylinder.radius), "length": float(geometry.cylinder.length)}
        mesh = make_shape("cylinder", size, ROUND_FACES)
        return MeshData(mesh.vertices @ Z_OF_Y.T, mesh.faces)
    if geometry.mesh is None:
        raise SceneError("it is neither box, sphere, cylinder nor mesh")
    name = str(geometry.mesh.filename)
    mesh = load_mesh(files.inside(_mesh_file(name, path, files), f"the mesh {name!r}"))
    scale = np.broadcast_to(1.0 if geometry.mesh.scale is None else np.asarray(geometry.mesh.scale, float), (3,))
    # A mirror turns faces inside out.
    faces = mesh.faces[:, ::-1] if np.prod(scale) < 0.0 else mesh.faces
    return MeshData(mesh.vertices * scale, faces)


def _mesh_file(name: str, path: Path, files: SceneFiles) -> Path:
    """The place of a mesh file that a URDF names."""
    if name.startswith(PACKAGE):
        package, _, inner = name.removeprefix(PACKAGE).partition("/")
        folders = [path.resolve().parent, *path.resolve().parents]
        above = [folder for folder in folders if folder.name == package and folder.is_relative_to(files.root)]
        return (above[0] if above else files.root / package) / inner
    return path.parent / name.removeprefix(FILE)
