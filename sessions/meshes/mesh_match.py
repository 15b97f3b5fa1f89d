"""Meshes and colliders as people ship them: which body each is of, by its name, and in which unit, by its size."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Final

import numpy as np

from sessions.errors import MeshFileError
from sessions.file_kinds import file_kind
from sessions.input_files import check_regular, open_input, read_bytes
from sessions.mesh_data import MeshData
from sessions.meshes.glb_tree import COLLIDER_NAME, GlbTree, read_glb, rigid_of
from sessions.meshes.hull import convex_hull
from sessions.meshes.mesh_files import FILE_TYPES, load_mesh
from sessions.quantities import length, number

UNITS: Final = {"m": 1.0, "cm": 0.01, "mm": 0.001, "inch": 0.0254, "ft": 0.3048}
GUESSED_UNITS: Final = ("m", "cm", "mm")
"""Units that the size of a mesh may tell; the others are taken where somebody says them."""
UNIT_NAMES: Final = {
    **dict.fromkeys(("m", "meter", "meters", "metre", "metres"), "m"),
    **dict.fromkeys(("cm", "centimeter", "centimeters", "centimetre", "centimetres"), "cm"),
    **dict.fromkeys(("mm", "millimeter", "millimeters", "millimetre", "millimetres"), "mm"),
    **dict.fromkeys(("in", "inch", "inches"), "inch"),
    **dict.fromkeys(("ft", "foot", "feet"), "ft"),
}
STATED_UNIT: Final = re.compile(rb"\bunits?\b(?:\s+(?:are|is|in))*\s*[:=]?\s*([a-z]+)", re.IGNORECASE)
"""As ``# File units = inches`` in the comments of an OBJ, ``UNITS=mm`` in the header of an STL."""
HEADER_BYTES: Final = {"stl": 80, "obj": 4096, "ply": 4096, "off": 4096}
"""Type of a mesh file -> how many bytes of it are looked through for comments."""
COMMENTS: Final = (b"#", b"comment", b"obj_info")
SMALLEST_M, LARGEST_M, USUAL_M = 0.005, 5.0, 0.15
"""Of what a hand moves or stands beside: a stopper, a bench, a beaker. Beyond the first two a file is not in metres."""

FORMAT_UNIT: Final = {"glb": "m"}
"""Type of a mesh file -> the unit that its standard defines."""

MUCH_UNLIKELIER: Final = 3.0
"""Beside other meshes of its unit, a mesh has another one only where its size is then at most so much less usual."""

MOST_FILES: Final = 10_000


@dataclass(frozen=True, eq=False)
class Match:
    """The mesh found for a body: in metres, its file, the node of a GLB (or ``""``), its scale, and why, in words."""

    mesh: MeshData
    file: Path
    node: str
    scale: float
    sentence: str


def stated_unit(file: Path) -> str:
    """Returns the unit that comments or the header of a mesh file state, or ``""``; of a GLB its standard states it."""
    kind = file.suffix.lower().removeprefix(".")
    with open_input(file, "mesh file", MeshFileError) as stream:
        head = stream.read(HEADER_BYTES.get(kind, 0))
    lines = [head] if kind == "stl" else [line for line in head.splitlines() if line.lstrip().startswith(COMMENTS)]
    names = [name.decode().lower() for line in lines for name in STATED_UNIT.findall(line)]
    return next((UNIT_NAMES[name] for name in names if name in UNIT_NAMES), "")


def unit_of_file(mesh: MeshData, file: Path, what: str) -> tuple[float, str]:
    """Returns metres per unit and a sentence: what the file states, else the guess by the size of its mesh."""
    unit = stated_unit(file)
    if unit:
        return UNITS[unit], f"{what} says that it is in {unit}"
    return guessed_unit(mesh, what)


def guessed_unit(mesh: MeshData, what: str) -> tuple[float, str]:
    """Metres per unit, and what was assumed; no words where metres make sense.

    A file names no unit (a GLB is in metres, if its exporter kept to the format). Of metres, centimetres and
    millimetres, the one is taken that makes it a thing for hands.
    """
    size = float((mesh.bounds[1] - mesh.bounds[0]).max())
    if SMALLEST_M <= size <= LARGEST_M or size == 0.0:
        return 1.0, ""
    unit = min(GUESSED_UNITS, key=lambda name: _unlikeliness(size * UNITS[name]))
    if unit == "m":
        return 1.0, f"{what} is {length(size)} long, taken as it is; if it is drawn in another unit, say so"
    return UNITS[unit], f"{what} is {number(size, digits=4)} units long, taken for {unit}: {length(size * UNITS[unit])}"


