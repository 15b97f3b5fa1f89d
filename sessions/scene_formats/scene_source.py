"""A scene of another program as this project takes it: bodies with surfaces and colliders, poses, excluded pairs.

Every format fills the same record; what it cannot hold is named in ``left_out``, never dropped without a word.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sessions.errors import SceneSourceError
from sessions.mesh_data import MeshData
from sessions.meshes.hull import convex_hull
from sessions.model.assumption import Assumption, Origin, Subject
from sessions.model.scene import Pose, SceneBody

Matrix = NDArray[np.float64]

Y_UP_OF_Z_UP: Final = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""Rotates a world with +Z up into one with +Y up: exact, a swap of two axes and a sign."""

COVERED: Final = 0.9
"""A drawn surface is that of the body if its box fills so much of the colliders' box along each axis."""


MOST_BODIES: Final = 5_000
"""The largest scene that was seen, a hundred humanoids, has 1,600; pairs grow with the square."""
MOST_FACES: Final = 20_000_000
"""Of all surfaces and colliders: a scene of a few bytes may place one mesh any number of times."""


def check_size(bodies: int, faces: int = 0) -> None:
    """Refuses a scene that would fill the memory: `SceneSourceError`."""
    if bodies > MOST_BODIES or faces > MOST_FACES:
        raise SceneSourceError(
            f"the scene places more than {MOST_BODIES:,} bodies or {MOST_FACES:,} faces; leave out what does not matter"
        )


class Surface(StrEnum):
    """The geometry of a body that its surface is made of."""

    AUTO = "auto"
    """What is drawn, where it fills the colliders' box, else what collides: bones in a skin of capsules are no skin."""
    DRAWN = "drawn"
    COLLIDING = "colliding"


@dataclass(frozen=True)
class SourceBody:
    """A body of a scene in its own frame.

    Parameters
    ----------
    name : its name there; ``body-3`` of one without a name.
    mesh : its surface, metres, in the frame of the body.
    colliders : the solids that its program tests, of which each convex hull collides; ``()``: the surface itself.
    pose : (4, 4) in the world at rest, in the axes of the scene.
    moves : whether a joint can move it.
    margin : metres from which its program reports contact.
    mass : kilograms, or ``None``.
    surface : ``drawn`` or ``colliding``, of a body that has geometry of both kinds; else ``""``.
    """

    name: str
    mesh: MeshData
    colliders: tuple[MeshData, ...]
    pose: Matrix
    moves: bool
    margin: float = 0.0
    mass: float | None = None
    surface: str = ""

    def declared(self, rotation: Matrix, axes: Matrix | None = None) -> SceneBody:
        """Returns its declaration, in a world rotated by ``rotation``; a body that no joint moves is fixed there.

        ``axes`` (3, 3): what the body's own axes are rotated by; ``None``: they stay as they are.
        """
        pose = self.pose.copy()
        pose[:3, :3] = pose[:3, :3] if axes is None else pose[:3, :3] @ axes.T
        extra = {key: value for key, value in (("margin", self.margin), ("mass", self.mass)) if value}
        return SceneBody(self.name, fixed=None if self.moves else pose_of(pose, rotation), extra=extra)


@dataclass(frozen=True)
class SceneSource:
    """A scene of another program.

    Parameters
    ----------
    format : ``MJCF``, ``URDF``, ``USD`` or ``glTF``.
    bodies : by name, in the order of the file.
    excluded : pairs of bodies that never collide there.
    left_out : sentences on what cannot be taken.
    rotation : (3, 3) from the axes of its world to +Y up.
    notes : sentences on how it was taken, where the file leaves that open.
    """

    format: str
    bodies: Mapping[str, SourceBody]
    excluded: tuple[tuple[str, str], ...] = ()
    left_out: tuple[str, ...] = ()
    rotation: Matrix = field(default_factory=lambda: np.eye(3))
    notes: tuple[str, ...] = ()


def read_scene_source(path: str | Path, root: str | Path | None = None, surface: Surface = Surface.AUTO) -> SceneSource:
    """Reads a scene of another program by the ending of its file, and an XML file by its first element.

    Parameters
    ----------
    root : the folder that all files of the scene lie in; nothing outside is read. ``None``: that of the file.
    surface : of which geometry the surfaces of bodies are made, where a format has several kinds.

    Raises ``SceneSourceError``: no scene of a known format, a file outside the folder, or one that is damaged.
    """
    source = _read(Path(path), root, surface)
    if not source.bodies:
        left_out = "".join(f"; not taken: {sentence}" for sentence in dict.fromkeys(source.left_out))
        raise SceneSourceError(f"{path} has no body that collides{left_out}; give a scene with colliders")
    return source


