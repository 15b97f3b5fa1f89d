"""URDF: links with their visual and collision geometry, in the pose of all joints at zero, which yourdfpy computes.

yourdfpy gets the links without their geometry: one shape that it does not know would end the whole reading.

``package://NAME/PATH`` is looked for, from the file's folder up to the scene's, in a folder that is called NAME, that
holds a folder NAME, or whose ``package.xml`` says NAME.
"""

import copy
import io
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, Final
from urllib.parse import unquote
from xml.etree import ElementTree

import numpy as np

from sessions.errors import MeshFileError, SceneError, SceneSourceError
from sessions.geometry.shapes import make_shape
from sessions.mesh_data import MeshData, concatenated_meshes
from sessions.meshes.mesh_files import load_mesh
from sessions.scene_formats.safe_files import SceneFiles
from sessions.scene_formats.scene_source import (
    Y_UP_OF_Z_UP,
    Matrix,
    SceneSource,
    SourceBody,
    Surface,
    check_size,
    chosen_surface,
    surface_and_colliders,
)

PACKAGE, FILE = "package://", "file://"
ROUND_FACES: Final = 4000
FIXED: Final = "fixed"
SOFT: Final = frozenset(("deformable", "reduced_deformable"))
"""Elements of a soft body, as Bullet writes them."""
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
    document = files.xml(path)
    elements = {str(link.get("name")): link for link in document.iter("link")}
    check_size(len(elements))
    try:
        stream = io.BytesIO(ElementTree.tostring(_bare(document)))
        model = yourdfpy.URDF.load(stream, load_meshes=False, build_scene_graph=True)
        joints = _from_the_root(model.robot.joints)
        poses = _poses(model, joints)
    except Exception as error:  # of another package: any error means that it cannot be read
        raise SceneSourceError(f"yourdfpy does not read {path}: {error}; correct it") from error
    left_out = [f"the soft body {child.get('name', '')!r}" for child in document if child.tag in SOFT]
    bodies, faces = dict[str, SourceBody](), 0
    moving = _moving_links(joints)
    for link in model.robot.links:
        drawn = [*_meshes(link.name, elements[link.name].findall("visual"), path, files, left_out)]
        colliding = [*_meshes(link.name, elements[link.name].findall("collision"), path, files, left_out)]
        if not drawn and not colliding:
            continue
        faces += sum(len(mesh.faces) for mesh in (*drawn, *colliding))
        check_size(len(bodies), faces)
        surfaces, solids = surface_and_colliders(drawn, colliding, surface)
        mass = None if link.inertial is None else link.inertial.mass
        pose = np.array(poses[link.name], dtype=np.float64)
        kind = chosen_surface(drawn, colliding, surface)
        bodies[link.name] = SourceBody(
            link.name, concatenated_meshes(surfaces), solids, pose, link.name in moving, mass=mass, surface=kind
        )
    joined = [(joint.parent, joint.child) for joint in model.robot.joints]
    excluded = tuple(pair for pair in joined if bodies.keys() >= {*pair})
    return SceneSource("URDF", bodies, excluded, tuple(left_out), Y_UP_OF_Z_UP)


def _from_the_root(joints: Iterable[Any]) -> list[Any]:
    """The joints in an order in which each comes after the one above it; those of a circle are left out."""
    below = defaultdict[str, list[Any]](list)
    for joint in joints:
        below[joint.parent].append(joint)
    children = {joint.child for rows in below.values() for joint in rows}
    waiting = [joint for parent, rows in below.items() if parent not in children for joint in rows]
    ordered, reached = [], set[str]()
    while waiting:
        joint = waiting.pop()
        if joint.child not in reached:
            reached.add(joint.child)
            ordered.append(joint)
            waiting += below[joint.child]
    return ordered


def _poses(model: Any, joints: Sequence[Any]) -> dict[str, Matrix]:
    """The pose of each link in the frame of the root.

    The library searches its graph for each link that is far from the root, 0.3 s for one of a chain of 300 (2026-11),
    so it is asked for neighbours alone.
    """
    below = {joint.child for joint in joints}
    poses = {link.name: model.get_transform(link.name) for link in model.robot.links if link.name not in below}
    for joint in joints:
        poses[joint.child] = poses[joint.parent] @ model.get_transform(joint.child, joint.parent)
    return poses