def possible_units(mesh: MeshData, unit: str) -> tuple[str, ...]:
    """Returns the units that make a mesh (in metres) a thing for hands, first the one that its file was taken for."""
    size = file_size(mesh, unit)
    others = (other for other in GUESSED_UNITS if other != unit and SMALLEST_M <= size * UNITS[other] <= LARGEST_M)
    return (unit, *others)


def likely_units(mesh: MeshData, unit: str) -> tuple[str, ...]:
    """Returns the possible units without those that make the mesh one of a size much less usual."""
    size = file_size(mesh, unit)
    if not size:
        return (unit,)
    most = MUCH_UNLIKELIER * _unlikeliness(size * UNITS[unit])
    others = (other for other in possible_units(mesh, unit)[1:] if _unlikeliness(size * UNITS[other]) <= most)
    return (unit, *others)


def file_size(mesh: MeshData, unit: str) -> float:
    """Returns the largest side of the bounds of a mesh (in metres) in the unit of its file."""
    return float((mesh.bounds[1] - mesh.bounds[0]).max()) / UNITS[unit]


def _unlikeliness(size: float) -> float:
    """How many times as large or as small as a beaker a thing of a size in metres is."""
    return max(size / USUAL_M, USUAL_M / size)


def match_meshes(
    path: Path, names: Sequence[str], scales: Mapping[str, float] = MappingProxyType({})
) -> tuple[dict[str, Match], list[str]]:
    """Body -> its mesh among the files of a folder, or the nodes of one GLB; and which bodies have none.

    A file or node is a body's when its name is the same, capitals, signs and ``(Clone)`` left out; else a file is when
    it is the only one whose words hold the body's, or are held by them (``beaker_v2`` for ``beaker``).

    ``scales``: body, or ``""`` for all others -> metres per unit; else it is guessed.

    Raises MeshFileError: no folder and no GLB, or no mesh file in it.
    """
    offered = [*_offered_meshes(path)]
    if not offered:
        raise MeshFileError(f"{path} holds no mesh; name a folder of {', '.join(FILE_TYPES)} files, or a GLB")
    matches, notes = {}, []
    for name in names:
        choice = _choice(name, offered)
        if choice is None:
            continue
        if isinstance(choice, str):
            notes.append(choice)
            continue
        label, file, node = choice
        mesh = load_mesh(file, 1.0, node)
        what = f"{file.name}, node {node}" if node else file.name
        scale = scales.get(name, scales.get(""))
        factor, assumed = (scale, "") if scale is not None else unit_of_file(mesh, file, what)
        phrases = [f"{name}: {what}", "" if _plain(label) == _plain(name) else "a like name", assumed]
        text = "; ".join(phrase for phrase in phrases if phrase)
        matches[name] = Match(MeshData(mesh.vertices * factor, mesh.faces), file, node, factor, text)
    bare = [name for name in names if name not in matches]
    return matches, notes + [f"no mesh is named like: {', '.join(bare)}"] * bool(bare)


Offer = tuple[str, Path, str]
"""Name, file, node."""


def _offered_meshes(path: Path) -> Iterator[Offer]:
    if not path.is_dir():
        check_regular(path, "mesh file", MeshFileError)
    files = sorted(path.rglob("*"))[:MOST_FILES] if path.is_dir() else [path]
    for file in files:
        kind = file.suffix.lower().removeprefix(".")
        if kind not in FILE_TYPES or not file.is_file():
            continue
        if path.is_dir():
            yield file.stem, file, ""
        if kind != "glb":
            continue
        try:
            owners = read_glb(file.read_bytes()).owners
        except Exception as error:  # of a damaged file; those who load it say what is wrong
            if path.is_dir():
                continue
            raise MeshFileError(f"mesh file {file}: this is no readable GLB ({error}); export it again") from error
        yield from ((node, file, node) for node in owners if len(owners) > 1 or not path.is_dir())


