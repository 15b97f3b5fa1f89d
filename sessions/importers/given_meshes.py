"""Meshes that come beside a recording: read from their files, in metres, in the axes of their bodies.

What a file does not say, its axes and its unit, is assumed; every assumption is kept with who says it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Final

from sessions.errors import ImportFileError, SessionError
from sessions.input_files import nearest
from sessions.mesh_data import MeshData
from sessions.meshes.conventions import Convention
from sessions.meshes.mesh_axes import (
    mesh_axes_matrix,
)
from sessions.meshes.mesh_match import UNITS, match_meshes, stated_unit, unit_of_file
from sessions.model.assumption import Assumption, Origin, grouped_assumptions
from sessions.model.scene import Scene
from sessions.scene_files.body_axes import axes_assumption, in_body_axes
from sessions.scene_files.mesh_units import mesh_unit, scene_mesh_unit, units_beside_others

MeshSource = str | Path | MeshData

MESH_AXES_KEY, MESH_UNITS_KEY, COLLIDER_AXES_KEY = "mesh_axes", "mesh_units", "collider_axes"
MESH_KEYS: Final = (MESH_AXES_KEY, MESH_UNITS_KEY, COLLIDER_AXES_KEY)
"""Keys of a mapping on the meshes beside a recording; they take what the options of these names take."""


@dataclass(frozen=True)
class MeshOptions:
    """The user's options for meshes, as in ``replay import``.

    Parameters
    ----------
    meshes : body name -> mesh file, or a mesh in metres and canonical axes; they win over the scene's.
    mesh_folder : a folder of mesh files, or a GLB of nodes, named like the bodies.
    mesh_units : m, cm, mm, inch or ft of the mesh files; of several, ``BODY=cm`` is for one body; none: as the file
        says, by its standard or its size.
    mesh_axes : axes of the mesh files, as `mesh_axes_matrix` takes them; of several, ``BODY=NAME`` is for one body.
    colliders : a GLB with the colliders of an engine.
    collider_axes : axes of that file; ``""``: those of the recording.
    """

    meshes: Mapping[str, MeshSource] | None = None
    mesh_folder: str | Path | None = None
    mesh_units: str | Sequence[str] = ()
    mesh_axes: str | Sequence[str] = ()
    colliders: str | Path | None = None
    collider_axes: str = ""

    def axes_by_body(self, names: Sequence[str], poses: Convention) -> dict[str, str]:
        """Returns body -> axes, and ``""`` -> those of all others where they are given.

        Raises ImportFileError: unknown axes, or a body that is not there.
        """
        chosen: dict[str, str] = {}
        for text in _texts(self.mesh_axes):
            body, equals, axes = text.partition("=")
            if not equals or (body not in names and _is_axes(text, poses)):
                body, axes = "", text
            if body and body not in names:
                raise ImportFileError(f"--mesh-axes {text}: there is no body {body!r}{nearest(body, names)}")
            if not _is_axes(axes, poses):
                mesh_axes_or_refusal(axes, poses)
            _choose(chosen, body, axes, "--mesh-axes")
        return chosen

    def units_by_body(self, names: Sequence[str]) -> dict[str, str]:
        """Returns body -> unit of its mesh file, and ``""`` -> that of all others where it is given.

        Raises ImportFileError: an unknown unit, or a body that is not there.
        """
        chosen: dict[str, str] = {}
        for text in _texts(self.mesh_units):
            body, _, unit = text.rpartition("=")
            if body and body not in names:
                raise ImportFileError(f"--mesh-units {text}: there is no body {body!r}{nearest(body, names)}")
            if unit not in UNITS:
                raise ImportFileError(f"--mesh-units {text}: there is no unit {unit!r}{nearest(unit, UNITS)}")
            _choose(chosen, body, unit, "--mesh-units")
        return chosen


MESH_OPTIONS: Final = tuple(option.name for option in fields(MeshOptions))


def _choose(chosen: dict[str, str], body: str, choice: str, option: str) -> None:
    """Keep what an option says of a body, or of all others; ImportFileError where it said something else before."""
    if chosen.setdefault(body, choice) != choice:
        raise ImportFileError(f"{option} says {chosen[body]} and {choice} of {body or 'the same bodies'}; say one")


def _texts(values: str | Sequence[str]) -> list[str]:
    """The texts of an option that is given once or several times, without empty ones."""
    return [text for text in ([values] if isinstance(values, str) else values) if text]


def _is_axes(text: str, poses: Convention) -> bool:
    try:
        mesh_axes_matrix(text, poses)
    except SessionError:
        return False
    return True


def mesh_axes_or_refusal(text: str, poses: Convention) -> None:
    """Raise ImportFileError where no axes of meshes have this name."""
    try:
        mesh_axes_matrix(text, poses)
    except SessionError as error:
        raise ImportFileError(str(error)) from None


@dataclass(frozen=True, eq=False)
class FileMesh:
    """A mesh as its file has it: its axes are the file's.

    Parameters
    ----------
    mesh : in metres.
    file : its name; ``""``: an array, in the axes of the recording.
    unit : assumed unit, with who says it.
    """

    mesh: MeshData
    file: str
    unit: Assumption | None = None
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class PlacedMeshes:
    """Meshes in the axes of their bodies, with everything that was assumed of their files.

    Parameters
    ----------
    meshes : body name -> mesh.
    from_options : bodies whose mesh the options give.
    assumptions : axes and units of the files.
    notes : sentences on which file is whose, and on guessed units.
    """

    meshes: dict[str, MeshData]
    from_options: tuple[str, ...] = ()
    assumptions: list[Assumption] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def placed_meshes(
    options: MeshOptions, scene: Scene, scene_meshes: Mapping[str, MeshData], names: Sequence[str], poses: Convention
) -> PlacedMeshes:
    """Returns the meshes of a scene and of the options in canonical axes; those of the options win.

    Parameters
    ----------
    scene, scene_meshes : what was declared, and its meshes as `scene_meshes` reads them.
    names : every body that there is.
    poses : the convention of the poses.

    Raises ImportFileError: a mesh for a body that is not there, unknown axes.
    """
    from_scene = {
        body.id: FileMesh(scene_meshes[body.id], body.mesh, scene_mesh_unit(body, scene_meshes[body.id]))
        for body in scene.bodies
        if body.mesh
    }
    given, notes = _meshes_of_options(options, names, poses)
    axes_by_body = options.axes_by_body(names, poses)
    for body in scene.bodies:
        if body.mesh and body.mesh_axes and body.id not in given:
            axes_by_body.setdefault(body.id, body.mesh_axes)
    placed = PlacedMeshes({**scene_meshes}, tuple(given), notes=notes)
    file_meshes = {**from_scene, **given}
    if not file_meshes:
        return placed
    units = {name: row.unit for name, row in file_meshes.items() if row.unit is not None}
    sizes = {name: row.mesh for name, row in file_meshes.items()}
    placed.assumptions.extend(grouped_assumptions(units_beside_others(units, sizes)))
    axes_rows: dict[str, Assumption] = {}
    for name, row in file_meshes.items():
        stated = axes_by_body.get(name, axes_by_body.get("", ""))
        if not row.file and not stated:
            placed.meshes[name] = row.mesh
            continue
        axes = axes_assumption(name, row.file or f"the array of {name}", stated, poses)
        axes_rows[name] = axes
        placed.meshes[name] = in_body_axes(row.mesh, axes.value, poses)
    placed.assumptions.extend(grouped_assumptions(axes_rows.values()))
    return placed


def _meshes_of_options(
    options: MeshOptions, names: Sequence[str], poses: Convention
) -> tuple[dict[str, FileMesh], list[str]]:
    """Body -> mesh of the options, and sentences on the files of a folder."""
    from sessions.meshes.mesh_files import load_mesh

    given, notes = dict[str, FileMesh](), list[str]()
    units = options.units_by_body(names)
    for name, source in (options.meshes or {}).items():
        if name not in names:
            raise ImportFileError(f"there is no body {name!r} to put a mesh on{nearest(name, names)}")
        if isinstance(source, MeshData):
            given[name] = FileMesh(source, "")
        else:
            unit = units.get(name, units.get("", ""))
            given[name] = _in_metres(load_mesh(source), Path(source), f"{name}: {Path(source).name}", unit, poses)
    notes += [note for row in given.values() for note in row.notes]
    if options.mesh_folder is not None:
        bare = [name for name in names if name not in given]
        scales = {name: UNITS[unit] for name, unit in units.items()}
        matches, without = match_meshes(Path(options.mesh_folder), bare, scales)
        for name, match in matches.items():
            stated = units.get(name, units.get("", ""))
            unit = _unit_of_scale(match.scale)
            stated_by = _stated_by(stated, match.file)
            assumption = mesh_unit(match.file.name, match.mesh, unit, poses, stated_by=stated_by)
            given[name] = FileMesh(match.mesh, match.file.name, assumption)
            notes.append(match.sentence)
        notes += without
    return given, notes


def _stated_by(unit: str, file: Path) -> Origin | None:
    """Who states the unit of a mesh file: the user by an option, or the file; ``None``: nobody."""
    if unit:
        return Origin.USER
    return Origin.FILE if stated_unit(file) else None


def _in_metres(mesh: MeshData, file: Path, what: str, stated: str, poses: Convention) -> FileMesh:
    """The mesh of a file in metres; ``stated``: its unit as the user says it, or ``""``."""
    if stated:
        factor, note = UNITS[stated], ""
    else:
        factor, note = unit_of_file(mesh, file, what)
    scaled = MeshData(mesh.vertices * factor, mesh.faces)
    unit = mesh_unit(file.name, scaled, _unit_of_scale(factor), poses, stated_by=_stated_by(stated, file))
    return FileMesh(scaled, file.name, unit, (note,) if note else ())


def _unit_of_scale(scale: float) -> str:
    return next(name for name, metres in UNITS.items() if metres == scale)
