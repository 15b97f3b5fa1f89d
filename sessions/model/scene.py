"""A scene declares bodies with their shapes, the pairs that matter, and the effects to replay."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import Any, Final

from sessions.model.constants import SPACE_RADIUS

TAG: Final = "tag:"
"""Begins a selector of the bodies that have a tag."""

WILDCARDS: Final = frozenset("*?[")


@dataclass(frozen=True)
class Pose:
    """A rigid pose: position (x, y, z) in metres and quaternion xyzw, child to parent."""

    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    quaternion_xyzw: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)


@dataclass(frozen=True)
class SceneBody:
    """One body as declared.

    Parameters
    ----------
    id : the name its track has.
    mesh : path of a mesh file relative to the scene, or ``""``; ``node``: of a GLB what hangs on that node or joint.
    shape : ``box``, ``sphere``, ``capsule`` or ``cylinder`` with its sizes in ``size``, or an instrument's name in
        ``instrument``; one of mesh, shape and instrument, or none when the session carries the mesh.
    size : sizes of the shape by name, metres.
    scale : factor from the mesh file's unit to metres.
    group : bodies of one group are never paired with each other.
    parent : the body whose frame this one's pose is relative to (a joint), or ``""``.
    mesh_axes : axes of the mesh file, as ``--mesh-axes`` takes them; ``""``: those that its type is taken to have.
    offset : pose of the mesh in its tracker's frame.
    fixed : pose of a body that has no track because it never moves (relative to ``parent`` or the world).
    tags : words effects and pairs can refer to, for example ``glass``.
    proxy : the mesh only stands in for the real one; every report says so.
    extra : further keys that effects read (``mass``, ``cavity``, ...), as written.
    """

    id: str
    mesh: str = ""
    node: str = ""
    shape: str = ""
    instrument: str = ""
    size: Mapping[str, Any] = field(default_factory=dict)
    scale: float = 1.0
    mesh_axes: str = ""
    group: str = ""
    parent: str = ""
    offset: Pose = field(default_factory=Pose)
    fixed: Pose | None = None
    tags: tuple[str, ...] = ()
    proxy: bool = False
    extra: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class SceneEffect:
    """One effect as declared: its kind and its keys as written (``between`` holds ids or ``tag:WORD`` selectors)."""

    kind: str
    settings: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class SceneGroup:
    """Bodies that are one thing, as the links of a hand: its contacts are counted as those of one body.

    Members are never paired with each other.
    """

    name: str
    members: tuple[str, ...]


@dataclass(frozen=True)
class Scene:
    """The declarations of a scene, and the text they were read from.

    Parameters
    ----------
    name : the scene's name.
    bodies : declared bodies.
    groups : bodies that are counted as one thing.
    pairs : declared pairs of body names; ``None``: all with relative motion, minus groups and ``ignore``.
    ignore : pairs of body names left out.
    effects : declared effects; ``None`` when the scene has no effects table at all, ``()`` when it declares none.
    colliders : path of a GLB with the colliders of an engine, relative to the scene, or ``""``.
    space_radius : metres from the origin; a pose further out is none that was measured.
    text : the TOML it was read from, kept so that the file carries what the author wrote.
    file : name of the file that it was read from, for messages; scenes that differ by it alone are equal.
    """

    name: str = ""
    bodies: tuple[SceneBody, ...] = ()
    groups: tuple[SceneGroup, ...] = ()
    pairs: tuple[tuple[str, str], ...] | None = None
    ignore: tuple[tuple[str, str], ...] = ()
    effects: tuple[SceneEffect, ...] | None = None
    colliders: str = ""
    space_radius: float = SPACE_RADIUS
    text: str = ""
    file: str = field(default="scene.toml", compare=False)

    def body(self, name: str) -> SceneBody | None:
        """The declaration of a body, or ``None``."""
        return next((body for body in self.bodies if body.id == name), None)

    @property
    def group_of(self) -> dict[str, str]:
        """Member -> name of its group."""
        return {member: group.name for group in self.groups for member in group.members}


def selected_bodies(scene: Scene, names: Sequence[str], selector: str) -> list[str]:
    """Bodies among ``names`` that a selector stands for: a name, a group, ``tag:WORD``, or a pattern of names (``*``).

    A pattern that matches a group stands for its members too. A name comes before a group of that name.
    """
    if selector in names:
        return [selector]
    if selector.startswith(TAG):
        chosen = {body.id for body in scene.bodies if selector.removeprefix(TAG) in body.tags}
    else:
        matches = fnmatchcase if not WILDCARDS.isdisjoint(selector) else str.__eq__
        chosen = {name for name in names if matches(name, selector)}
        chosen |= {member for group in scene.groups if matches(group.name, selector) for member in group.members}
    return [name for name in names if name in chosen]


def candidate_pairs(scene: Scene, names: Sequence[str]) -> list[tuple[str, str]]:
    """Pairs of names, in the order declared, else in the order of ``names``.

    Whether two bodies ever move relative to each other is for the poses to say and not asked here. Declared pairs of
    which a body is not among ``names`` are left out; ``absent_bodies`` names those bodies.
    """
    present = set(names)
    if scene.pairs is not None:
        return [pair for pair in scene.pairs if present.issuperset(pair)]
    ignored = {frozenset(pair) for pair in scene.ignore}
    group, united = {body.id: body.group for body in scene.bodies}, scene.group_of
    return [
        (a, b)
        for index, a in enumerate(names)
        for b in names[index + 1 :]
        if frozenset((a, b)) not in ignored
        and not (group.get(a) and group.get(a) == group.get(b))
        and not (a in united and united[a] == united.get(b))
    ]


def absent_bodies(scene: Scene, names: Sequence[str]) -> list[str]:
    """Bodies of declared pairs that are not among ``names``, each once."""
    present = set(names)
    return list(dict.fromkeys(name for pair in scene.pairs or () for name in pair if name not in present))