def _choice(name: str, offered: Iterable[Offer]) -> Offer | str | None:
    """The offer for a body, nothing, or a sentence where several are as good."""
    plain = _plain(name)
    same = [offer for offer in offered if _plain(offer[0]) == plain]
    tokens = _name_tokens(name)
    like = [
        offer
        for offer in offered
        if not offer[2] and (_name_tokens(offer[0]) <= tokens or tokens <= _name_tokens(offer[0]))
    ]
    for some in (same, like):
        if len(some) == 1:
            return some[0]
        if some:
            listed = ", ".join(f"{file.name}{', node ' + node if node else ''}" for _, file, node in some[:4])
            return f"{name}: several are named so: {listed}; name one with mesh = FILE in the scene"
    return None


def _name_tokens(name: str) -> set[str]:
    return {word.lower() for word in re.findall("[A-Z]?[a-z]+|[A-Z]+(?![a-z])|[0-9]+", name)} - {"clone"}


def _plain(name: str) -> str:
    return re.sub(r"\(clone\)|[\W_]", "", name.lower())


@dataclass(frozen=True, eq=False)
class ColliderFile:
    """Colliders of a file: body -> those in its own frame, in the order of the nodes.

    ``unowned``: names of nodes with a mesh of no body; ``sentence``: one on all of it.
    """

    solids: dict[str, tuple[MeshData, ...]]
    unowned: tuple[str, ...]
    sentence: str

    @property
    def count(self) -> int:
        """Number of colliders of bodies."""
        return sum(map(len, self.solids.values()))


def read_colliders(path: Path, names: Sequence[str] | None) -> ColliderFile:
    """Returns the colliders of a GLB.

    ``names`` of the bodies; ``None``: whichever the nodes name.

    A node ``UBX_``, ``USP_``, ``UCP_`` or ``UCX_``, a body's name, ``_`` and a number is a convex collider of it: the
    hull of its corners. ``UTM_`` is one as it is, and so is any other mesh on or below a node of a body's name. Beside
    colliders of these names, a mesh on the node of the body's own name is what is drawn, and no collider. The body's
    frame is that of the node of its name, without scale; the file's own where there is none.

    Raises MeshFileError: no GLB, or no collider of any of these bodies.

    Source: Epic Games, FBX Static Mesh Pipeline, collision (the prefixes).
    """
    data = read_bytes(path, "collider file", MeshFileError)
    try:
        tree = read_glb(data)
    except MeshFileError as error:
        kind = None if data.startswith(b"glTF") else file_kind(data)
        reason = f"it is {kind.noun}, no GLB; {kind.cure}" if kind else str(error)
        raise MeshFileError(f"collider file {path}: {reason}") from None
    except Exception as error:  # as in mesh files: any error means damaged
        raise MeshFileError(f"collider file {path}: this is no readable GLB ({error}); export it again") from error
    prefixed = {named[2] for named in map(COLLIDER_NAME.fullmatch, tree.names) if named}
    colliders: dict[str, list[MeshData]] = {}
    left = []
    drawn: list[str] = []
    for surface in sorted(tree.surfaces, key=lambda surface: (surface.node, surface.order)):
        named = COLLIDER_NAME.fullmatch(tree.names[surface.node])
        body, convex = (named[2], named[1] != "UTM") if named else (_body_above(tree, surface.node, names or ()), False)
        if not body or (names is not None and body not in names):
            left.append(tree.names[surface.node])
            continue
        if tree.names[surface.node] == body and body in prefixed:
            drawn.append(body)
            continue
        frame = rigid_of(tree.poses[tree.names.index(body)]) if body in tree.names else np.eye(4)
        mesh = tree.in_frame(frame, surface)
        colliders.setdefault(body, []).append(convex_hull(mesh) if convex else mesh)
    if not colliders:
        advice = "name its nodes UCX_BODY_01 and so on, or hang them on a node of the body's name"
        raise MeshFileError(f"collider file {path}: no collider of {', '.join((names or ['any body'])[:8])}; {advice}")
    text = f"colliders of {path.name}: " + ", ".join(f"{name} {len(solids)}" for name, solids in colliders.items())
    if drawn:
        text += f" (drawn beside them: {', '.join(drawn[:8])})"
    if left:
        text += f" (of no body: {', '.join(left[:8])})"
    return ColliderFile({name: tuple(solids) for name, solids in colliders.items()}, tuple(left), text)


def _body_above(tree: GlbTree, node: int, names: Sequence[str]) -> str:
    """The body on whose node this one hangs, or ``""``."""
    return next((tree.names[number] for number in tree.above(node) if tree.names[number] in names), "")