def _moving_links(joints: Iterable[Any]) -> set[str]:
    """Links that a joint moves, itself or by a link above; the joints come from the root on."""
    moving = set[str]()
    for joint in joints:
        if joint.type != FIXED or joint.parent in moving:
            moving.add(joint.child)
    return moving


def _bare(document: ElementTree.Element) -> ElementTree.Element:
    """The robot with links and joints alone, and links without geometry."""
    robot = copy.deepcopy(document)
    robot[:] = [child for child in robot if child.tag in ("link", "joint")]
    for link in robot.iter("link"):
        link[:] = [child for child in link if child.tag == "inertial"]
    return robot


def _meshes(
    link: str, elements: Iterable[ElementTree.Element], path: Path, files: SceneFiles, left_out: list[str]
) -> Iterator[MeshData]:
    for element in elements:
        try:
            shape = next(iter(element.find("geometry") or ()), None)
            mesh = _mesh(shape, path, files)
            origin = _origin(element.find("origin"))
        except (MeshFileError, SceneError, ValueError) as error:
            left_out.append(f"a geometry of link {link!r}: {error}")
            continue
        yield mesh.transformed(origin)


def _origin(element: ElementTree.Element | None) -> Matrix:
    from scipy.spatial.transform import Rotation

    pose = np.eye(4)
    if element is not None:
        pose[:3, 3] = _numbers(element, "xyz", "0 0 0")
        pose[:3, :3] = Rotation.from_euler("xyz", _numbers(element, "rpy", "0 0 0")).as_matrix()
    return pose


def _numbers(element: ElementTree.Element, name: str, default: str) -> list[float]:
    """Three numbers of an attribute."""
    text = element.get(name, default)
    numbers = [float(word) for word in text.split()]
    if len(numbers) != 3 or not np.isfinite(numbers).all():
        raise ValueError(f"{name} is {text[:40]!r}, not three numbers")
    return numbers


def _length(element: ElementTree.Element, name: str) -> float:
    text = element.get(name)
    if text is None:
        raise ValueError(f"its {element.tag} has no {name}")
    return float(text)


def _mesh(element: ElementTree.Element | None, path: Path, files: SceneFiles) -> MeshData:
    if element is None:
        raise SceneError("it has no shape")
    kind = str(element.tag)
    if kind == "box":
        return make_shape("box", dict(zip("xyz", _numbers(element, "size", ""), strict=True)))
    if kind == "sphere":
        return make_shape("sphere", {"radius": _length(element, "radius")}, ROUND_FACES)
    if kind in ("cylinder", "capsule"):
        radius, length = _length(element, "radius"), _length(element, "length")
        # The length of a capsule is that between the middles of its ends: Bullet, Drake, MuJoCo's own URDF reader.
        whole = length + 2.0 * radius if kind == "capsule" else length
        mesh = make_shape(kind, {"radius": radius, "length": whole}, ROUND_FACES)
        return MeshData(mesh.vertices @ Z_OF_Y.T, mesh.faces)
    if kind != "mesh":
        raise SceneError(f"its shape is a {kind}; there are box, sphere, cylinder, capsule and mesh")
    name = element.get("filename", "")
    mesh = load_mesh(files.inside(_mesh_file(name, path, files), f"the mesh {name!r}"))
    scale = np.array(_numbers(element, "scale", "1 1 1"))
    # A mirror turns faces inside out.
    faces = mesh.faces[:, ::-1] if np.prod(scale) < 0.0 else mesh.faces
    return MeshData(mesh.vertices * scale, faces)


def _mesh_file(name: str, path: Path, files: SceneFiles) -> Path:
    """The place of a mesh file that a URDF names."""
    if not name.startswith(PACKAGE):
        # A file URI is percent-encoded, a path is not.
        return path.parent / (unquote(name.removeprefix(FILE)) if name.startswith(FILE) else name)
    package, _, inner = name.removeprefix(PACKAGE).partition("/")
    folders = [path.resolve().parent, *path.resolve().parents]
    for folder in dict.fromkeys(folder for folder in folders if folder.is_relative_to(files.root)):
        if folder.name == package or _package_name(folder, files) == package:
            return folder / inner
        if (folder / package).is_dir():
            return folder / package / inner
    return files.root / package / inner


def _package_name(folder: Path, files: SceneFiles) -> str:
    """The name of a ROS package by its manifest; empty: it is none."""
    manifest = folder / "package.xml"
    if not manifest.is_file():
        return ""
    try:
        return (files.xml(manifest).findtext("name") or "").strip()
    except SceneSourceError:
        return ""