def _read(file: Path, root: str | Path | None, surface: Surface) -> SceneSource:
    from sessions.scene_formats.safe_files import SceneFiles

    files = SceneFiles(file.parent if root is None else Path(root))
    kind = file.suffix.lower()
    if kind in (".glb", ".gltf"):
        from sessions.scene_formats.gltf_physics import read_gltf

        return read_gltf(file, files)
    if kind in (".usd", ".usda", ".usdc", ".usdz"):
        from sessions.scene_formats.usd_physics import read_usd_scene

        return read_usd_scene(file, files, surface)
    if kind not in (".xml", ".mjcf", ".urdf"):
        raise SceneSourceError(
            f"{file} is no scene of a known format; give MJCF (.xml), URDF (.urdf), USD (.usd) or glTF (.glb)"
        )
    tag = files.xml(file).tag
    if tag == "mujoco":
        from sessions.scene_formats.mjcf import read_mjcf_scene

        return read_mjcf_scene(file, files, surface)
    if tag == "robot":
        from sessions.scene_formats.urdf import read_urdf

        return read_urdf(file, files, surface)
    if tag == "mujocoinclude":
        raise SceneSourceError(f"{file} is a part that MJCF files include; give the file that includes it")
    raise SceneSourceError(f"{file} begins with <{tag}>; a scene begins with <mujoco> (MJCF) or <robot> (URDF)")


def surface_and_colliders(
    drawn: list[MeshData], colliding: list[MeshData], surface: Surface
) -> tuple[list[MeshData], tuple[MeshData, ...]]:
    """Returns of which parts a body's surface is made, and its colliders; both kinds are in the frame of the body."""
    return surface_meshes(drawn, colliding, surface), tuple(map(convex_hull, colliding))


def surface_meshes(drawn: list[MeshData], colliding: list[MeshData], surface: Surface) -> list[MeshData]:
    """Returns of which parts a body's surface is made."""
    if not drawn or not colliding:
        return colliding or drawn
    return drawn if chosen_surface(drawn, colliding, surface) == Surface.DRAWN else colliding


def chosen_surface(drawn: list[MeshData], colliding: list[MeshData], surface: Surface) -> str:
    """Returns which geometry a body's surface is made of; ``""``: it has one kind alone."""
    if not drawn or not colliding:
        return ""
    if surface is not Surface.AUTO:
        return str(surface)
    is_whole = (_extent(drawn) >= COVERED * _extent(colliding)).all()
    return str(Surface.DRAWN if is_whole else Surface.COLLIDING)


def surface_assumptions(source: "SceneSource", requested: Surface) -> tuple[Assumption, ...]:
    """Returns which geometry the surfaces of bodies are made of, a row for each kind, and who says it."""
    reasons = {
        str(Surface.DRAWN): "what is drawn fills the box of the colliders",
        str(Surface.COLLIDING): "what is drawn is smaller than the colliders",
    }
    is_guess = requested is Surface.AUTO
    return tuple(
        Assumption(
            subject=Subject.SURFACE,
            value=kind,
            origin=Origin.GUESS if is_guess else Origin.USER,
            bodies=bodies,
            reason=reason if is_guess else "",
        )
        for kind, reason in reasons.items()
        if (bodies := tuple(name for name, body in source.bodies.items() if body.surface == kind))
    )


def _extent(meshes: list[MeshData]) -> Matrix:
    corners = np.concatenate([mesh.bounds for mesh in meshes])
    return np.asarray(corners.max(axis=0) - corners.min(axis=0))


def pose_of(matrix: Matrix, rotation: Matrix) -> Pose:
    """Returns the pose of a body in a world that is rotated; the body's own axes stay as they are."""
    from scipy.spatial.transform import Rotation

    x, y, z = (rotation @ matrix[:3, 3]).tolist()
    quaternion = Rotation.from_matrix(rotation @ matrix[:3, :3]).as_quat().tolist()
    return Pose((x, y, z), (quaternion[0], quaternion[1], quaternion[2], quaternion[3]))
